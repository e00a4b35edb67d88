// The parser, errors and exit codes.

#include "program.hpp"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/Error.hpp>
#include <fmt/format.h>

#include "build_facts.hpp"
#include "config.hpp"
#include "help.hpp"
#include "messages.hpp"
#include "misspelt.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

using AddVerbs = std::function<void(CLI::App&, int&)>;

int report_error(const std::string& message, int exit_code) {
  print_error(message);
  return exit_code;
}

// What every verb has besides its own options.
void add_common_options(CLI::App& verb) {
  if (verb.get_name() == "completion") return;
  add_verbose_option(verb);
  add_config_options(verb);
}

// --print-config is in place of the work.
void print_config(const CLI::App& program) {
  for (const CLI::App* verb : program.get_subcommands())
    if (asks_for_config(*verb)) {
      fmt::print("{}", config_text(*verb));
      throw CLI::Success();
    }
}

// As a shell reads it as one word.
std::string shell_word(std::string_view word) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_@%+=:,./-";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string& kept_command_line() {
  static std::string line;
  return line;
}

void keep_command_line(int argc, char** argv) {
  std::string& line = kept_command_line();
  line = argc > 0 ? shell_word(std::filesystem::path(argv[0]).filename().string()) : "";
  for (int i = 1; i < argc; ++i) line += ' ' + shell_word(argv[i]);
}

// The parser's message in our own wording.
std::string parse_error_text(const CLI::ParseError& error) {
  std::string text = error.what();
  const auto begins = [&](std::string_view words) { return text.rfind(words, 0) == 0; };
  constexpr std::string_view kNoNumber = "Could not convert: ", kExtra = "The following argument was not expected: ";
  if (const std::size_t equals = text.find(" = "); begins(kNoNumber) && equals != std::string::npos)
    return fmt::format("{} is '{}'; a number is needed", text.substr(kNoNumber.size(), equals - kNoNumber.size()),
                       text.substr(equals + 3));
  if (begins(kExtra)) return fmt::format("'{}' is one argument too many", text.substr(kExtra.size()));
  if (begins("--out is required")) return "--out is required: -o FOLDER or FILE says where the results go";
  return text;
}

int run(int argc, char** argv, const AddVerbs& add_verbs) {
  int exit_code = kDone;
  CLI::App program("Stochastic LDDMM landmark registration", "pulson");
  program.formatter(help_formatter());
  program.set_version_flag(
      "-v,--version", [] { return build_facts(); }, "print the version and build information");
  program.get_help_ptr()->description("print this help; after a verb, its options and examples");
  program.require_subcommand(1);
  add_verbs(program, exit_code);
  for (CLI::App* verb : program.get_subcommands({})) add_common_options(*verb);
  program.parse_complete_callback([&program] { print_config(program); });
  if (argc < 2) {
    fmt::print(stderr, "{}", welcome());
    return kBadInput;
  }
  check_names(program, {argv + 1, argv + argc});
  try {
    program.parse(argc, argv);
    return exit_code;
  } catch (const CLI::CallForVersion& called) {
    fmt::print("{}", called.what());
    return kDone;
  } catch (const CLI::Success& success) {
    return program.exit(success);
  } catch (const CLI::ParseError& error) {
    const bool has_verb = argv[1][0] != '-';
    return report_error(
        fmt::format("{} (see pulson {}--help)", parse_error_text(error), has_verb ? argv[1] + std::string(" ") : ""),
        kBadInput);
  }
}

}  // namespace

int run_program(int argc, char** argv, const AddVerbs& add_verbs) {
  const SerialBlas serial;  // verbs share out the threads themselves
  try {
    keep_command_line(argc, argv);
    const int exit_code = run(argc, argv, add_verbs);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return report_error("standard output could not be written", kBadInput);
    return exit_code;
  } catch (const Error& error) {
    return report_error(error.what(), kBadInput);
  } catch (const std::bad_alloc&) {
    return report_error("out of memory", kInternalError);
  } catch (const std::exception& error) {
    return report_error(fmt::format("internal error: {}", error.what()), kInternalError);
  }
}

const std::string& command_line() { return kept_command_line(); }

}  // namespace pulson
