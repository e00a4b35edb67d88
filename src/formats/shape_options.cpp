#include "shape_options.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
#include "core/text.hpp"
#include "formats/text/text_lines.hpp"
#include "missing_marks.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {

bool take_lines_as_landmarks(Landmarks& shape) {
  if (shape.count() > 0 || (shape.curves.empty() && shape.outlines.empty())) return false;
  const Eigen::Index dimension = (shape.curves.empty() ? shape.outlines : shape.curves).front().rows();
  std::vector<double> coordinates;
  const auto take = [&](std::vector<Points>& lines, const std::string& kind) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      coordinates.insert(coordinates.end(), lines[i].reshaped().begin(), lines[i].reshaped().end());
      shape.groups.insert(shape.groups.end(), static_cast<std::size_t>(lines[i].cols()),
                          fmt::format("{} {}", kind, i + 1));
    }
    lines.clear();
  };
  take(shape.curves, "curve");
  take(shape.outlines, "outline");
  shape.points = Points::Map(coordinates.data(), dimension, static_cast<Eigen::Index>(shape.groups.size()));
  return true;
}

bool give_lines_back(Landmarks& shape) {
  const auto is_line = [](const std::string& group) {
    return group.starts_with("curve ") || group.starts_with("outline ");
  };
  if (shape.groups.empty() || !std::all_of(shape.groups.begin(), shape.groups.end(), is_line)) return false;
  for (const std::vector<int>& line : landmarks_by_group(shape)) {
    const bool is_curve = shape.groups[static_cast<std::size_t>(line.front())].starts_with("curve ");
    (is_curve ? shape.curves : shape.outlines).emplace_back(shape.points(Eigen::all, line));
  }
  shape.points.resize(shape.points.rows(), 0);
  shape.groups.clear();
  shape.labels.clear();
  shape.numbers.clear();
  shape.links.clear();
  shape.absent.clear();
  return true;
}

std::string taken_as_landmarks(std::size_t shapes) {
  return text::counted(shapes, "shape") +
         " without landmarks: the points of curves and outlines are taken as landmarks, one group for each";
}

namespace {

/// The complete points, with the first one again at the end of a closed line.
Points vertices_of(const Points& line, LineEnds ends) {
  std::vector<int> known;
  for (Eigen::Index i = 0; i < line.cols(); ++i)
    if (!line.col(i).hasNaN()) known.push_back(static_cast<int>(i));
  if (ends == LineEnds::kClosed && !known.empty()) known.push_back(known.front());
  return line(Eigen::all, known);
}

/// The arc length from the first point to each.
Eigen::VectorXd lengths_along(const Points& vertices) {
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(vertices.cols());
  for (Eigen::Index i = 1; i < vertices.cols(); ++i)
    lengths[i] = lengths[i - 1] + (vertices.col(i) - vertices.col(i - 1)).stableNorm();
  return lengths;
}

}  // namespace

Points evenly_spaced(const Points& line, LineEnds ends, int count) {
  const Points vertices = vertices_of(line, ends);
  if (vertices.cols() == 0) return Points::Constant(line.rows(), count, std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXd lengths = lengths_along(vertices);
  const double total = lengths[lengths.size() - 1];
  if (!(total > 0)) throw InputError("it has no length");
  if (!std::isfinite(total)) throw InputError("its length is too large");
  const int steps = ends == LineEnds::kClosed ? count : count - 1;
  Points points(line.rows(), count);
  Eigen::Index next = 1;  // the vertex at or beyond the point
  for (int i = 0; i < count; ++i) {
    const double length = i == steps ? total : total * i / steps;
    while (next + 1 < vertices.cols() && lengths[next] < length) ++next;
    const double piece = lengths[next] - lengths[next - 1];
    const double part = piece > 0 ? std::clamp((length - lengths[next - 1]) / piece, 0.0, 1.0) : 0.0;
    points.col(i) = (1 - part) * vertices.col(next - 1) + part * vertices.col(next);
  }
  return points;
}

namespace {

// ---- scales

/// The unit that lengths have after the scale is applied, where the file says it.
std::string unit_of_scale(const Landmarks& shape) {
  const auto found = std::find_if(shape.properties.begin(), shape.properties.end(),
                                  [](const auto& property) { return property.first == "scaling.units"; });
  return found == shape.properties.end() ? std::string() : found->second;
}

void apply_scale(Landmarks& shape) {
  if (!shape.scale) throw InputError(shape.source + " has no scale to multiply its coordinates by");
  if (!(*shape.scale > 0))
    throw InputError(fmt::format("{}: its scale is {}; a number greater than 0 is needed", shape.source, *shape.scale));
  change_points(shape, [&](Points& points) {
    points *= *shape.scale;
    if (points.array().isInf().any())
      throw InputError(fmt::format("{}: its coordinates are too large to be multiplied by its scale, {}", shape.source,
                                   *shape.scale));
  });
  for (double& length : shape.frame.unit_per_pixel) length *= *shape.scale;
  for (double& place : shape.frame.origin) place *= *shape.scale;
  shape.frame.says_units = true;
  shape.units = unit_of_scale(shape);
  shape.scale.reset();
}

void apply_scales(LandmarkFile& file) {
  for (Landmarks& shape : file.shapes) apply_scale(shape);
  const auto has_same_units = [&](const Landmarks& shape) { return shape.units == file.shapes.front().units; };
  const bool are_same = std::all_of(file.shapes.begin(), file.shapes.end(), has_same_units);
  file.units = are_same && !file.shapes.empty() ? file.shapes.front().units : "";
}

// ---- a choice of landmarks

/// The landmarks that a list of numbers, ranges and labels names, in its order.
class LandmarkList {
 public:
  explicit LandmarkList(const Landmarks& shape) : shape_(shape) {
    for (int a = 0; a < shape.count(); ++a) {
      places_.try_emplace(static_cast<std::size_t>(shape.number(a)), a);
      if (!shape.labels.empty()) labelled_[shape.labels[static_cast<std::size_t>(a)]].push_back(a);
    }
  }

  std::vector<int> find(std::string_view list) {
    for (bool is_last = false; !is_last;) {
      const std::size_t comma = list.find(',');
      is_last = comma == std::string_view::npos;
      add(text::trim(list.substr(0, comma)));
      if (!is_last) list.remove_prefix(comma + 1);
    }
    return std::move(chosen_);
  }

 private:
  void add(std::string_view item) {
    if (const auto found = labelled_.find(std::string(item)); found != labelled_.end() && !item.empty()) {
      for (const int a : found->second) add_place(a);
      return;
    }
    if (const std::optional<std::size_t> number = parse_count(item)) return add_numbers(*number, *number);
    for (std::size_t dash = item.find('-'); dash != std::string_view::npos; dash = item.find('-', dash + 1)) {
      const std::string_view from = text::trim(item.substr(0, dash)), to = text::trim(item.substr(dash + 1));
      const std::optional<std::size_t> first = parse_count(from), last = parse_count(to);
      if (first && last) return add_numbers(*first, *last);
      const std::optional<int> begin = labelled_once(from), end = labelled_once(to);
      if (begin && end) return add_places(*begin, *end);
    }
    fail_unknown(item);
  }

  std::optional<int> labelled_once(std::string_view label) const {
    const auto found = labelled_.find(std::string(label));
    if (label.empty() || found == labelled_.end() || found->second.size() != 1) return std::nullopt;
    return found->second.front();
  }

  // From `first` to `last`, both included, backwards where it is the greater one.
  template <class Number, class Add>
  static void each_of(Number first, Number last, const Add& add) {
    for (Number number = first;; first < last ? ++number : --number) {
      add(number);
      if (number == last) return;
    }
  }

  void add_numbers(std::size_t first, std::size_t last) {
    each_of(first, last, [this](std::size_t number) {
      const auto found = places_.find(number);
      if (found == places_.end()) fail_number(number);
      add_place(found->second);
    });
  }

  void add_places(int first, int last) {
    each_of(first, last, [this](int a) { add_place(a); });
  }

  void add_place(int a) {
    if (!is_chosen_.insert(a).second)
      throw InputError(
          fmt::format("{}: landmark {} is in the list of landmarks twice", shape_.source, shape_.describe(a)));
    chosen_.push_back(a);
  }

  [[noreturn]] void fail_number(std::size_t number) const {
    throw InputError(fmt::format("{} has no landmark {}; they are numbered from {} to {}", shape_.source, number,
                                 places_.begin()->first, places_.rbegin()->first));
  }

  [[noreturn]] void fail_unknown(std::string_view item) const {
    const std::string near = nearest_name(std::string(item), shape_.labels);
    const std::string advice = !near.empty() ? "did you mean '" + near + "'?"
                               : shape_.labels.empty()
                                   ? "it has no labels, and a number or a range such as 1-20 is expected"
                                   : "a label, a number or a range such as 1-20 is expected";
    throw InputError(fmt::format("{} has no landmark {}; {}", shape_.source, text::in_quotes(item), advice));
  }

  const Landmarks& shape_;
  std::map<std::size_t, int> places_;  // by their numbers
  std::map<std::string, std::vector<int>> labelled_;
  std::vector<int> chosen_;
  std::set<int> is_chosen_;
};

// ---- points of curves

void add_line(Landmarks& shape, const Points& line, LineEnds ends, const std::string& name, int count) {
  Points samples;
  try {
    samples = evenly_spaced(line, ends, count);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {} cannot be resampled: {}", shape.source, name, error.what()));
  }
  const Eigen::Index before = shape.points.cols();
  shape.points.conservativeResize(samples.rows(), before + count);
  shape.points.rightCols(count) = samples;
  shape.groups.insert(shape.groups.end(), static_cast<std::size_t>(count), name);
  for (int i = 1; i <= count; ++i) {
    if (!shape.labels.empty()) shape.labels.push_back(fmt::format("{} point {}", name, i));
    if (!shape.numbers.empty()) shape.numbers.push_back(shape.numbers.back() + 1);
  }
}

void require_same_dimension(const Landmarks& shape, const Points& line) {
  if (shape.count() > 0 && line.rows() != shape.points.rows())
    throw InputError(
        fmt::format("{}: a curve is in {}D, its landmarks in {}D", shape.source, line.rows(), shape.points.rows()));
}

/// Takes points of the curves and outlines of a shape for landmarks, a group for each.
void add_points_of_curves(Landmarks& shape, int count) {
  if (shape.curves.empty() && shape.outlines.empty()) return;
  if (shape.groups.empty()) shape.groups.assign(static_cast<std::size_t>(shape.count()), "landmarks");
  if (!shape.numbers.empty()) {  // those of the points follow the largest
    const auto largest = std::max_element(shape.numbers.begin(), shape.numbers.end());
    if (*largest != shape.numbers.back()) shape.numbers.clear();
  }
  const auto add = [&](std::vector<Points>& lines, LineEnds ends, const std::string& kind) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      require_same_dimension(shape, lines[i]);
      add_line(shape, lines[i], ends, fmt::format("{} {}", kind, i + 1), count);
    }
    lines.clear();
  };
  add(shape.curves, LineEnds::kOpen, "curve");
  add(shape.outlines, LineEnds::kClosed, "outline");
}

void require_curves(const LandmarkFile& file) {
  const auto has_some = [](const Landmarks& shape) { return !shape.curves.empty() || !shape.outlines.empty(); };
  if (!file.shapes.empty() && std::none_of(file.shapes.begin(), file.shapes.end(), has_some))
    throw InputError(file.shapes.front().source + " has no curves or outlines to take points from");
}

void withdraw(LandmarkFile& file, const std::string& path, const std::string& note) {
  std::erase(file.warnings, path + ": " + note);
}

}  // namespace

void prepare_shapes(const ReadOptions& options, const std::string& path, LandmarkFile& file) {
  if (options.applies_scale) withdraw(file, path, note_of_scales(file.shapes));
  if (options.curve_points == 0) return;
  withdraw(file, path, note_of_curves(file.shapes));
  std::size_t shapes = 0;
  for (Landmarks& shape : file.shapes) shapes += give_lines_back(shape) ? 1 : 0;
  withdraw(file, path, taken_as_landmarks(shapes));
}

void apply_to_shapes(const ReadOptions& options, LandmarkFile& file) {
  if (options.applies_scale) apply_scales(file);
  if (!options.links.empty()) apply_links(options.links, file);
  if (!options.absent_table.empty()) apply_absent_table(options.absent_table, file);
  if (!options.landmarks.empty())
    for (Landmarks& shape : file.shapes)
      if (shape.count() > 0) shape = selected(shape, LandmarkList(shape).find(options.landmarks));
  if (options.curve_points == 0) return;
  require_curves(file);
  for (Landmarks& shape : file.shapes) add_points_of_curves(shape, options.curve_points);
}

namespace {

std::size_t count_points(const std::vector<Points>& lines) {
  std::size_t points = 0;
  for (const Points& line : lines) points += static_cast<std::size_t>(line.cols());
  return points;
}

}  // namespace

std::string note_of_scales(const std::vector<Landmarks>& shapes) {
  std::size_t scales = 0;
  for (const Landmarks& shape : shapes) scales += shape.scale ? 1 : 0;
  if (scales == 0) return {};
  return fmt::format(
      "SCALE ({} of {}) is kept and not applied: coordinates are in pixels; `applies_scale` multiplies them by it",
      scales, text::counted(shapes.size(), "shape"));
}

std::string note_of_curves(const std::vector<Landmarks>& shapes) {
  std::size_t curves = 0;
  std::size_t outlines = 0;
  std::size_t points = 0;
  for (const Landmarks& shape : shapes) {
    curves += shape.curves.size();
    outlines += shape.outlines.size();
    points += count_points(shape.curves) + count_points(shape.outlines);
  }
  if (curves + outlines == 0) return {};
  return fmt::format("{} and {} ({}) are kept and not used as landmarks; `curve_points = N` takes N points of each",
                     text::counted(curves, "curve"), text::counted(outlines, "outline"),
                     text::counted(points, "point"));
}

}  // namespace pulson::formats
