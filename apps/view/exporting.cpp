#include "exporting.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using view::Placement;

Points positions_of(const view::ViewSpecimen& specimen) {
  Points points = Points::Constant(2, std::ssize(specimen.landmarks), std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index a = 0; a < points.cols(); ++a)
    if (const auto& landmark = specimen.landmarks[static_cast<std::size_t>(a)];
        landmark.placement == Placement::kPlaced)
      points.col(a) = landmark.position;
  return points;
}

std::vector<std::string> labels_of(const view::ViewDocument& document) {
  std::vector<std::string> labels;
  bool any = false;
  for (std::size_t a = 0; a < document.landmarks.size(); ++a) {
    const std::string& name = document.landmarks[a].name;
    any = any || !name.empty();
    labels.push_back(name.empty() ? std::to_string(a + 1) : name);
  }
  return any ? labels : std::vector<std::string>{};
}

std::vector<std::string> groups_of_document(const view::ViewDocument& document) {
  std::vector<std::string> groups;
  bool any = false;
  for (const view::ViewLandmark& landmark : document.landmarks) {
    any = any || !landmark.group.empty();
    groups.push_back(landmark.group.empty() ? "landmarks" : landmark.group);
  }
  return any ? groups : std::vector<std::string>{};
}

Landmarks shape_of(const view::ViewDocument& document, const view::ViewSpecimen& specimen) {
  const Points pixels = positions_of(specimen);
  Landmarks shape;
  if (!specimen.shape.empty()) {
    const view::OpenedShape& opened = document.shapes.at(specimen.shape);
    shape = opened.shape;
    shape.points = opened.from_page(pixels);
  } else {
    shape.points = pixels;
    shape.frame = {.y_down = true, .height = specimen.height, .width = specimen.width, .says_y = true};
    shape.frame.orientation = Orientation::kDisplayed;
    shape.image = fs::path(specimen.picture).filename().string();
  }
  shape.name = specimen.name;
  shape.labels = labels_of(document);
  shape.groups = groups_of_document(document);
  shape.links = document.links;
  for (std::size_t a = 0; a < specimen.landmarks.size(); ++a)
    if (specimen.landmarks[a].placement == Placement::kAbsent) shape.absent.push_back(static_cast<int>(a));
  return shape;
}

bool has_any(const view::ViewSpecimen& specimen) {
  return std::any_of(specimen.landmarks.begin(), specimen.landmarks.end(),
                     [](const auto& landmark) { return landmark.placement == Placement::kPlaced; });
}

// Landmarks that no specimen has, nor says to be missing or absent, are none yet.
void drop_unused_landmarks(view::ViewDocument& document) {
  std::vector<int> moved(document.landmarks.size(), -1);
  int count = 0;
  for (std::size_t a = 0; a < document.landmarks.size(); ++a)
    if (std::any_of(document.specimens.begin(), document.specimens.end(), [&](const view::ViewSpecimen& specimen) {
          return specimen.landmarks[a].placement != Placement::kNone;
        }))
      moved[a] = count++;
  const auto drop = [&](auto& list) {
    std::size_t a = 0;
    std::erase_if(list, [&](const auto&) { return moved[a++] < 0; });
  };
  drop(document.landmarks);
  for (view::ViewSpecimen& specimen : document.specimens) drop(specimen.landmarks);
  std::erase_if(document.links, [&](const std::pair<int, int>& link) {
    return moved[static_cast<std::size_t>(link.first)] < 0 || moved[static_cast<std::size_t>(link.second)] < 0;
  });
  for (auto& [a, b] : document.links) a = moved[static_cast<std::size_t>(a)], b = moved[static_cast<std::size_t>(b)];
}

// Files say units and axes once for all of their shapes. @return what is lost where these differ
std::string set_units(formats::LandmarkFile& file) {
  const Landmarks& first = file.shapes.front();
  for (const Landmarks& shape : file.shapes)
    if (shape.units != first.units || shape.axes != first.axes)
      return "the shapes are from files of different units of length or axes, which are left out";
  file.units = first.units;
  file.axes = first.axes;
  return {};
}

bool is_listed(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void require_plain_name(const std::string& name) {
  if (name.empty() || name.size() > 200 || name[0] == '.' || name.find_first_of("/\\") != std::string::npos ||
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < ' '; }))
    throw InputError("the name of the file must be one without folders");
}

std::string with_part(const std::string& file, std::string_view part) {
  const std::string stem = formats::file_stem(file);
  return fmt::format("{}.{}{}", stem, part, fs::path(file).filename().string().substr(stem.size()));
}

// The file that is to be written, where it may be; the first state of an opened one is kept before.
std::string keep_first_state(const view::SavedDocument& saved, const view::ViewDocument& document,
                             const std::string& name, bool in_place) {
  const fs::path path = saved.folder() / name;
  if (!is_there(path)) return {};
  const bool is_opened = name == document.opened;
  if (is_opened && !in_place)
    throw InputError(fmt::format(
        "{} is the file that was opened: choose another name, or start with --in-place to replace it", name));
  if (!is_opened && !is_listed(document.exported, name))
    throw InputError(fmt::format("{} is there already, and not by this session: choose another name", name));
  if (!is_opened) return {};
  const fs::path first = saved.folder() / with_part(name, "first");
  if (!is_there(first)) write_file_atomically(first, read_file(path));
  return first.string();
}

}  // namespace

std::string export_name(const view::SavedDocument& saved, bool in_place) {
  const view::ViewDocument document = saved.document();
  if (!document.exported.empty()) return document.exported.back();
  if (!document.opened.empty()) {
    const std::string name = fs::path(document.opened).filename().string();
    return in_place && name == document.opened ? name : with_part(name, "placed");
  }
  return formats::file_stem(formats::file_stem(saved.path())) + ".tps";
}

ExportResult export_landmarks(view::SavedDocument& saved, const std::string& name, bool in_place) {
  require_plain_name(name);
  view::ViewDocument document = saved.document();
  drop_unused_landmarks(document);
  formats::LandmarkFile file;
  for (const view::ViewSpecimen& specimen : document.specimens)
    if (has_any(specimen)) file.shapes.push_back(shape_of(document, specimen));
  if (file.shapes.empty()) throw InputError("nothing is placed yet; there is nothing to export");
  const fs::path path = saved.folder() / name;
  const std::string units_lost = set_units(file);
  const formats::LandmarkFormat& format = formats::landmark_format_to_write(path);
  const formats::WrittenLandmarks written = formats::text_of_landmarks(path, file, format);
  ExportResult result{path.lexically_normal().string(), keep_first_state(saved, document, name, in_place),
                      written.losses, file.shapes.size()};
  if (!units_lost.empty()) result.losses.push_back(units_lost);
  write_file_atomically(path, written.text);
  if (!is_listed(document.exported, name))
    saved.change([&](view::ViewDocument& next) { next.exported.push_back(name); });
  return result;
}

}  // namespace pulson
