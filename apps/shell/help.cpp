#include "help.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <unistd.h>

#include "terminal.hpp"

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
      text += fmt::format(" [{}]", option.get_default_str());
    if (option.get_required() && !option.get_positional()) text += " (required)";
    if (!option.get_excludes().empty()) text += fmt::format(" (not with {})", names_of(option.get_excludes()));
    return text;
  }
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

}  // namespace pulson
