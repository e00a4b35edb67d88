#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// One `key = value` of a configuration file.
struct Setting {
  enum class Kind { kWord, kNumber, kText, kList };

  std::string section;  ///< the table it stands in; empty: above all tables
  std::string key;
  std::vector<std::string> values;  ///< one, or those of a list
  Kind kind = Kind::kText;          ///< kWord: true or false
  std::string place;                ///< "run.toml:3", for messages
};

struct ConfigFile {
  std::vector<Setting> settings;
  /// Names of tables in their order, with their places as above.
  std::vector<std::pair<std::string, std::string>> sections;
};

/// Reads a .toml file of up to 1 MiB: strings, numbers, true, false and lists of these, in tables one level deep.
/// @throws InputError that names file and line
ConfigFile read_config_file(const std::string& path);

/// See read_config_file. `path` is what messages call the file. @throws InputError
ConfigFile read_toml_config(const std::string& path, std::string_view text);

/// `text` as a TOML string.
std::string toml_string(std::string_view text);

/// Whether `text` is a TOML number as it stands.
bool is_toml_number(const std::string& text);

/// Gives a verb the options of a file that the command line does not give. @throws InputError that names file and line
void apply_config(const ConfigFile& file, CLI::App& verb);

/// `--config FILE`, whose settings fill in the options that the command line does not give, and `--print-config`.
void add_config_options(CLI::App& verb);

/// Whether --print-config is given.
bool asks_for_config(const CLI::App& verb);

/// The options of a parsed verb and the defaults of the others as TOML that `--config` reads.
std::string config_text(const CLI::App& verb);

}  // namespace pulson
