#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// `pulson completion bash|zsh|fish`: prints the shell's script for the verbs that `program` has by then.
void add_completion_verb(CLI::App& program);

}  // namespace pulson
