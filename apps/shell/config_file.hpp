#pragma once

#include <string>
#include <vector>

namespace pulson {

/// One `key = value` of a configuration file.
struct Setting {
  enum class Kind { kWord, kNumber, kText, kList };

  std::string section;  ///< the table it stands in; empty: above all tables
  std::string key;
  std::vector<std::string> values;  ///< one, or those of a list
  Kind kind = Kind::kText;          ///< kWord: true or false
  std::string place;                ///< "run.toml:3", or "run.json: register.steps", for messages
};

struct ConfigFile {
  std::vector<Setting> settings;
  /// Names of tables in their order, with their places as above.
  std::vector<std::pair<std::string, std::string>> sections;
};

/// Reads .toml or .json, by the extension: strings, numbers, true, false and lists of these, in tables one level deep.
/// @throws InputError that names file and line
ConfigFile read_config_file(const std::string& path);

}  // namespace pulson
