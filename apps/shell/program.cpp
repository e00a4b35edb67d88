// The parser, errors and exit codes.

#include "program.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <sstream>
#include <system_error>

#include <CLI/Error.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "config.hpp"
#include "core/blas_memory.hpp"
#include "help_groups.hpp"
#include "host.hpp"
#include "messages.hpp"
#include "options.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "ranks.hpp"
#include "slicer_module.hpp"
#include "verbs.hpp"

namespace pulson {

namespace {

constexpr std::size_t kLeast = 80;
constexpr std::size_t kInPipe = 100;
constexpr std::size_t kOptionColumn = 34;
constexpr std::size_t kVerbColumn = 18;

std::size_t width() { return std::max(kLeast, terminal_width(STDOUT_FILENO, kInPipe)); }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// A name, and what it is beside it from `column` on.
std::string entry(const std::string& name, const std::string& description, std::size_t column) {
  std::string text = "  " + name;
  std::size_t at = columns(text);
  for (const std::string& paragraph : lines_of(description))
    for (const std::string& line : wrapped(paragraph, width() - column)) {
      if (at + 1 > column) {
        text += '\n';
        at = 0;
      }
      text += std::string(column - at, ' ') + line + '\n';
      at = 0;
    }
  return at > 0 ? text + '\n' : text;
}

// 1e8 for 1e+08
std::string with_short_exponent(std::string text) {
  if (const std::size_t at = text.find("e+0"); at != std::string::npos) text.erase(at + 1, 2);
  return text;
}

std::string names_of(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(option->get_name());
  std::sort(names.begin(), names.end());
  return fmt::format("{}", fmt::join(names, ", "));
}

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    label("FLOAT", "NUMBER");
    label("INT", "COUNT");
    label("UINT", "COUNT");
    label("OPTIONS", "options");
    label("SUBCOMMAND", "VERB");
    label("Subcommands", "Verbs");
    label("Positionals", "Arguments");
  }

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    std::string name = make_option_name(option, is_positional);
    if (const std::size_t at = name.find("{false}"); at != std::string::npos) name.erase(at, 7);
    if (!is_positional && option->get_type_size() != 0) name += " " + get_label(option->get_type_name());
    if (option->get_expected_max() == CLI::detail::expected_max_vector_size) name += " ...";
    return entry(name, description_of(*option), kOptionColumn);
  }

  std::string make_subcommand(const CLI::App* verb) const override {
    return entry(verb->get_name(), verb->get_description(), kVerbColumn);
  }

  std::string make_description(const CLI::App* app) const override {
    std::string text;
    for (const std::string& line : wrapped(app->get_description(), width())) text += line + '\n';
    return text;
  }

  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_subcommands(app, mode);
    constexpr std::string_view kTheirs = "\nSubcommands:\n";
    if (text.rfind(kTheirs, 0) == 0) text.replace(0, kTheirs.size(), "\nVerbs:\n");
    return text;
  }

  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    if (mode_ == CLI::AppFormatMode::Normal && group.ends_with(kMore)) return "";
    return CLI::Formatter::make_group(std::move(group), is_positional, std::move(options));
  }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    mode_ = mode;
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    for (std::size_t at = 0; (at = text.find("\n\n\n", at)) != std::string::npos;) text.erase(at, 1);
    return text;
  }

  std::string make_footer(const CLI::App* app) const override {
    std::string text;
    for (const std::string& line : lines_of(app->get_footer())) {
      if (line.rfind("  ", 0) == 0)
        text += line + '\n';
      else
        for (const std::string& part : wrapped(line, width())) text += part + '\n';
    }
    return text;
  }

 private:
  static std::string description_of(const CLI::Option& option) {
    std::string text = option.get_description();
    if (!option.get_default_str().empty() && option.get_type_size() != 0)
      text += fmt::format(" [{}]", with_short_exponent(option.get_default_str()));
    if (option.get_required() && !option.get_positional()) text += " (required)";
    if (!option.get_excludes().empty()) text += fmt::format(" (not with {})", names_of(option.get_excludes()));
    return text;
  }

  mutable CLI::AppFormatMode mode_ = CLI::AppFormatMode::Normal;  // make_group has no parameter for it
};

}  // namespace

std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (line.empty())
      line = word;
    else if (columns(line) + 1 + columns(word) <= width)
      line += ' ' + word;
    else
      lines.push_back(word);
  }
  return lines;
}

std::string shell_word(std::string_view word) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_@%+=:,./-#";
  const bool is_comment = word.starts_with('#');  // elsewhere it is as any other
  if (!word.empty() && !is_comment && word.find_first_not_of(kPlain) == std::string_view::npos)
    return std::string(word);
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<HelpFormatter>(); }

std::string welcome() {
  return "pulson: stochastic LDDMM landmark registration\n"
         "  pulson register a.csv b.csv -o out           fit the flow that maps shape a to shape b\n"
         "  pulson warp out/registration.json a.png -o warped.png\n"
         "                                               and warp a picture of a with it\n"
         "  pulson simulate --q 0,10 --p 4,1 --noise ch-sd:beta=1.5 -o paths\n"
         "                                               draw sample paths of two pulsons on a line\n"
         "All verbs: pulson --help. One of them, with examples: pulson VERB --help\n";
}

namespace {

using AddVerbs = std::function<void(CLI::App&, int&)>;

// How a run ends; the error is printed already.
struct Ending {
  int exit_code = kDone;
  std::string error{};
};

Ending report_error(const std::string& message, int exit_code) {
  print_error(message);
  return {exit_code, message};
}

// The verbs whose work is shared where several processes run them together.
const std::vector<std::string> kSharingVerbs = {"register", "atlas", "ensemble", "compare", "sample"};

void check_ranks(const std::string& verb) {
  if (ranks::size() == 1 || verb.starts_with('-')) return;
  if (std::find(kSharingVerbs.begin(), kSharingVerbs.end(), verb) == kSharingVerbs.end())
    throw InputError(fmt::format("'{}' is for one process, and there are {} ranks; those that share work: {}", verb,
                                 ranks::size(), fmt::join(kSharingVerbs, ", ")));
}

// What every verb has besides its own options.
void add_common_options(CLI::App& verb) {
  if (verb.get_name() == "completion") return;
  begin_group(verb, more(kInputGroup));
  add_verbose_option(verb);
  add_config_options(verb);
  add_slicer_option(verb);
}

// --print-config is in place of the work.
void print_config(const CLI::App& program) {
  for (const CLI::App* verb : program.get_subcommands())
    if (asks_for_config(*verb)) {
      print_exact(config_text(*verb));
      throw CLI::Success();
    }
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
  if (constexpr std::string_view kMore = "The following arguments were not expected: "; begins(kMore))
    return fmt::format("arguments too many: {}", text.substr(kMore.size()));
  if (const std::size_t colon = text.find(": At Most 1 required but received "); colon != std::string::npos)
    return fmt::format("{} is given {} times; it takes one value", text.substr(0, colon),
                       text.substr(text.rfind(' ') + 1));
  if (const std::size_t colon = text.find(": 1 required "); colon != std::string::npos && text.ends_with(" missing"))
    return fmt::format("{} needs a value", text.substr(0, colon));
  if (begins("--out is required")) return "--out is required: -o FOLDER or FILE says where the results go";
  return text;
}

// In place of the results that were asked for.
void print_welcome() {
  const std::string text = welcome();
  std::fwrite(text.data(), 1, text.size(), stderr);
}

// The program without verbs.
void set_up(CLI::App& program) {
  program.formatter(help_formatter());
  program.require_subcommand(1);
}

// All options are there: what is to be known of them, and what is done before the work.
void complete(CLI::App& program) {
  for (CLI::App* verb : program.get_subcommands({})) add_common_options(*verb);
  require_declared_paths(program);
  program.parse_complete_callback([&program] {
    print_config(program);
    for (const CLI::App* verb : program.get_subcommands()) {
      refuse_pictures(*verb);
      run_paths().add_options_of(*verb);
    }
  });
}

Ending run(int argc, char** argv, const AddVerbs& add_verbs) {
  int exit_code = kDone;
  CLI::App program("Stochastic LDDMM landmark registration", "pulson");
  set_up(program);
  program.set_version_flag(
      "-v,--version", [] { return build_facts(); }, "print the version and build information");
  program.get_help_ptr()->description("print this help; after a verb, its usual options and examples");
  program.set_help_all_flag("--help-all", "print all options");
  add_verbs(program, exit_code);
  complete(program);
  if (argc < 2) {
    print_welcome();
    return {kBadInput};
  }
  check_names(program, {argv + 1, argv + argc});
  check_ranks(argv[1]);
  try {
    program.parse(argc, argv);
    return {exit_code};
  } catch (const CLI::CallForVersion& called) {
    print_exact(called.what());
    return {kDone};
  } catch (const CLI::Success& success) {
    return {program.exit(success)};
  } catch (const CLI::ParseError& error) {
    const bool has_verb = argv[1][0] != '-';
    return report_error(
        fmt::format("{} (see pulson {}--help)", parse_error_text(error), has_verb ? argv[1] + std::string(" ") : ""),
        kBadInput);
  }
}

// As one of several ranks: these share out the cores, and rank 0 alone prints.
void join_ranks(int& argc, char**& argv) {
  ranks::join(argc, argv);
  set_thread_count(ranks::default_threads());
  if (!ranks::is_first() && std::freopen("/dev/null", "w", stdout) == nullptr)
    throw InputError("'/dev/null' cannot be opened");
}

// Where memory is too small, threads of OpenBLAS may wait for it already, and the end of the process for them.
void check_memory() {
  try {
    reserve_blas_memory();
  } catch (const InputError& error) {
    print_error(error.what());
    ::_exit(kBadInput);
  }
}

Ending run_as_rank(int argc, char** argv, const AddVerbs& add_verbs) {
  const SerialBlas serial;  // verbs share out the threads themselves
  try {
    join_ranks(argc, argv);
    keep_command_line(argc, argv);
    Ending ending = run(argc, argv, add_verbs);
    if (const std::string fault = fault_of_standard_output(); !fault.empty()) return report_error(fault, kBadInput);
    return ending;
  } catch (const ranks::Dismissed&) {
    return {kDone, {}};
  } catch (const Error& error) {
    return report_error(error.what(), kBadInput);
  } catch (const std::bad_alloc&) {
    return report_error("out of memory: the data or the numbers asked for are too large for this machine", kBadInput);
  } catch (const std::system_error& error) {  // of threads
    return report_error(fmt::format("the system refused what is needed: {}", error.what()), kBadInput);
  } catch (const std::exception& error) {
    return report_error(fmt::format("internal error: {}", error.what()), kInternalError);
  }
}

}  // namespace

int run_program(int argc, char** argv, const AddVerbs& add_verbs) {
  prepare_standard_streams();
  check_memory();
  const Ending ending = run_as_rank(argc, argv, add_verbs);
  return ranks::leave(ending.exit_code, ending.error);
}

int run_hosted_verb(const std::vector<std::string>& words, const AddVerbs& add_verbs) {
  const SerialBlas serial;
  int exit_code = kDone;
  forget_run();
  CLI::App program("Stochastic LDDMM landmark registration", "pulson");
  set_up(program);
  add_verbs(program, exit_code);
  complete(program);
  parse_hosted(program, words);
  return exit_code;
}

void parse_hosted(CLI::App& program, const std::vector<std::string>& words) {
  std::string& line = kept_command_line();
  line = "pulson";
  for (const std::string& word : words) line += ' ' + shell_word(word);
  try {
    program.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::Success&) {
    throw InputError("what is printed in place of work is for the program: pulson --help");
  } catch (const CLI::ParseError& error) {
    throw InputError(parse_error_text(error));
  }
}

const std::string& command_line() { return kept_command_line(); }

}  // namespace pulson
