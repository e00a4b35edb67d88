#pragma once

#include <functional>
#include <string>

#include <CLI/App.hpp>

namespace pulson {

/// All of main(): parses the arguments for the verbs that `add_verbs` adds, and turns errors
/// into one line and an exit code.
int run_program(int argc, char** argv, const std::function<void(CLI::App& program, int& exit_code)>& add_verbs);

/// The command line of this run as a shell reads it, for reports: `pulson register 'a b.csv' …`. Empty outside
/// run_program().
const std::string& command_line();

}  // namespace pulson
