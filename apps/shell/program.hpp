#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// All of main(): parses the arguments for the verbs that `add_verbs` adds, and turns errors
/// into one line and an exit code.
int run_program(int argc, char** argv, const std::function<void(CLI::App& program, int& exit_code)>& add_verbs);

/// The command line of this run as a shell reads it, for reports: `pulson register 'a b.csv' …`. Empty outside
/// run_program().
const std::string& command_line();

/// A word as a shell reads it, in quotes where it has to be.
std::string shell_word(std::string_view word);

/// What `--version` prints: "pulson 0.1.0", then vector code, compiler, threads and libraries, a line each.
std::string build_facts();

/// Help as wide as the terminal, at least 80 columns, and 100 where there is none. Descriptions are wrapped, not cut;
/// indented lines of a footer, which are commands to be copied, stay whole.
std::shared_ptr<CLI::FormatterBase> help_formatter();

/// What the program says where it is called without arguments.
std::string welcome();

/// Lines of at most `width` columns; a longer word has a line of its own.
std::vector<std::string> wrapped(std::string_view text, std::size_t width);

}  // namespace pulson
