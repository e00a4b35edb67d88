// Arrays of numpy in an archive (.npz): those that can be landmarks, each named as its shapes are.

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"
#include "zip_archive.hpp"

namespace pulson::formats {
namespace {

bool is_array(const ZipEntry& entry) { return entry.name.ends_with(".npy"); }

bool sniff_npz(std::string_view text) {
  const std::vector<ZipEntry> entries = zip_entries(text);
  return !entries.empty() && std::all_of(entries.begin(), entries.end(), is_array);
}

bool names_landmarks(const std::string& name) {
  constexpr std::array<std::string_view, 8> kNames = {"landmarks", "landmark", "points",      "shapes",
                                                      "keypoints", "coords",   "coordinates", "lm"};
  return std::find(kNames.begin(), kNames.end(), text::to_lower(name)) != kNames.end();
}

struct NamedArray {
  std::string name;
  LandmarkFile file;
  std::string problem;  ///< why it is none of landmarks
};

NamedArray read_array(const std::string& path, const ZipEntry& entry) {
  NamedArray array{entry.name.substr(0, entry.name.size() - 4), {}, {}};
  try {
    array.file = read_npy(fmt::format("{}: {}", path, text::in_quotes(entry.name)), unpacked(path, entry));
  } catch (const InputError& error) {
    array.problem = error.what();
  }
  return array;
}

/// The arrays that are landmarks: those with a name that says so, else those of points in the plane or in space, else
/// all.
std::vector<bool> chosen(const std::vector<NamedArray>& arrays) {
  const auto mark = [&](auto is_right) {
    std::vector<bool> marks;
    for (const NamedArray& array : arrays) marks.push_back(array.problem.empty() && is_right(array));
    return marks;
  };
  for (const std::vector<bool>& marks :
       {mark([](const NamedArray& array) { return names_landmarks(array.name); }),
        mark([](const NamedArray& array) { return array.file.shapes.front().dimension() > 1; })})
    if (std::find(marks.begin(), marks.end(), true) != marks.end()) return marks;
  return mark([](const NamedArray&) { return true; });
}

LandmarkFile read_npz(const std::string& path, std::string_view text) {
  std::vector<NamedArray> arrays;
  for (const ZipEntry& entry : zip_entries(text))
    if (is_array(entry)) arrays.push_back(read_array(path, entry));
  const std::vector<bool> is_chosen = chosen(arrays);
  const auto count = std::count(is_chosen.begin(), is_chosen.end(), true);
  if (count == 0)
    throw InputError(arrays.empty() ? path + ": there are no arrays in this archive" : arrays.front().problem);
  LandmarkFile file;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    if (!is_chosen[i]) {
      file.warnings.push_back(
          fmt::format("{}: the array {} is not read as landmarks", path, text::in_quotes(arrays[i].name)));
      continue;
    }
    std::vector<Landmarks>& shapes = arrays[i].file.shapes;
    for (std::size_t s = 0; s < shapes.size() && count > 1; ++s)
      shapes[s].name = shapes.size() == 1 ? arrays[i].name : fmt::format("{}_{}", arrays[i].name, s + 1);
    std::move(shapes.begin(), shapes.end(), std::back_inserter(file.shapes));
    file.warnings.insert(file.warnings.end(), arrays[i].file.warnings.begin(), arrays[i].file.warnings.end());
  }
  return file;
}

}  // namespace

LandmarkFormat npz_format() {
  return {.name = "npz",
          .extensions = {"npz"},
          .help =
              "archive of numpy arrays, read as npy: those named landmarks, points, shapes, keypoints or coords, else "
              "all of points in the plane or in space",
          .sniff = sniff_npz,
          .read = read_npz,
          .holds_bytes = true};
}

}  // namespace pulson::formats
