#include "landmark_writers.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

/// Whether read_landmark_file made the name from that of the file.
bool is_named_by_source(const Landmarks& shape) {
  const std::size_t hash = shape.source.rfind('#');
  const std::string number = hash == std::string::npos ? "" : shape.source.substr(hash);
  return shape.name == name_by_file(shape.source.substr(0, hash)) + number;
}

std::string called(const Landmarks& shape) {
  return shape.name.empty() ? "the shape" : "the shape " + text::in_quotes(shape.name);
}

}  // namespace

std::string cannot_hold(const Target& target, std::string_view what) {
  return fmt::format("{}: {} cannot hold {}", target.path, target.format, what);
}

std::string cannot_hold(const Target& target, std::string_view what, std::size_t count, std::size_t shapes) {
  return cannot_hold(target, what) + (shapes == 1 ? "" : fmt::format(" ({} of {} shapes)", count, shapes));
}

std::vector<std::string> losses_of(const Target& target, const LandmarkFile& file, const HeldParts& held) {
  const std::string stem = name_by_file(target.path);
  std::vector<std::string> losses;
  const auto lose = [&](bool is_held, std::string_view what, auto has_part) {
    if (is_held) return;
    const auto count = static_cast<std::size_t>(std::count_if(file.shapes.begin(), file.shapes.end(), has_part));
    if (count > 0) losses.push_back(cannot_hold(target, what, count, file.shapes.size()));
  };
  const auto has_own_name = [&](const Landmarks& shape) {
    return !shape.name.empty() && shape.name != stem && !is_named_by_source(shape);
  };
  lose(held.names, "names of shapes", has_own_name);
  lose(held.labels, "labels", [](const Landmarks& shape) { return !shape.labels.empty(); });
  lose(held.groups, "groups", [](const Landmarks& shape) { return !shape.groups.empty(); });
  lose(held.images, "images", [](const Landmarks& shape) { return !shape.image.empty(); });
  lose(held.scales, "scales", [](const Landmarks& shape) { return shape.scale.has_value(); });
  const auto is_in_plane = [](const Landmarks& shape) { return shape.dimension() == 2 && shape.count() > 0; };
  lose(held.directions || held.frames, "that y points up",
       [&](const Landmarks& shape) { return is_in_plane(shape) && shape.frame.says_y && !shape.frame.y_down; });
  lose(held.frames, "units per pixel", [&](const Landmarks& shape) {
    return is_in_plane(shape) && shape.frame.says_units && shape.frame.unit_per_pixel != std::array{1.0, 1.0};
  });
  lose(held.properties, "properties", [](const Landmarks& shape) { return !shape.properties.empty(); });
  lose(held.lines, "curves", [](const Landmarks& shape) { return !shape.curves.empty(); });
  lose(held.lines, "outlines", [](const Landmarks& shape) { return !shape.outlines.empty(); });
  lose(held.absent, "which landmarks are absent and not missing",
       [](const Landmarks& shape) { return !shape.absent.empty(); });
  lose(held.links, "links", [](const Landmarks& shape) { return !shape.links.empty(); });
  if (!held.units && !file.units.empty())
    losses.push_back(cannot_hold(target, "the units " + text::in_quotes(file.units)));
  if (!held.axes && !file.axes.empty()) losses.push_back(cannot_hold(target, "the axes " + text::in_quotes(file.axes)));
  return losses;
}

void add_once(std::vector<std::string>& losses, const std::string& line) {
  if (std::find(losses.begin(), losses.end(), line) == losses.end()) losses.push_back(line);
}

std::string one_line(std::string text, bool& is_changed) {
  for (char& c : text)
    if (c == '\n' || c == '\r' || c == '\0') {
      c = ' ';
      is_changed = true;
    }
  std::string trimmed(text::trim(text));
  is_changed = is_changed || trimmed != text;
  return trimmed;
}

std::string cannot_hold_breaks(const Target& target) {
  return cannot_hold(target, "line breaks and outer blanks of texts");
}

void require_shapes(const Target& target, const LandmarkFile& file) {
  if (file.shapes.empty()) throw InputError(target.path + ": there are no shapes to write");
}

const Landmarks& require_one_shape(const Target& target, const LandmarkFile& file) {
  require_shapes(target, file);
  if (file.shapes.size() > 1)
    throw InputError(
        fmt::format("{}: {} holds one shape; there are {}", target.path, target.format, file.shapes.size()));
  return file.shapes.front();
}

void require_landmarks(const Target& target, const Landmarks& shape) {
  if (shape.count() == 0) throw InputError(target.path + ": there are no landmarks to write");
}

void require_plane_or_space(const Target& target, const Landmarks& shape) {
  if (const int d = shape.dimension(); d != 2 && d != 3)
    throw InputError(
        fmt::format("{}: {} holds shapes in 2D or 3D; {} is in {}D", target.path, target.format, called(shape), d));
}

void require_complete(const Target& target, const Landmarks& shape) {
  const std::vector<int> incomplete = incomplete_points(shape.points);
  if (incomplete.empty()) return;
  throw InputError(cannot_hold(target, fmt::format("missing coordinates; landmark {} of {} misses one",
                                                   shape.describe(incomplete.front()), called(shape))));
}

Points points_in_space(const Target& target, const Landmarks& shape, std::vector<std::string>& losses) {
  require_plane_or_space(target, shape);
  if (shape.dimension() == 3) return shape.points;
  add_once(losses, target.path + ": landmarks in the plane get z = 0");
  Points points = Points::Zero(3, shape.count());
  points.topRows(2) = shape.points;
  return points;
}

void append_points(std::string& text, const Points& points, std::string_view missing_mark) {
  for (const auto& point : points.colwise()) {
    for (Eigen::Index c = 0; c < point.size(); ++c) {
      if (c > 0) text += ' ';
      if (std::isnan(point[c]))
        text += missing_mark;
      else
        fmt::format_to(std::back_inserter(text), "{}", point[c]);
    }
    text += '\n';
  }
}

}  // namespace pulson::formats
