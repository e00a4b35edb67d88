// `pulson completion`: a script for bash, made from the verbs and their options.

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "options.hpp"
#include "printing.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/inference/posterior.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "reproduce/laboratory.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

constexpr const char* kShell = "bash";

struct CompletedOption {
  std::vector<std::string> names;  ///< "-o", "--out"
  bool takes_value;
  std::vector<std::string> values;  ///< known beginnings of the value; files where there are none
};

struct CompletedVerb {
  std::string name;
  std::vector<CompletedOption> options;
  std::vector<std::string> words;  ///< that stand beside options, besides files
};

std::vector<std::string> names_of_options(const CompletedVerb& verb) {
  std::vector<std::string> names;
  for (const CompletedOption& option : verb.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

std::string bash_case(const CompletedVerb& verb) {
  std::string text = fmt::format("    {})\n      options='{}'\n      case \"$before\" in\n", verb.name,
                                 fmt::join(names_of_options(verb), " "));
  for (const CompletedOption& option : verb.options)
    if (option.takes_value)
      text += fmt::format("        {}) values='{}'; options= ;;\n", fmt::join(option.names, "|"),
                          fmt::join(option.values, " "));
  return text + fmt::format("        *) values='{}' ;;\n      esac ;;\n", fmt::join(verb.words, " "));
}

std::string bash_completion(const std::vector<CompletedVerb>& verbs) {
  std::string names;
  std::string cases;
  for (const CompletedVerb& verb : verbs) {
    names += verb.name + " ";
    cases += bash_case(verb);
  }
  // Bash takes --mode=map for three words.
  return fmt::format(R"(# bash completion of pulson: source <(pulson completion bash)
_pulson() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" options= values=
  if [[ $before == = ]]; then before="${{COMP_WORDS[COMP_CWORD-2]}}"; fi
  if [[ $word == = ]]; then word=; fi
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W '{}--help --version' -- "$word"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{}  esac
  if [[ $word == -* && -n $options ]]; then values=$options; fi
  COMPREPLY=($(compgen -W "$values" -- "$word"))
}}
complete -o default -F _pulson pulson
)",
                     names, cases);
}

std::vector<std::string> values_of(const std::string& verb, const std::string& name) {
  if (name == "--kernel") return names_in(kernel_table());
  if (name == "--noise" || name == "--simulate") return names_in(noise_table());
  if (name == "--integrator") return names_in(integrator_table());
  if (name == "--method" && verb == "sample") return names_in(inference::sampler_table());
  std::vector<std::string> values;
  if (name == "--to")
    for (const formats::LandmarkFormat& format : formats::landmark_formats())
      if (format.write != nullptr) values.push_back(format.name);
  if (name == "EXPERIMENT") {
    values = {"all"};
    for (const Experiment& experiment : experiments()) values.push_back(experiment.name);
  }
  if (name == "WHAT") values = {"kernels", "noises", "integrators", "formats", "defaults", "columns"};
  if (name == "SHELL") values = {kShell};
  return values.empty() ? known_values(name) : values;
}

CompletedVerb completed(const CLI::App& verb) {
  CompletedVerb result{verb.get_name(), {}, {}};
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional()) {
      for (const std::string& value : values_of(verb.get_name(), option->get_name(true))) result.words.push_back(value);
      continue;
    }
    CompletedOption known{{}, option->get_expected_min() > 0, {}};
    for (const std::string& name : option->get_snames()) known.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) known.names.push_back("--" + name);
    if (known.takes_value) known.values = values_of(verb.get_name(), option->get_name());
    result.options.push_back(std::move(known));
  }
  return result;
}

void print_script(const CLI::App& program, const std::string& shell) {
  if (shell != kShell) throw InputError(fmt::format("unknown shell '{}'; completion is for {}", shell, kShell));
  std::vector<CompletedVerb> verbs;
  for (const CLI::App* verb : program.get_subcommands({})) verbs.push_back(completed(*verb));
  print_exact(bash_completion(verbs));
}

}  // namespace

void add_completion_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("completion", "Print a shell completion script");
  const auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "bash")->type_name("NAME")->required();
  verb->footer(
      "Examples:\n"
      "  source <(pulson completion bash)\n"
      "  pulson completion bash > ~/.local/share/bash-completion/completions/pulson\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([&program, shell] { print_script(program, *shell); });
}

}  // namespace pulson
