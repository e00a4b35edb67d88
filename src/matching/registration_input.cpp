#include "registration_input.hpp"

#include <cmath>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/label_pairing.hpp"

namespace pulson {
namespace {

// Squares and their inverses must stay in the range of numbers.
constexpr double kLargestCoordinate = 1e100;
constexpr double kSmallestSize = 1e-100;

bool is_missing(const Landmarks& shape, int a) { return shape.points.col(a).array().isNaN().any(); }

Landmarks chosen(const Landmarks& shape, const std::vector<int>& landmarks) {
  Landmarks part = shape;
  part.points = shape.points(Eigen::all, landmarks);
  part.labels.clear();
  part.groups.clear();
  part.numbers.clear();
  for (const int a : landmarks) {
    part.numbers.push_back(shape.number(a));
    const auto i = static_cast<std::size_t>(a);
    if (!shape.labels.empty()) part.labels.push_back(shape.labels[i]);
    if (!shape.groups.empty()) part.groups.push_back(shape.groups[i]);
  }
  return part;
}

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

void check_together(const Landmarks& source, const Landmarks& target, DataKind kind) {
  if (source.dimension() != target.dimension())
    throw InputError(fmt::format("the shapes have different dimensions: {} is {}D, {} is {}D", source.source,
                                 source.dimension(), target.source, target.dimension()));
  if (kind == DataKind::kLandmarks && source.count() != target.count())
    throw InputError(
        fmt::format("the shapes have different numbers of landmarks: {} has {}, {} has {}{}", source.source,
                    source.count(), target.source, target.count(),
                    source.dimension() > 1
                        ? "; landmarks need the same ones in both (outlines without correspondence: --data varifold)"
                        : ""));
}

void check_distinct(const Landmarks& source) {
  const auto pair = find_coincident(source.points);
  if (!pair) return;
  const std::string hint = pair->first == 0 && pair->second == source.count() - 1
                               ? "a closed outline needs its first point only once: remove the last"
                               : "remove or move one of them, in the target too";
  throw InputError(fmt::format("{}: landmarks {} and {} are at the same place, so the kernel matrix is singular; {}",
                               source.source, source.describe(pair->first), source.describe(pair->second), hint));
}

std::string listed(const Landmarks& shape, const std::vector<int>& landmarks) {
  std::string text;
  for (std::size_t i = 0; i < landmarks.size() && i < 5; ++i)
    text += (i > 0 ? ", " : "") + shape.describe(landmarks[i]);
  return landmarks.size() > 5 ? text + ", …" : text;
}

// Those left out of the source, and its others.
void leave_out_missing(MatchingShapes& shapes) {
  std::vector<int> present, missing;
  for (int a = 0; a < shapes.source.count(); ++a) (is_missing(shapes.source, a) ? missing : present).push_back(a);
  if (missing.empty()) return;
  shapes.notes.push_back(fmt::format("{}: {} of {} landmarks miss a coordinate and are left out: {}",
                                     shapes.source.source, missing.size(), shapes.source.count(),
                                     listed(shapes.source, missing)));
  shapes.source = chosen(shapes.source, present);
  if (shapes.data.kind != DataKind::kLandmarks) return;
  shapes.target = chosen(shapes.target, present);
  if (shapes.data.weights.size() > 0) shapes.data.weights = Eigen::VectorXd(shapes.data.weights(present));
  std::vector<Eigen::MatrixXd> covariances;
  for (const int a : present)
    if (!shapes.data.covariances.empty()) covariances.push_back(shapes.data.covariances[static_cast<std::size_t>(a)]);
  shapes.data.covariances = std::move(covariances);
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
  MatchingShapes shapes{source, target, data, {}};
  for (const Landmarks* shape : {&source, &target}) check_coordinates(*shape);
  check_together(source, target, data.kind);
  check_sizes(source, data);
  for (const Landmarks* shape : {&source, &target}) check_range(*shape);
  if (data.kind == DataKind::kLandmarks) shapes.target = paired_by_labels(source, target, shapes.notes);
  leave_out_missing(shapes);
  check_observed(shapes);
  check_distinct(shapes.source);
  return shapes;
}

}  // namespace pulson
