#include "pulson/core/landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace pulson {
namespace {

// The lower one of the two middle values; 0 of none.
double lower_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::string Landmarks::describe(int index) const {
  const auto i = static_cast<std::size_t>(index);
  if (i < labels.size() && !labels[i].empty()) return "'" + labels[i] + "'";
  return std::to_string(index + 1);
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

double diameter(const Points& points) {
  double largest = 0;
  for (Eigen::Index b = 1; b < points.cols(); ++b)
    largest = std::max(largest, (points.leftCols(b).colwise() - points.col(b)).colwise().squaredNorm().maxCoeff());
  return std::sqrt(largest);
}

double median_distance(const Points& points) {
  std::vector<double> distances;
  for (Eigen::Index b = 1; b < points.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a) distances.push_back((points.col(a) - points.col(b)).norm());
  return lower_median(std::move(distances));
}

double median_nearest_distance(const Points& points) {
  std::vector<double> nearest;
  for (Eigen::Index b = 0; b < points.cols() && points.cols() > 1; ++b) {
    Eigen::VectorXd distances = (points.colwise() - points.col(b)).colwise().norm();
    distances[b] = std::numeric_limits<double>::infinity();
    nearest.push_back(distances.minCoeff());
  }
  return lower_median(std::move(nearest));
}

std::optional<std::pair<int, int>> find_coincident(const Points& points, double tolerance) {
  const double limit = tolerance * diameter(points);
  for (Eigen::Index b = 1; b < points.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a)
      if ((points.col(a) - points.col(b)).norm() <= limit) return std::pair(static_cast<int>(a), static_cast<int>(b));
  return std::nullopt;
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> bounding_box(const Points& points) {
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

}  // namespace pulson
