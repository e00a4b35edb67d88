// `pulson completion`: scripts for shells, made from the verbs and their options.

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "options.hpp"
#include "printing.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "reproduce/laboratory.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

struct CompletedOption {
  std::vector<std::string> names;  ///< "-o", "--out"
  std::string help;
  bool takes_value;
  std::vector<std::string> values;  ///< known beginnings of the value; files where there are none
};

struct CompletedVerb {
  std::string name;
  std::string help;
  std::vector<CompletedOption> options;
  std::vector<std::string> words;  ///< that stand beside options, besides files
};

/// In single quotes, where `'` ends them for a moment.
std::string in_shell_quotes(const std::string& text) {
  std::string result = "'";
  for (const char c : text)
    result += c == '\'' ? std::string("'\\''") : c == '\n' ? std::string(" ") : std::string(1, c);
  return result + "'";
}

std::vector<std::string> names_of_options(const CompletedVerb& verb) {
  std::vector<std::string> names;
  for (const CompletedOption& option : verb.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

// ---- bash

std::string bash_case(const CompletedVerb& verb) {
  std::string text = fmt::format("    {})\n      options='{}'\n      case \"$before\" in\n", verb.name,
                                 fmt::join(names_of_options(verb), " "));
  for (const CompletedOption& option : verb.options)
    if (option.takes_value)
      text += fmt::format("        {}) values='{}'; options= ;;\n", fmt::join(option.names, "|"),
                          fmt::join(option.values, " "));
  return text + fmt::format("        *) values='{}' ;;\n      esac ;;\n", fmt::join(verb.words, " "));
}

// ---- zsh

/// Text within [] and between the colons of a specification of _arguments.
std::string zsh_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string zsh_action(const std::vector<std::string>& values) {
  // Values begin a specification, which goes on with a colon.
  return values.empty() ? "_files" : fmt::format("compadd -S \"\" -- {}", fmt::join(values, " "));
}

std::string zsh_case(const CompletedVerb& verb) {
  std::string text = fmt::format("    {})\n      _arguments -s \\\n", verb.name);
  for (const CompletedOption& option : verb.options)
    for (const std::string& name : option.names) {
      std::string spec = fmt::format("*{}[{}]", name, zsh_text(option.help));
      if (option.takes_value) spec += ":value:" + zsh_action(option.values);
      text += fmt::format("        {} \\\n", in_shell_quotes(spec));
    }
  const std::string words =
      verb.words.empty() ? "_files" : fmt::format("{{compadd -- {}; _files}}", fmt::join(verb.words, " "));
  return text + fmt::format("        {} ;;\n", in_shell_quotes("*:file:" + words));
}

// ---- fish

std::string fish_option(const CompletedVerb& verb, const CompletedOption& option) {
  std::string text = fmt::format("complete -c pulson -n '__fish_seen_subcommand_from {}'", verb.name);
  for (const std::string& name : option.names)
    text += name[1] == '-' ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (option.takes_value) text += option.values.empty() ? " -r -F" : " -x";
  if (!option.values.empty()) text += fmt::format(" -a '{}'", fmt::join(option.values, " "));
  std::string help = option.help;
  for (std::size_t at = 0; (at = help.find('\\', at)) != std::string::npos; at += 2) help.insert(at, "\\");
  std::string escaped;
  for (const char c : help)
    escaped += c == '\'' ? std::string("\\'") : c == '\n' ? std::string(" ") : std::string(1, c);
  return text + " -d '" + escaped + "'\n";
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

std::string zsh_completion(const std::vector<CompletedVerb>& verbs) {
  std::string names;
  std::string cases;
  for (const CompletedVerb& verb : verbs) {
    names += "    " + in_shell_quotes(zsh_text(verb.name) + ":" + verb.help) + "\n";
    cases += zsh_case(verb);
  }
  return fmt::format(R"(#compdef pulson
_pulson() {{
  local -a verbs
  verbs=(
{}  )
  if ((CURRENT == 2)); then
    _describe verb verbs
    return
  fi
  shift words
  ((CURRENT--))
  case "$words[1]" in
{}  esac
}}
if [[ "$funcstack[1]" == _pulson ]]; then _pulson "$@"; else compdef _pulson pulson; fi
)",
                     names, cases);
}

std::string fish_completion(const std::vector<CompletedVerb>& verbs) {
  std::string text = "# fish completion of pulson: pulson completion fish | source\n";
  for (const CompletedVerb& verb : verbs) {
    text += fmt::format("complete -c pulson -f -n __fish_use_subcommand -a {} -d {}\n", verb.name,
                        in_shell_quotes(verb.help));
    for (const CompletedOption& option : verb.options) text += fish_option(verb, option);
    if (!verb.words.empty())
      text += fmt::format("complete -c pulson -n '__fish_seen_subcommand_from {}' -a '{}'\n", verb.name,
                          fmt::join(verb.words, " "));
  }
  return text;
}

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
    for (const formats::LandmarkFormat& format : formats::landmark_formats())
      if (format.write != nullptr) values.push_back(format.name);
  if (name == "EXPERIMENT") {
    values = {"all"};
    for (const Experiment& experiment : experiments()) values.push_back(experiment.name);
  }
  if (name == "WHAT") values = {"kernels", "noises", "integrators", "formats", "defaults"};
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
  if (shell == "bash") return print_exact(bash_completion(verbs));
  if (shell == "zsh") return print_exact(zsh_completion(verbs));
  if (shell == "fish") return print_exact(fish_completion(verbs));
  throw InputError(fmt::format("unknown shell '{}'{}", shell, advice_on_name(shell, values_of("SHELL"))));
}

}  // namespace

void add_completion_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("completion", "Print a shell completion script");
  const auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "bash, zsh or fish")->type_name("NAME")->required();
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
