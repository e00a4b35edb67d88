#include "messages.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>
#include <string>

#include <fmt/core.h>
#include <unistd.h>

#include "option_words.hpp"
#include "terminal.hpp"

namespace pulson {
namespace {

using Clock = std::chrono::steady_clock;

const Clock::time_point kBegin = Clock::now();
Verbosity chosen = Verbosity::kNormal;

void print_message(Style style, std::string_view name, std::string_view text) {
  std::fflush(stdout);
  std::string line = in_option_words(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  fmt::print(stderr, "{} {}\n", painted(style, name, STDERR_FILENO), line);
}

}  // namespace

std::string counted(std::int64_t count, std::string_view noun, std::string_view rest) {
  return fmt::format("{} {}{}{}{}", count, noun, count == 1 ? "" : "s", rest.empty() ? "" : " ", rest);
}

Verbosity verbosity() { return chosen; }

void add_quiet_option(CLI::App& verb) {
  verb.add_flag_callback(
      "-q,--quiet", [] { chosen = Verbosity::kQuiet; }, "print warnings and errors only");
}

void add_verbose_option(CLI::App& verb) {
  CLI::Option* verbose = verb.add_flag_callback(
      "-v,--verbose", [] { chosen = Verbosity::kVerbose; }, "log each step with its time, on standard error");
  if (CLI::Option* quiet = verb.get_option_no_throw("--quiet")) verbose->excludes(quiet);
}

void print_error(std::string_view text) { print_message(Style::kError, "pulson:", text); }

void print_warning(std::string_view text) { print_message(Style::kWarning, "warning:", text); }

void print_note(std::string_view text) {
  if (chosen != Verbosity::kQuiet) print_message(Style::kNote, "note:", text);
}

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : without_repeats(notes)) print_note(note);
}

std::vector<std::string> without_repeats(const std::vector<std::string>& notes) {
  std::set<std::string> seen;
  std::vector<std::string> kept;
  for (const std::string& note : notes)
    if (seen.insert(note).second) kept.push_back(note);
  return kept;
}

void log_step(std::string_view text) {
  if (chosen != Verbosity::kVerbose) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - kBegin).count();
  print_message(Style::kNote, fmt::format("{:8.3f} s", seconds), text);
}

}  // namespace pulson
