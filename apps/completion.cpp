// `pulson completion`: scripts for shells, made from the verbs and their options.

#include "completion.hpp"

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "completion_scripts.hpp"
#include "known_values.hpp"
#include "misspelt.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/io/landmark_files.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "reproduce/laboratory.hpp"

namespace pulson {
namespace {

template <class Make>
std::vector<std::string> names_in(const NameTable<Make>& table) {
  std::vector<std::string> names;
  for (const auto& row : table.rows()) names.push_back(row.name);
  return names;
}

std::vector<std::string> values_of(const std::string& name) {
  if (name == "--kernel") return names_in(kernel_table());
  if (name == "--noise" || name == "--simulate") return names_in(noise_table());
  if (name == "--integrator") return names_in(integrator_table());
  std::vector<std::string> values;
  if (name == "--to")
    for (const LandmarkFormat& format : landmark_formats())
      if (format.write != nullptr) values.push_back(format.name);
  if (name == "EXPERIMENT") {
    values = {"all"};
    for (const Experiment& experiment : experiments()) values.push_back(experiment.name);
  }
  if (name == "WHAT") values = {"kernels", "noises", "integrators", "formats"};
  if (name == "SHELL") values = {"bash", "zsh", "fish"};
  return values.empty() ? known_values(name) : values;
}

CompletedVerb completed(const CLI::App& verb) {
  CompletedVerb result{verb.get_name(), verb.get_description(), {}, {}};
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional()) {
      for (const std::string& value : values_of(option->get_name(true))) result.words.push_back(value);
      continue;
    }
    CompletedOption known{{}, option->get_description(), option->get_expected_min() > 0, {}};
    for (const std::string& name : option->get_snames()) known.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) known.names.push_back("--" + name);
    if (known.takes_value) known.values = values_of(option->get_name());
    result.options.push_back(std::move(known));
  }
  return result;
}

void print_script(const CLI::App& program, const std::string& shell) {
  std::vector<CompletedVerb> verbs;
  for (const CLI::App* verb : program.get_subcommands({})) verbs.push_back(completed(*verb));
  if (shell == "bash") return fmt::print("{}", bash_completion(verbs));
  if (shell == "zsh") return fmt::print("{}", zsh_completion(verbs));
  if (shell == "fish") return fmt::print("{}", fish_completion(verbs));
  throw InputError(fmt::format("unknown shell '{}'{}", shell, advice_on_name(shell, values_of("SHELL"))));
}

}  // namespace

void add_completion_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("completion", "Print a script that completes words of pulson in a shell");
  const auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "bash, zsh or fish")->required();
  verb->footer(
      "Examples:\n"
      "  source <(pulson completion bash)\n"
      "  pulson completion bash > ~/.local/share/bash-completion/completions/pulson\n"
      "  pulson completion zsh > \"${fpath[1]}/_pulson\"\n"
      "  pulson completion fish > ~/.config/fish/completions/pulson.fish\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([&program, shell] { print_script(program, *shell); });
}

}  // namespace pulson
