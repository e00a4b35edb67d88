#include "draw/checks.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

bool can_be_drawn(const Points& points) { return (points.array().abs() <= kLargestDrawn).all(); }

constexpr double kFlat = 0.02;  // of a line to be simplified, in its own unit

/// Adds to `kept`, in order and each once, what is later than its last.
void keep(std::vector<std::size_t>& kept, std::vector<std::size_t>& indices) {
  std::sort(indices.begin(), indices.end());
  for (const std::size_t k : indices)
    if (k > kept.back()) kept.push_back(k);
}

double distance_to_segment(const Eigen::Vector2d& point, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double square = along.squaredNorm();
  const double s = square > 0 ? std::clamp((point - from).dot(along) / square, 0.0, 1.0) : 0;
  return (point - from - s * along).norm();
}

/// How far the line would move at the least without its vertex i, for each i; infinite at the ends.
std::vector<double> weights_of(const Points& line) {
  std::vector<double> weights(static_cast<std::size_t>(line.cols()), std::numeric_limits<double>::infinity());
  struct Part {
    Eigen::Index first, last;
    double most;  // the weight of what divided it off
  };
  std::vector<Part> parts{{0, line.cols() - 1, std::numeric_limits<double>::infinity()}};
  while (!parts.empty()) {
    const auto [first, last, most] = parts.back();
    parts.pop_back();
    double farthest = -1;
    Eigen::Index divider = first;
    for (Eigen::Index i = first + 1; i < last; ++i)
      if (const double d = distance_to_segment(line.col(i), line.col(first), line.col(last)); d > farthest) {
        farthest = d;
        divider = i;
      }
    if (divider == first) continue;
    weights[divider] = std::min(farthest, most);
    if (farthest < kFlat) {
      std::fill(weights.begin() + first + 1, weights.begin() + last, weights[divider]);
    } else {
      parts.push_back({first, divider, weights[divider]});
      parts.push_back({divider, last, weights[divider]});
    }
  }
  return weights;
}

std::vector<std::size_t> all_indices(std::size_t count) {
  std::vector<std::size_t> indices(count);
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

}  // namespace

void Checks::refuse(const std::string& why) const { throw InputError(picture_ + ": " + why); }

void Checks::shape(const Landmarks& shape, const std::string& what) const {
  const int d = shape.dimension();
  if (d < 1 || d > 3) refuse(fmt::format("the dimension is {}; 1, 2 and 3 can be drawn", d));
  if (shape.count() == 0) refuse("there are no landmarks");
  if (!shape.groups.empty() && shape.groups.size() != static_cast<std::size_t>(shape.count()))
    refuse(fmt::format("{} group names for {} landmarks", shape.groups.size(), shape.count()));
  for (const auto& [a, b] : shape.links)
    if (std::min(a, b) < 0 || std::max(a, b) >= shape.count()) refuse(fmt::format("a link joins {} and {}", a, b));
  points(shape.points, d, what);
}

void Checks::incomplete_shape(const Landmarks& shape, Eigen::Index rows, const std::string& what) const {
  const auto is_missing = shape.points.array().isNaN();
  points(is_missing.select(0, shape.points), rows, what);
  if (shape.count() == 0) refuse(fmt::format("{} has no landmarks", what));
  if (is_missing.all()) refuse(fmt::format("{} has no coordinates", what));
  if (!shape.groups.empty() && shape.groups.size() != static_cast<std::size_t>(shape.count()))
    refuse(fmt::format("{} has {} group names for {} landmarks", what, shape.groups.size(), shape.count()));
}

void Checks::points(const Points& points, Eigen::Index rows, const std::string& what) const {
  if (points.rows() != rows) refuse(fmt::format("{} has {} rows, not {}", what, points.rows(), rows));
  if (can_be_drawn(points)) return;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) refuse(fmt::format("point {} of {} is not finite", i + 1, what));
    if (!can_be_drawn(points.col(i)))
      refuse(fmt::format("point {} of {} is larger than {:g}, too large to be drawn", i + 1, what, kLargestDrawn));
  }
}

void Checks::landmarks(const Points& points, const Landmarks& shape, const std::string& shape_name,
                       const std::string& what) const {
  this->points(points, shape.dimension(), what);
  count(points, shape, shape_name, what);
}

void Checks::count(const Points& points, const Landmarks& shape, const std::string& shape_name,
                   const std::string& what) const {
  if (points.cols() != shape.count())
    refuse(fmt::format("{} has {} landmarks, {} {}", what, points.cols(), shape_name, shape.count()));
}

void Checks::trajectory(const std::vector<Points>& entries, const Landmarks& shape, const std::string& shape_name,
                        const std::string& what) const {
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (entries[k].rows() != shape.points.rows() || entries[k].cols() != shape.points.cols() ||
        !can_be_drawn(entries[k]))
      landmarks(entries[k], shape, shape_name, fmt::format("{} entry {}", what, k + 1));
}

void Checks::times(const std::vector<double>& times, std::size_t entries, const std::string& of_what) const {
  if (times.size() != entries || entries < 2)
    refuse(fmt::format("{} times for {} entries of {}; both must be K+1, K ≥ 1", times.size(), entries, of_what));
  for (std::size_t k = 0; k < times.size(); ++k)
    if (!can_be_drawn(times[k]) || (k > 0 && times[k] <= times[k - 1]))
      refuse(
          fmt::format("time {} is {}; times must increase and be no larger than {:g}", k + 1, times[k], kLargestDrawn));
}

std::vector<std::size_t> spread_indices(std::size_t count, std::size_t most) {
  if (count <= most) return all_indices(count);
  std::vector<std::size_t> indices(most);
  for (std::size_t i = 0; i < most; ++i) indices[i] = i * (count - 1) / (most - 1);
  return indices;
}

std::vector<std::vector<std::size_t>> thin_paths(const std::vector<Points>& trajectory,
                                                 const std::vector<int>& landmarks, const std::vector<double>& times,
                                                 std::size_t most) {
  const std::size_t count = trajectory.size(), n = landmarks.size();
  if (count <= most) return {n, all_indices(count)};
  const auto d = static_cast<std::size_t>(trajectory.front().rows());
  const double pieces = std::max(1.0, std::floor((static_cast<double>(most) - 2) / (2.0 * static_cast<double>(d))));
  const double start = times.front(), duration = times.back() - times.front();
  const auto piece_of = [&](std::size_t k) {
    return std::min(std::floor((times[k] - start) / duration * pieces), pieces - 1);
  };

  std::vector<std::vector<std::size_t>> kept(n, {0});
  std::vector<std::size_t> extremes;  // least and greatest of each coordinate
  for (std::size_t i = 0; i < n; ++i) {
    const auto value = [&](std::size_t k, std::size_t row) { return trajectory[k](row, landmarks[i]); };
    for (std::size_t k = 0; k < count;) {
      const double piece = piece_of(k);
      for (extremes.assign(2 * d, k); k < count && piece_of(k) == piece; ++k)
        for (std::size_t row = 0; row < d; ++row) {
          if (value(k, row) < value(extremes[2 * row], row)) extremes[2 * row] = k;
          if (value(k, row) > value(extremes[2 * row + 1], row)) extremes[2 * row + 1] = k;
        }
      keep(kept[i], extremes);
    }
    keep(kept[i], extremes = {count - 1});
  }
  return kept;
}

void simplify_lines(std::vector<Points>& lines, std::size_t most) {
  std::vector<std::vector<double>> weights;
  std::vector<double> sorted;
  std::size_t count = 0;
  for (const Points& line : lines) count += static_cast<std::size_t>(line.cols());
  if (count <= most) return;
  for (const Points& line : lines) {
    weights.push_back(weights_of(line));
    sorted.insert(sorted.end(), weights.back().begin(), weights.back().end());
  }
  const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(sorted.begin(), place, sorted.end(), std::greater<>());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::vector<Eigen::Index> kept;
    for (std::size_t j = 0; j < weights[i].size(); ++j)
      if (weights[i][j] > *place || std::isinf(weights[i][j])) kept.push_back(static_cast<Eigen::Index>(j));
    lines[i] = Points(lines[i](Eigen::all, kept));
  }
}

}  // namespace pulson::draw
