#include "config_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "pulson/core/errors.hpp"
#include "toml.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

std::string contents_of(const std::string& path) {
  if (std::filesystem::is_directory(path))
    throw InputError(fmt::format("cannot read '{}': it is a folder; a file is needed", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("cannot read the configuration '{}': no such file, or no permission", path));
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string scalar_text(const Json& value, const std::string& place) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean() || value.is_number()) return value.dump();
  throw InputError(place + ": a string, number, true, false or a list of these is needed");
}

Setting json_setting(const std::string& section, const std::string& key, const Json& value, const std::string& place) {
  Setting setting{section, key, {}, Setting::Kind::kText, place};
  if (value.is_array()) {
    setting.kind = Setting::Kind::kList;
    for (const Json& item : value) setting.values.push_back(scalar_text(item, place));
    return setting;
  }
  if (value.is_boolean()) setting.kind = Setting::Kind::kWord;
  if (value.is_number()) setting.kind = Setting::Kind::kNumber;
  setting.values = {scalar_text(value, place)};
  return setting;
}

ConfigFile read_json_config(const std::string& path, const std::string& text) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    const std::string what = error.what();  // "[json.exception.parse_error.101] parse error at line 1, …"
    throw InputError(fmt::format("{}: {}", path, what.substr(std::min(what.size(), what.find("] ") + 2))));
  }
  if (!json.is_object()) throw InputError(path + ": an object {\"option\": value, …} is needed");
  ConfigFile config;
  for (const auto& [key, value] : json.items()) {
    const std::string place = fmt::format("{}: {}", path, key);
    if (!value.is_object()) {
      config.settings.push_back(json_setting("", key, value, place));
      continue;
    }
    config.sections.emplace_back(key, place);
    for (const auto& [inner, inner_value] : value.items())
      config.settings.push_back(json_setting(key, inner, inner_value, fmt::format("{}: {}.{}", path, key, inner)));
  }
  return config;
}

}  // namespace

ConfigFile read_config_file(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension();
  if (extension != ".toml" && extension != ".json")
    throw InputError(fmt::format("--config is '{}'; a .toml or .json file is needed", path));
  const std::string text = contents_of(path);
  return extension == ".json" ? read_json_config(path, text) : read_toml_config(path, text);
}

}  // namespace pulson
