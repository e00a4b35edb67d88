#include "config.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "config_file.hpp"
#include "misspelt.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "toml.hpp"

namespace pulson {
namespace {

constexpr const char* kPrint = "--print-config";

// Of both programs, each of which knows its own alone.
const std::vector<std::string> kVerbs = {"register",      "warp",      "simulate", "ensemble", "compare",
                                         "fokker-planck", "reproduce", "convert",  "info"};

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
  if (option == nullptr)
    throw InputError(fmt::format("{}: unknown option '{}'{} (see pulson {} --help)", setting.place, setting.key,
                                 suggestion(setting.key, valid), verb.get_name()));
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

void apply_config(const std::string& path, CLI::App& verb) {
  const ConfigFile file = read_config_file(path);
  for (const auto& [section, place] : file.sections)
    if (std::find(kVerbs.begin(), kVerbs.end(), section) == kVerbs.end())
      throw InputError(fmt::format("{}: unknown verb '{}'{}", place, section, advice_on_name(section, kVerbs)));
  apply(verb, file, verb.get_name());
  apply(verb, file, "");
}

std::string value_text(const CLI::Option& option, const std::string& value) {
  const std::string type = option.get_type_name();
  const bool is_number = type == "FLOAT" || type == "INT" || type == "UINT" || type == "NUMBER";
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

void add_config_options(CLI::App& verb) {
  verb.add_option_function<std::string>(
          "--config", [&verb](const std::string& path) { apply_config(path, verb); },
          "read options from a .toml or .json file, by their long names: steps = 40; the command line takes precedence")
      ->type_name("FILE")
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
