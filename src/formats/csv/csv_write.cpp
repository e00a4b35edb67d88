#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {
namespace {

bool needs_quotes(const std::string& text) {
  return text.find_first_of(",;\t\"# ") != std::string::npos || text.starts_with("//");
}

std::string csv_field(const std::string& text) { return needs_quotes(text) ? io::csv_quoted(text) : text; }

/// `x`, `x,y` or `x,y,z`
std::string coordinate_names(int dimension) {
  return std::string("x,y,z").substr(0, static_cast<std::size_t>(2 * dimension - 1));
}

void append_point(std::string& text, const Points& points, int landmark) {
  for (int axis = 0; axis < points.rows(); ++axis) {
    if (axis > 0) text += ',';
    const double value = points(axis, landmark);
    text += std::isnan(value) ? "NA" : fmt::format("{}", value);
  }
}

}  // namespace

std::string landmarks_csv(const Landmarks& shape) {
  const bool has_labels = !shape.labels.empty();
  const bool has_groups = !shape.groups.empty();
  const std::string header = coordinate_names(shape.dimension());
  std::string text = (has_labels ? "label," : "") + header + (has_groups ? ",group\n" : "\n");
  for (int i = 0; i < shape.count(); ++i) {
    const auto place = static_cast<std::size_t>(i);
    if (has_labels) text += csv_field(shape.labels[place]) + ',';
    append_point(text, shape.points, i);
    if (has_groups) text += ',' + csv_field(shape.groups[place]);
    text += '\n';
  }
  return text;
}

void write_landmarks_csv(const std::filesystem::path& path, const Landmarks& shape) {
  write_file_atomically(path, landmarks_csv(shape));
}

namespace {

/// Shapes made fit for the table, one by one.
class TableShapes {
 public:
  TableShapes(const std::string& path, const LandmarkFile& file)
      : target_{path, "csv"}, count_(file.shapes.size()), losses_(losses_of(target_, file, held_by(file))) {
    require_shapes(target_, file);
    for (const Landmarks& shape : file.shapes) add(shape);
    if (shapes_.empty()) require_landmarks(target_, file.shapes.front());
    require_equal_dimensions();
    if (has_breaks_) losses_.push_back(cannot_hold_breaks(target_));
    if (empty_ > 0) losses_.push_back(cannot_hold(target_, "shapes without landmarks", empty_, count_));
    if (unlabelled_ > 0) losses_.push_back(cannot_hold(target_, "labels that repeat", unlabelled_, count_));
  }

  const std::vector<Landmarks>& shapes() const { return shapes_; }
  std::vector<std::string>& losses() { return losses_; }

  /// Names that differ, as a long table needs them.
  void make_names_unique() {
    std::set<std::string> taken;
    for (const Landmarks& shape : shapes_) taken.insert(shape.name);
    std::set<std::string> seen;
    std::size_t renamed = 0;
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      std::string& name = shapes_[i].name;
      if (!name.empty() && seen.insert(name).second) continue;
      while (name.empty() || !taken.insert(name).second) name += fmt::format("#{}", i + 1);
      ++renamed;
    }
    if (renamed > 0)
      losses_.push_back(cannot_hold(target_, "names that are empty or repeat, which end in #number", renamed, count_));
  }

 private:
  static HeldParts held_by(const LandmarkFile& file) {
    return {.names = file.shapes.size() > 1, .labels = true, .groups = true};
  }

  void add(const Landmarks& shape) {
    if (shape.count() == 0) {
      ++empty_;
      return;
    }
    Landmarks& kept = shapes_.emplace_back();
    kept.points = shape.points;
    kept.name = one_line(shape.name, has_breaks_);
    for (const std::string& label : shape.labels) kept.labels.push_back(one_line(label, has_breaks_));
    for (const std::string& group : shape.groups) kept.groups.push_back(one_line(group, has_breaks_));
    if (!has_repeated_label(kept)) return;
    ++unlabelled_;
    kept.labels.clear();
  }

  static bool has_repeated_label(const Landmarks& shape) {
    std::set<std::pair<std::string_view, std::string_view>> seen;
    for (std::size_t i = 0; i < shape.labels.size(); ++i) {
      const std::string_view group = shape.groups.empty() ? std::string_view() : shape.groups[i];
      if (!shape.labels[i].empty() && !seen.insert({group, shape.labels[i]}).second) return true;
    }
    return false;
  }

  void require_equal_dimensions() const {
    const int dimension = shapes_.front().dimension();
    for (const Landmarks& shape : shapes_)
      if (shape.dimension() != dimension)
        throw InputError(fmt::format("{}: {} is in {}D and {} in {}D; the shapes of a table need the same dimension",
                                     target_.path, io::in_quotes(shapes_.front().name), dimension,
                                     io::in_quotes(shape.name), shape.dimension()));
  }

  Target target_;
  std::size_t count_;
  std::vector<Landmarks> shapes_;
  std::vector<std::string> losses_;
  bool has_breaks_ = false;
  std::size_t empty_ = 0;
  std::size_t unlabelled_ = 0;
};

std::string long_table(const std::vector<Landmarks>& shapes) {
  const bool has_labels = std::any_of(shapes.begin(), shapes.end(), [](const auto& s) { return !s.labels.empty(); });
  const bool has_groups = std::any_of(shapes.begin(), shapes.end(), [](const auto& s) { return !s.groups.empty(); });
  std::string text = fmt::format("specimen,{}{}{}\n", has_labels ? "landmark," : "",
                                 coordinate_names(shapes.front().dimension()), has_groups ? ",group" : "");
  for (const Landmarks& shape : shapes) {
    const std::string name = csv_field(shape.name) + ',';
    for (int i = 0; i < shape.count(); ++i) {
      const auto place = static_cast<std::size_t>(i);
      text += name;
      if (has_labels) text += (shape.labels.empty() ? std::to_string(i + 1) : csv_field(shape.labels[place])) + ',';
      append_point(text, shape.points, i);
      if (has_groups) text += ',' + (shape.groups.empty() ? "" : csv_field(shape.groups[place]));
      text += '\n';
    }
  }
  return text;
}

}  // namespace

WrittenLandmarks write_csv(const std::string& path, const LandmarkFile& file) {
  TableShapes table(path, file);
  if (file.shapes.size() > 1) {
    table.make_names_unique();
    return {long_table(table.shapes()), std::move(table.losses())};
  }
  return {landmarks_csv(table.shapes().front()), std::move(table.losses())};
}

}  // namespace pulson::formats
