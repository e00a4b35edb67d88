#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// `pulson completion bash|zsh|fish`: prints the shell's script for the verbs that `program` has by then.
void add_completion_verb(CLI::App& program);

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

std::string bash_completion(const std::vector<CompletedVerb>& verbs);
std::string zsh_completion(const std::vector<CompletedVerb>& verbs);
std::string fish_completion(const std::vector<CompletedVerb>& verbs);

}  // namespace pulson
