#include "pulson/core/landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "core/landmark_pairs.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

template <int alignment, bool by_malloc>
int eigen_layout() {
  return alignment;
}
template int eigen_layout<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED != 0>();

namespace {

// The lower one of the two middle values; 0 of none.
double lower_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool is_incomplete(const Points& points, Eigen::Index a) { return points.col(a).array().isNaN().any(); }

std::vector<Eigen::Index> complete_columns(const Points& points) {
  std::vector<Eigen::Index> complete;
  for (Eigen::Index a = 0; a < points.cols(); ++a)
    if (!is_incomplete(points, a)) complete.push_back(a);
  return complete;
}

Points complete_points(const Points& points) { return points(Eigen::all, complete_columns(points)); }

// The axis with the largest extent of the complete points.
Eigen::Index longest_axis(const Points& complete) {
  Eigen::Index axis = 0;
  (complete.rowwise().maxCoeff() - complete.rowwise().minCoeff()).maxCoeff(&axis);
  return axis;
}

// Calls f(a, b), a < b, for all points at most `tolerance` times the diameter apart.
template <class Function>
void for_each_coincident(const Points& points, double tolerance, const Function& f) {
  const double limit = tolerance * diameter(points);
  std::vector<Eigen::Index> sorted = complete_columns(points);
  if (sorted.empty()) return;
  const Eigen::VectorXd along = points.row(longest_axis(points(Eigen::all, sorted)));
  std::sort(sorted.begin(), sorted.end(), [&](Eigen::Index a, Eigen::Index b) { return along[a] < along[b]; });
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    for (std::size_t j = i + 1; j < sorted.size() && along[sorted[j]] - along[sorted[i]] <= limit; ++j) {
      if (!((points.col(sorted[i]) - points.col(sorted[j])).norm() <= limit)) continue;
      const auto [a, b] = std::minmax({static_cast<int>(sorted[i]), static_cast<int>(sorted[j])});
      f(a, b);
    }
  }
}

}  // namespace

std::string Landmarks::describe(int index) const {
  const auto i = static_cast<std::size_t>(index);
  if (i < labels.size() && !labels[i].empty()) return quoted_line(labels[i]);
  return std::to_string(number(index));
}

std::vector<std::vector<int>> landmarks_by_group(const Landmarks& shape) {
  std::vector<std::vector<int>> members;
  std::map<std::string, std::size_t> place;
  for (int a = 0; a < shape.count(); ++a) {
    const std::string group = shape.groups.empty() ? std::string() : shape.groups[static_cast<std::size_t>(a)];
    const auto [it, is_new] = place.try_emplace(group, members.size());
    if (is_new) members.emplace_back();
    members[it->second].push_back(a);
  }
  return members;
}

std::vector<int> missing_landmarks(const Landmarks& shape) {
  const std::vector<int> incomplete = incomplete_points(shape.points);
  std::vector<int> missing;
  std::set_difference(incomplete.begin(), incomplete.end(), shape.absent.begin(), shape.absent.end(),
                      std::back_inserter(missing));
  return missing;
}

std::vector<int> incomplete_points(const Points& points) {
  std::vector<int> incomplete;
  for (Eigen::Index a = 0; a < points.cols(); ++a)
    if (is_incomplete(points, a)) incomplete.push_back(static_cast<int>(a));
  return incomplete;
}

double diameter(const Points& points) {
  const Points complete = complete_points(points);
  double largest = 0;
  for (Eigen::Index b = 1; b < complete.cols(); ++b)
    largest = std::max(largest, (complete.leftCols(b).colwise() - complete.col(b)).colwise().squaredNorm().maxCoeff());
  return std::sqrt(largest);
}

double median_distance(const Points& points) {
  const Points complete = complete_points(points);
  std::vector<double> distances;
  distances.reserve(static_cast<std::size_t>(complete.cols() * (complete.cols() - 1) / 2));
  for (Eigen::Index b = 1; b < complete.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a) distances.push_back((complete.col(a) - complete.col(b)).norm());
  return lower_median(std::move(distances));
}

double median_nearest_distance(const Points& points) {
  const Points complete = complete_points(points);
  std::vector<double> nearest;
  for (Eigen::Index b = 0; b < complete.cols() && complete.cols() > 1; ++b) {
    Eigen::VectorXd distances = (complete.colwise() - complete.col(b)).colwise().norm();
    distances[b] = std::numeric_limits<double>::infinity();
    nearest.push_back(distances.minCoeff());
  }
  return lower_median(std::move(nearest));
}

std::optional<std::pair<int, int>> find_coincident(const Points& points, double tolerance) {
  std::optional<std::pair<int, int>> first;  // by its later landmark, then by the earlier one
  for_each_coincident(points, tolerance, [&](int a, int b) {
    if (!first || std::pair(b, a) < std::pair(first->second, first->first)) first = {a, b};
  });
  return first;
}

std::vector<std::pair<int, int>> coincident_pairs(const Points& points, double tolerance) {
  std::vector<std::pair<int, int>> pairs;
  for_each_coincident(points, tolerance, [&](int a, int b) { pairs.emplace_back(a, b); });
  return pairs;
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> bounding_box(const Points& points) {
  const Points complete = complete_points(points);
  if (complete.cols() == 0) {
    const Eigen::VectorXd none = Eigen::VectorXd::Constant(points.rows(), std::numeric_limits<double>::quiet_NaN());
    return {none, none};
  }
  return {complete.rowwise().minCoeff(), complete.rowwise().maxCoeff()};
}

}  // namespace pulson
