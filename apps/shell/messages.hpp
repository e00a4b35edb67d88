#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

namespace pulson {

/// "1 pair of landmarks", "2 pairs of landmarks".
std::string counted(std::int64_t count, std::string_view noun, std::string_view rest = {});

/// How much the program prints: results and notes; warnings and errors only; or every step as well.
enum class Verbosity { kQuiet, kNormal, kVerbose };

Verbosity verbosity();

/// `--quiet`, which every verb has.
void add_quiet_option(CLI::App& verb);
/// `--verbose`, which every verb has.
void add_verbose_option(CLI::App& verb);

// All go to standard error, one line each, and standard output is written out before.

/// "pulson: ", for what ends the program.
void print_error(std::string_view text);
/// "warning: ", always.
void print_warning(std::string_view text);
/// "note: ", unless quiet.
void print_note(std::string_view text);
void print_notes(const std::vector<std::string>& notes);
/// Each note once, in order: a file that holds both shapes says the same of each.
std::vector<std::string> without_repeats(const std::vector<std::string>& notes);
/// A step taken and the seconds since the program began, where that is asked for.
void log_step(std::string_view text);

}  // namespace pulson
