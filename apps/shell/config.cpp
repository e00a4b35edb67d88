#include "config.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "core/paths.hpp"
#include "options.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"

namespace pulson {

namespace {

/// "Error while parsing …" as our messages begin.
std::string lower_case_begin(std::string_view message) {
  std::string text(message);
  if (text.starts_with('E')) text.front() = 'e';
  return text;
}

std::string place_of(const std::string& path, const toml::source_region& source) {
  return fmt::format("{}:{}", path, source.begin.line);
}

/// As the program writes its defaults, so that what --print-config printed comes back as it was: 1e+08.
std::string text_of(double number) {
  const std::string text = fmt::format("{:g}", number);
  return std::stod(text) == number ? text : fmt::to_string(number);
}

/// The kind of a string, number, true or false, and its text as the command line takes it.
std::pair<Setting::Kind, std::string> scalar(const toml::node& node, const std::string& place) {
  if (const auto* text = node.as_string()) return {Setting::Kind::kText, text->get()};
  if (const auto* flag = node.as_boolean()) return {Setting::Kind::kWord, flag->get() ? "true" : "false"};
  if (const auto* whole = node.as_integer()) return {Setting::Kind::kNumber, fmt::to_string(whole->get())};
  if (const auto* real = node.as_floating_point()) return {Setting::Kind::kNumber, text_of(real->get())};
  throw InputError(place + ": a string, number, true, false or list of these is needed");
}

Setting setting_of(const std::string& section, const toml::key& key, const toml::node& value, const std::string& path) {
  Setting setting{section, std::string(key.str()), {}, Setting::Kind::kList, place_of(path, key.source())};
  if (const toml::array* list = value.as_array()) {
    for (const toml::node& item : *list) setting.values.push_back(scalar(item, setting.place).second);
  } else {
    setting.values.resize(1);
    std::tie(setting.kind, setting.values[0]) = scalar(value, setting.place);
  }
  return setting;
}

/// The entries of a table in the order of the file; the library sorts them by their names.
std::vector<std::pair<const toml::key*, const toml::node*>> entries_of(const toml::table& table) {
  std::vector<std::pair<const toml::key*, const toml::node*>> entries;
  for (const auto& [key, value] : table) entries.emplace_back(&key, &value);
  const auto place = [](const auto& entry) {
    const toml::source_position begin = entry.first->source().begin;
    return std::pair(begin.line, begin.column);
  };
  std::sort(entries.begin(), entries.end(), [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return entries;
}

/// Skips the string that begins at `at`, or a comment. @return where what follows begins
std::size_t after_string(std::string_view text, std::size_t at) {
  if (text[at] == '#') return std::min(text.find('\n', at), text.size());
  const std::string_view three = text.substr(at, 3);
  const bool is_long = three == R"(""")" || three == "'''";
  const std::string_view quote = text.substr(at, is_long ? 3 : 1);
  for (std::size_t i = at + quote.size(); i < text.size(); ++i) {
    if (text[i] == '\\' && quote[0] == '"')
      ++i;
    else if (text[i] == '\n' && !is_long)
      return i;  // the parser refuses it
    else if (text.substr(i, quote.size()) == quote)
      return i + quote.size();
  }
  return text.size();
}

/// The parser makes a table of each part of `a.b.c`, and destroys them by a call within a call.
void require_shallow_keys(const std::string& path, std::string_view text) {
  constexpr int kMostDots = 16;
  int dots = 0, line = 1;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'' || c == '#') {
      const std::size_t end = after_string(text, i);
      line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                          text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
      i = end;
      continue;
    }
    if (c == '\n') ++line;
    if (std::string_view("\n=,[]{}").find(c) != std::string_view::npos) dots = 0;
    if (c == '.' && ++dots > kMostDots)
      throw InputError(
          fmt::format("{}:{}: a key has more than {} parts; those of options have one", path, line, kMostDots));
    ++i;
  }
}

}  // namespace

ConfigFile read_toml_config(const std::string& path, std::string_view text) {
  require_shallow_keys(path, text);
  toml::table file;
  try {
    file = toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    // The most frequent slip is a text without quotes, which the library takes for a value of an unknown type.
    const bool is_bare = error.description().find("value type") != std::string_view::npos;
    throw InputError(fmt::format("{}: {}{}", place_of(path, error.source()), lower_case_begin(error.description()),
                                 is_bare ? "; strings need quotes, \"…\"" : ""));
  }
  ConfigFile config;
  for (const auto& [key, value] : entries_of(file)) {
    const toml::table* section = value->as_table();
    if (section == nullptr) {
      config.settings.push_back(setting_of("", *key, *value, path));
      continue;
    }
    const std::string name(key->str());
    config.sections.emplace_back(name, place_of(path, key->source()));
    for (const auto& [inner, inner_value] : entries_of(*section))
      config.settings.push_back(setting_of(name, *inner, *inner_value, path));
  }
  return config;
}

std::string toml_string(std::string_view text) {
  std::ostringstream stream;
  stream << toml::toml_formatter(toml::value<std::string>(text), toml::format_flags::allow_unicode_strings);
  return stream.str();
}

bool is_toml_number(const std::string& text) {
  try {
    return toml::parse("x = " + text)["x"].is_number();
  } catch (const toml::parse_error&) {
    return false;
  }
}

ConfigFile read_config_file(const std::string& path) {
  constexpr std::uint64_t kMost = 1U << 20;  // bytes: a hundred thousand file names
  if (std::filesystem::path(path).extension() != ".toml")
    throw InputError(fmt::format("--config is {}; a .toml file is needed", quoted_path(path)));
  return read_toml_config(path, read_file(path, kMost));
}

namespace {

constexpr const char* kPrint = "--print-config";

/// "steps" of --steps, "source" of SOURCE; empty for --help and what else no file holds.
std::string key_of(const CLI::Option& option) {
  if (!option.get_configurable()) return "";
  if (!option.get_lnames().empty()) return option.get_lnames().front();
  std::string key = option.get_name(true);
  std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return std::tolower(c); });
  return key;
}

bool is_flag(const CLI::Option& option) { return option.get_expected_min() == 0; }

CLI::Option& find_option(CLI::App& verb, const Setting& setting) {
  CLI::Option* option = verb.get_option_no_throw("--" + setting.key);
  std::vector<std::string> valid;
  for (CLI::Option* each : verb.get_options({})) {
    if (option == nullptr && key_of(*each) == setting.key) option = each;
    if (!key_of(*each).empty()) valid.push_back(key_of(*each));
  }
  if (option == nullptr) {
    const std::string former = advice_on_former(setting.key);
    throw InputError(fmt::format("{}: unknown option '{}'{} (see pulson {} --help)", setting.place, setting.key,
                                 former.empty() ? suggestion(setting.key, valid) : former, verb.get_name()));
  }
  if (!option->get_configurable())
    throw InputError(fmt::format("{}: '{}' belongs on the command line", setting.place, setting.key));
  return *option;
}

void check_kind(const CLI::Option& option, const Setting& setting) {
  const bool is_word = setting.kind == Setting::Kind::kWord;
  if (is_flag(option) && !is_word)
    throw InputError(fmt::format("{}: {} must be true or false", setting.place, setting.key));
  if (!is_flag(option) && is_word)
    throw InputError(fmt::format("{}: {} is {}; it needs a value", setting.place, setting.key, setting.values.front()));
  for (const std::string& value : setting.values) {
    if (is_blank(value))
      throw InputError(fmt::format("{}: {} is empty; give it a value or leave it out", setting.place, setting.key));
    if (value.find('\0') != std::string::npos)
      throw InputError(fmt::format("{}: {} holds a zero byte", setting.place, setting.key));
  }
  if (setting.kind != Setting::Kind::kList) return;
  if (setting.values.empty()) throw InputError(fmt::format("{}: the list {} is empty", setting.place, setting.key));
  if (option.get_items_expected_max() < 2)
    throw InputError(fmt::format("{}: {} must be one value, not a list", setting.place, setting.key));
}

void give(CLI::Option& option, const Setting& setting) {
  if (is_flag(option) && setting.values.front() == "false" && option.get_fnames().empty()) return;  // as if left out
  try {
    if (is_flag(option))
      option.add_result(option.get_flag_value(setting.key, setting.values.front()));
    else
      option.add_result(setting.values);
    option.run_callback();
  } catch (const CLI::ConversionError&) {
    throw InputError(
        fmt::format("{}: {} is '{}'; a number is needed", setting.place, setting.key, fmt::join(setting.values, ", ")));
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("{}: {}", setting.place, error.what()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", setting.place, error.what()));
  }
}

// What is given already stays, and with it what it excludes: --dt on the command line against steps in the file.
void apply(CLI::App& verb, const ConfigFile& file, const std::string& section) {
  std::set<const CLI::Option*> settled;
  for (const CLI::Option* option : verb.get_options({})) {
    if (option->count() == 0) continue;
    settled.insert(option);
    for (const CLI::Option* excluded : option->get_excludes()) settled.insert(excluded);
  }
  for (const Setting& setting : file.settings) {
    if (setting.section != section) continue;
    CLI::Option& option = find_option(verb, setting);
    check_kind(option, setting);
    if (settled.count(&option) == 0) give(option, setting);
  }
}

std::string value_text(const CLI::Option& option, const std::string& value) {
  const std::string type = option.get_type_name();
  constexpr std::array<std::string_view, 5> kNumbers = {"FLOAT", "INT", "UINT", "NUMBER", "COUNT"};
  const bool is_number = std::find(kNumbers.begin(), kNumbers.end(), type) != kNumbers.end();
  return is_flag(option) || (is_number && is_toml_number(value)) ? value : toml_string(value);
}

std::string values_text(const CLI::Option& option) {
  const std::vector<std::string> values = option.reduced_results();
  if (option.get_items_expected_max() < 2 || is_flag(option)) return value_text(option, values.front());
  std::vector<std::string> texts;
  for (const std::string& value : values) texts.push_back(value_text(option, value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

bool is_excluded(const CLI::Option& option) {
  const auto others = option.get_excludes();
  return std::any_of(others.begin(), others.end(), [](const CLI::Option* other) { return other->count() > 0; });
}

}  // namespace

void apply_config(const ConfigFile& file, CLI::App& verb) {
  const std::vector<std::string> verbs =
      verb.get_parent() == nullptr ? std::vector{verb.get_name()} : verb_names(*verb.get_parent());
  for (const auto& [section, place] : file.sections)
    if (std::find(verbs.begin(), verbs.end(), section) == verbs.end())
      throw InputError(fmt::format("{}: unknown verb '{}'{}", place, section, advice_on_name(section, verbs)));
  apply(verb, file, verb.get_name());
  apply(verb, file, "");
}

void add_config_options(CLI::App& verb) {
  reads_file(verb.add_option_function<std::string>(
                 "--config", [&verb](const std::string& path) { apply_config(read_config_file(path), verb); },
                 "read options from a .toml file, by their long names: steps = 40; the command line takes precedence"))
      ->configurable(false);
  verb.add_flag_callback(
          kPrint, [] {}, "print the current options as a configuration file and exit")
      ->configurable(false);
}

bool asks_for_config(const CLI::App& verb) {
  const CLI::Option* option = verb.get_option_no_throw(kPrint);
  return option != nullptr && option->count() > 0;
}

std::string config_text(const CLI::App& verb) {
  std::string text = fmt::format("# pulson {}\n[{}]\n", version(), verb.get_name());
  for (const CLI::Option* option : verb.get_options({})) {
    const std::string key = key_of(*option);
    if (key.empty()) continue;
    if (option->count() > 0)
      text += fmt::format("{} = {}\n", key, values_text(*option));
    else if (!option->get_default_str().empty() && !is_flag(*option) && !is_excluded(*option))
      text += fmt::format("{} = {}\n", key, value_text(*option, option->get_default_str()));
  }
  return text;
}

}  // namespace pulson
