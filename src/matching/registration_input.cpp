#include "registration_input.hpp"

#include <cmath>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/coordinate_frame.hpp"
#include "pulson/core/landmark_pairs.hpp"

namespace pulson {
namespace {

// Squares and their inverses must stay in the range of numbers.
constexpr double kLargestCoordinate = 1e100;
constexpr double kSmallestSize = 1e-100;

bool is_missing(const Landmarks& shape, int a) { return shape.points.col(a).array().isNaN().any(); }

void check_coordinates(const Landmarks& shape) {
  if (shape.count() == 0) throw InputError(fmt::format("{}: the shape has no landmarks", shape.source));
  if (shape.dimension() < 1 || shape.dimension() > 3)
    throw InputError(
        fmt::format("{}: landmarks in {} dimensions; 1, 2 or 3 are supported", shape.source, shape.dimension()));
  for (int a = 0; a < shape.count(); ++a)
    if (shape.points.col(a).array().isInf().any())
      throw InputError(
          fmt::format("{}: landmark {} has a coordinate that is not a finite number", shape.source, shape.describe(a)));
}

void check_range(const Landmarks& shape) {
  std::vector<int> complete;
  for (int a = 0; a < shape.count(); ++a)
    if (!is_missing(shape, a)) complete.push_back(a);
  if (complete.empty()) throw InputError(fmt::format("{}: no landmark has all its coordinates", shape.source));
  const Points points = shape.points(Eigen::all, complete);
  const double largest = points.cwiseAbs().maxCoeff();
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
  if (largest > kLargestCoordinate)
    throw InputError(fmt::format("{}: a coordinate is {}; at most {} in size is supported, change the unit",
                                 shape.source, largest, kLargestCoordinate));
  if (size > 0 && size < kSmallestSize)
    throw InputError(fmt::format("{}: the shape is {} across; at least {} is supported, change the unit", shape.source,
                                 size, kSmallestSize));
}

void check_together(const Landmarks& source, const Landmarks& target) {
  if (source.dimension() != target.dimension())
    throw InputError(fmt::format("the shapes have different dimensions: {} is {}D, {} is {}D", source.source,
                                 source.dimension(), target.source, target.dimension()));
}

// What belongs to the landmarks of the source, for these of them.
void select_data(DataOptions& data, const std::vector<int>& landmarks) {
  if (data.weights.size() > 0) data.weights = Eigen::VectorXd(data.weights(landmarks));
  std::vector<Eigen::MatrixXd> covariances;
  for (const int a : landmarks)
    if (!data.covariances.empty()) covariances.push_back(data.covariances[static_cast<std::size_t>(a)]);
  data.covariances = std::move(covariances);
}

void select_pairs(MatchingShapes& shapes) {
  const LandmarkPairs pairs = pair_landmarks(shapes.source, shapes.target, shapes.notes);
  if (std::ssize(pairs.first) < shapes.source.count()) {
    shapes.source = selected(shapes.source, pairs.first);
    select_data(shapes.data, pairs.first);
  }
  const bool in_order = std::is_sorted(pairs.other.begin(), pairs.other.end());
  if (std::ssize(pairs.other) < shapes.target.count() || !in_order) shapes.target = selected(shapes.target, pairs.other);
}

// Those left out of the source, and its others.
void leave_out_missing(MatchingShapes& shapes) {
  std::vector<int> present, missing;
  for (int a = 0; a < shapes.source.count(); ++a) (is_missing(shapes.source, a) ? missing : present).push_back(a);
  if (missing.empty()) return;
  shapes.notes.push_back(fmt::format("{}: {} of {} landmarks miss a coordinate and are left out: {}",
                                     shapes.source.source, missing.size(), shapes.source.count(),
                                     listed(shapes.source, missing)));
  shapes.source = selected(shapes.source, present);
  if (shapes.data.kind != DataKind::kLandmarks) return;
  shapes.target = selected(shapes.target, present);
  select_data(shapes.data, present);
}

bool are_one_place(const Points& points, int a, int b) {
  constexpr double kRounding = 1e-12;  // of the diameter, as in find_coincident()
  return (points.col(a) - points.col(b)).norm() <= kRounding * diameter(points);
}

// Two landmarks as one: the first, with the data of both.
void merge_into_first(MatchingShapes& shapes, int first, int second) {
  std::vector<int> others;
  for (int a = 0; a < shapes.source.count(); ++a)
    if (a != second) others.push_back(a);
  shapes.source = selected(shapes.source, others);
  if (shapes.data.kind != DataKind::kLandmarks) return;
  DataOptions& data = shapes.data;
  Points& y = shapes.target.points;
  const bool weighted = data.weights.size() > 0;
  const Eigen::Vector2d weights{weighted ? data.weights[first] : 1, weighted ? data.weights[second] : 1};
  if (y.col(first).hasNaN())
    y.col(first) = Eigen::VectorXd(y.col(second));
  else if (!y.col(second).hasNaN() && weights.sum() > 0)
    y.col(first) = (weights[0] * y.col(first) + weights[1] * y.col(second)) / weights.sum();
  if (weighted) data.weights[first] = weights.sum();
  shapes.target = selected(shapes.target, others);
  select_data(data, others);
}

// Whether one of the two says nothing that the other does not: they are one in the target, too, or neighbours of an
// outline, whose ends are.
bool is_repeated(const MatchingShapes& shapes, int first, int second) {
  if (shapes.data.kind == DataKind::kLandmarks) {
    const Points& y = shapes.target.points;
    return y.col(first).hasNaN() || y.col(second).hasNaN() || are_one_place(y, first, second);
  }
  for (const std::vector<int>& group : landmarks_by_group(shapes.source))
    for (std::size_t i = 0; i < group.size(); ++i)
      if (std::minmax(group[i], group[(i + 1) % group.size()]) == std::pair<const int&, const int&>(first, second))
        return true;
  return false;
}

// A closed outline repeats its first point at its end, and some landmarks have two names; other landmarks that are at
// one place no flow parts.
void merge_coincident(MatchingShapes& shapes) {
  while (const auto pair = find_coincident(shapes.source.points)) {
    const auto [first, second] = *pair;
    const Landmarks& source = shapes.source;
    const bool repeated = is_repeated(shapes, first, second);
    if (!repeated && !shapes.data.merge_coincident)
      throw InputError(fmt::format(
          "{}: landmarks {} and {} are at the same place, and apart in {}, where no flow can take them: take them as one "
          "by --merge-coincident, or leave one out of both files",
          source.source, source.describe(first), source.describe(second), shapes.target.source));
    const bool closes = first == 0 && second == source.count() - 1;
    shapes.notes.push_back(fmt::format("{}: landmarks {} and {} are at the same place{} and taken as one{}",
                                       source.source, source.describe(first), source.describe(second),
                                       repeated && shapes.data.kind == DataKind::kLandmarks ? " in both shapes" : "",
                                       closes ? ": a closed outline" : ""));
    merge_into_first(shapes, first, second);
  }
}

void check_observed(MatchingShapes& shapes) {
  std::vector<int> missing;
  for (int a = 0; a < shapes.target.count(); ++a)
    if (is_missing(shapes.target, a)) missing.push_back(a);
  if (missing.empty()) return;
  if (shapes.data.kind != DataKind::kLandmarks)
    throw InputError(fmt::format("{}: landmark {} misses a coordinate; a curve needs all", shapes.target.source,
                                 shapes.target.describe(missing.front())));
  shapes.notes.push_back(fmt::format("{}: {} of {} landmarks miss a coordinate, which drops out of the data: {}",
                                     shapes.target.source, missing.size(), shapes.target.count(),
                                     listed(shapes.target, missing)));
}

void check_sizes(const Landmarks& source, const DataOptions& data) {
  const auto count = static_cast<std::size_t>(source.count());
  if (data.weights.size() > 0 && static_cast<std::size_t>(data.weights.size()) != count)
    throw InputError(fmt::format("there are {} weights for {} landmarks", data.weights.size(), count));
  if (!data.covariances.empty() && data.covariances.size() != count)
    throw InputError(fmt::format("there are {} covariances for {} landmarks", data.covariances.size(), count));
  if (data.kind != DataKind::kLandmarks && (data.weights.size() > 0 || !data.covariances.empty()))
    throw InputError("weights and covariances are for --data landmarks: curves have no corresponding points");
}

}  // namespace

MatchingShapes matching_shapes(const Landmarks& source, const Landmarks& target, const DataOptions& data) {
  for (const Landmarks* shape : {&source, &target}) check_coordinates(*shape);
  check_together(source, target);
  check_sizes(source, data);
  for (const Landmarks* shape : {&source, &target}) check_range(*shape);
  MatchingShapes shapes{source, target, data, {}};
  shapes.source = in_frame_of(target, source, shapes.notes);
  if (data.kind == DataKind::kLandmarks) select_pairs(shapes);
  leave_out_missing(shapes);
  merge_coincident(shapes);
  check_observed(shapes);
  return shapes;
}

}  // namespace pulson
