#include "pulson/core/landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>

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

// In the order of their distance from the middle: two points are no further apart than these add up to.
double diameter(const Points& points) {
  Points complete = complete_points(points);
  if (complete.cols() < 2) return 0;
  if (!complete.allFinite()) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd middle = 0.5 * (complete.rowwise().minCoeff() + complete.rowwise().maxCoeff());
  const Eigen::VectorXd out = (complete.colwise() - middle).colwise().norm();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(out.size()));
  std::iota(order.begin(), order.end(), Eigen::Index(0));
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return out[a] > out[b]; });
  complete = Points(complete(Eigen::all, order));
  constexpr double kRounding = 1e-14;
  double largest = 0;  // squared
  for (Eigen::Index b = 1; b < complete.cols(); ++b) {
    const double reach = (1 + kRounding) * (out[order[static_cast<std::size_t>(b)]] + out[order.front()]);
    if (reach * reach < largest) break;
    largest = std::max(largest, (complete.leftCols(b).colwise() - complete.col(b)).colwise().squaredNorm().maxCoeff());
  }
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

// Along the longest axis, both ways, until points are further along it than the nearest is away.
double median_nearest_distance(const Points& points) {
  Points sorted = complete_points(points);
  const Eigen::Index count = sorted.cols();
  if (count < 2) return 0;
  const Eigen::VectorXd along = sorted.row(longest_axis(sorted));
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index(0));
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return along[a] < along[b]; });
  sorted = Points(sorted(Eigen::all, order));
  const auto axis = longest_axis(sorted);
  std::vector<double> nearest(static_cast<std::size_t>(count));
  for (Eigen::Index b = 0; b < count; ++b) {
    double least = std::numeric_limits<double>::infinity();  // squared
    const auto search = [&](Eigen::Index a, Eigen::Index step) {
      for (; a >= 0 && a < count; a += step) {
        const double apart = sorted(axis, a) - sorted(axis, b);
        if (apart * apart >= least) return;
        least = std::min(least, (sorted.col(a) - sorted.col(b)).squaredNorm());
      }
    };
    search(b + 1, 1);
    search(b - 1, -1);
    nearest[static_cast<std::size_t>(b)] = std::sqrt(least);
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
