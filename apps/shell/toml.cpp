#include "toml.hpp"

#include <algorithm>
#include <sstream>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "pulson/core/errors.hpp"

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

}  // namespace

ConfigFile read_toml_config(const std::string& path, std::string_view text) {
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

}  // namespace pulson
