#pragma once

#include <functional>

#include <CLI/App.hpp>

namespace pulson {

/// What main() is of each of our programs: parses the arguments for the verbs that `add_verbs` adds, and turns errors
/// into one line and an exit code.
int run_program(int argc, char** argv, const std::function<void(CLI::App& program, int& exit_code)>& add_verbs);

}  // namespace pulson
