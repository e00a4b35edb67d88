#include "annotated_shapes.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "shape_options.hpp"

namespace pulson::formats {

void GatheredPoints::add(const Eigen::VectorXd& point, std::string label, std::string group) {
  coordinates_.insert(coordinates_.end(), point.begin(), point.end());
  labels_.push_back(std::move(label));
  groups_.push_back(std::move(group));
}

void GatheredPoints::add_missing(std::string label, std::string group) {
  add(Eigen::VectorXd::Constant(dimension_, text::kMissing), std::move(label), std::move(group));
}

void GatheredPoints::move_to(Landmarks& shape) {
  shape.points = text::points_from(coordinates_, static_cast<std::size_t>(dimension_));
  shape.labels = text::unless_all_empty(std::move(labels_));
  shape.groups = text::unless_all_empty(std::move(groups_));
}

void name_by_images(std::vector<Landmarks>& shapes) {
  std::map<std::string, std::size_t> of_image;
  for (const Landmarks& shape : shapes) ++of_image[shape.image];
  std::map<std::string, std::size_t> seen;
  for (Landmarks& shape : shapes) {
    const std::string stem = text::image_stem(shape.image);
    const std::size_t number = ++seen[shape.image];
    if (stem.empty() || !shape.name.empty()) continue;
    shape.name = of_image[shape.image] == 1 ? stem : fmt::format("{}_{}", stem, number);
  }
}

namespace {

/// The first label that repeats within a group; empty where none does.
std::string repeated_label(const Landmarks& shape) {
  std::set<std::pair<std::string, std::string>> seen;
  for (std::size_t i = 0; i < shape.labels.size(); ++i) {
    const std::string& label = shape.labels[i];
    if (!label.empty() && !seen.emplace(shape.groups.empty() ? "" : shape.groups[i], label).second) return label;
  }
  return {};
}

}  // namespace

void drop_repeated_labels(const std::string& path, LandmarkFile& file) {
  for (const Landmarks& shape : file.shapes) {
    const std::string repeated = repeated_label(shape);
    if (repeated.empty()) continue;
    file.warnings.push_back(fmt::format("{}: the label {} repeats within a shape; landmarks are known by their number",
                                        path, text::in_quotes(repeated)));
    for (Landmarks& other : file.shapes) other.labels.clear();
    return;
  }
}

Points without_closing_point(const Points& line) {
  const Eigen::Index count = line.cols();
  return count > 1 && line.col(0) == line.col(count - 1) ? Points(line.leftCols(count - 1)) : line;
}

void take_lines_where_alone(const std::string& path, LandmarkFile& file) {
  const bool have_landmarks =
      std::any_of(file.shapes.begin(), file.shapes.end(), [](const Landmarks& shape) { return shape.count() > 0; });
  if (have_landmarks) {
    if (const std::string note = note_of_curves(file.shapes); !note.empty())
      file.warnings.push_back(fmt::format("{}: {}", path, note));
    return;
  }
  std::size_t taken = 0;
  for (Landmarks& shape : file.shapes) taken += take_lines_as_landmarks(shape) ? 1 : 0;
  if (taken > 0) file.warnings.push_back(fmt::format("{}: {}", path, taken_as_landmarks(taken)));
}

}  // namespace pulson::formats
