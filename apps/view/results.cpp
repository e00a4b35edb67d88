#include "results.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/paths.hpp"
#include "formats/shape_address.hpp"
#include "pulson/core/errors.hpp"
#include "shell/picture_sizes.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using ResultsJson = nlohmann::json;

constexpr std::array kRecords = {"registration.json", "comparison.json", "summary.json", "atlas.json"};

std::optional<ResultsJson> record_in(const fs::path& folder) {
  for (const char* name : kRecords) {
    if (!is_file(folder / name)) continue;
    ResultsJson json = ResultsJson::parse(read_file(folder / name), nullptr, false);
    if (json.is_object()) return json;
  }
  return std::nullopt;
}

const ResultsJson& member(const ResultsJson& json, const char* key) {
  static const ResultsJson kNone;
  return json.is_object() && json.contains(key) ? json[key] : kNone;
}

// `register` names a source and a target, `compare` and `sample` a source and targets, `atlas` its specimens.
std::vector<std::string> named_shapes(const ResultsJson& record) {
  std::vector<std::string> names;
  const auto add = [&](const ResultsJson& name) {
    if (name.is_string() && !name.get<std::string>().empty()) names.push_back(name.get<std::string>());
  };
  add(member(member(record, "source_shape"), "file"));
  add(member(member(record, "target_shape"), "file"));
  if (names.empty()) add(member(record, "source"));
  for (const ResultsJson& target : member(record, "targets")) add(target);
  for (const ResultsJson& specimen : member(record, "specimens")) add(member(specimen, "source"));
  return names;
}

// The address from here, as the record has it, or from the folder that holds the results; empty where no file is there.
std::string found_address(const std::string& address, const fs::path& folder) {
  for (const fs::path& from : {fs::path(), folder.parent_path()}) {
    std::string here = (from / address).string();
    if (is_file(formats::file_of_address(here))) return here;
  }
  return {};
}

// Without a slash at its end, and by its name where it is given as `.` or `..`.
fs::path named_folder(const std::string& folder) {
  const auto without_end = [](const fs::path& path) {
    return path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
  };
  const fs::path path = without_end(fs::path(folder).lexically_normal());
  const bool has_name = path.has_filename() && path.filename() != "." && path.filename() != "..";
  return has_name ? path : without_end(fs::absolute(folder).lexically_normal());
}

// Files of many shapes are read once.
std::vector<Landmarks> shapes_of(const ResultsJson& record, const fs::path& folder,
                                 const formats::ReadOptions& reading) {
  std::map<std::string, formats::LandmarkFile> files;
  std::vector<Landmarks> shapes;
  for (const std::string& name : named_shapes(record)) {
    const std::string address = found_address(name, folder);
    if (address.empty()) throw InputError(fmt::format("{} is not here", name));
    const std::string file = formats::file_of_address(address);
    if (!files.contains(file)) files[file] = formats::read_landmark_file(file, reading);
    const std::vector<Landmarks>& all = files[file].shapes;
    const auto found = std::find_if(all.begin(), all.end(), [&](const Landmarks& s) { return s.source == address; });
    Landmarks shape = found != all.end() ? *found : formats::read_landmarks(address, nullptr, reading);
    if (shape.dimension() != 2) throw InputError(fmt::format("{} is not of the plane", name));
    if (std::none_of(shapes.begin(), shapes.end(), [&](const Landmarks& s) { return s.source == shape.source; }))
      shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace

ViewedResults results_of(const std::string& folder, const formats::ReadOptions& reading) {
  const fs::path path = named_folder(folder);
  ViewedResults results{{}, {}, path};
  if (is_file(path / "report.html")) results.report = fs::absolute(path / "report.html").lexically_normal();
  const std::optional<ResultsJson> record = record_in(path);
  if (!record) return results;
  try {
    results.shapes = shapes_of(*record, path, reading);
  } catch (const InputError& error) {
    results.why = error.what();
    return results;
  }
  const auto has_picture = [](const Landmarks& shape) { return picture_beside(shape).has_value(); };
  if (std::none_of(results.shapes.begin(), results.shapes.end(), has_picture)) {
    if (!results.shapes.empty()) results.why = "its shapes have no pictures";
    results.shapes.clear();
  }
  return results;
}

}  // namespace pulson
