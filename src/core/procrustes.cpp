#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/determined.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kMostRounds = 100;
constexpr double kRest = 1e-10;  // change of the mean, of its size

void require_observed(const std::vector<Landmarks>& shapes) {
  for (int a = 0; a < shapes.front().count(); ++a)
    if (std::none_of(shapes.begin(), shapes.end(),
                     [a](const Landmarks& shape) { return shape.points.col(a).allFinite(); }))
      throw InputError(fmt::format("landmark {} is missing in every shape", shapes.front().describe(a)));
}

// The first of those with the most landmarks.
const Landmarks& most_complete(const std::vector<Landmarks>& shapes) {
  return *std::min_element(shapes.begin(), shapes.end(), [](const Landmarks& a, const Landmarks& b) {
    return incomplete_points(a.points).size() < incomplete_points(b.points).size();
  });
}

// Whether enough landmarks are in both.
bool may_align(const Points& shape, const Points& mean, AlignmentKind kind) {
  const bool have_common = (shape.array().isFinite() && mean.array().isFinite()).colwise().all().any();
  return have_common && is_determined(shape, mean, kind);
}

// NaN where a landmark is in no shape.
Points mean_of(const std::vector<Points>& shapes) {
  Points sum = Points::Zero(shapes.front().rows(), shapes.front().cols());
  VectorXd counts = VectorXd::Zero(sum.cols());
  for (const Points& shape : shapes)
    for (Index a = 0; a < sum.cols(); ++a)
      if (shape.col(a).allFinite()) {
        sum.col(a) += shape.col(a);
        counts[a] += 1;
      }
  return (sum.array().rowwise() / counts.transpose().array()).matrix();
}

// About its middle, without the landmarks that it lacks so far.
Points of_size(const Points& points, double size) {
  VectorXd middle = VectorXd::Zero(points.rows());
  double count = 0;
  for (const auto& point : points.colwise())
    if (point.allFinite()) middle += point, count += 1;
  middle /= count;
  return ((points.colwise() - middle) * (size / centroid_size(points))).colwise() + middle;
}

[[noreturn]] void fail_apart(const std::vector<Landmarks>& shapes, const Points& mean, AlignmentKind kind) {
  for (const Landmarks& shape : shapes)
    if (!may_align(shape.points, mean, kind))
      throw InputError(fmt::format("{}: too few of its landmarks are in the other shapes to align it", shape.source));
  throw InputError("the shapes have too few landmarks in common to be aligned");
}

}  // namespace

void require_alike(const Landmarks& first, const Landmarks& other) {
  if (first.count() == other.count() && first.dimension() == other.dimension()) return;
  throw InputError(
      fmt::format("{} has {} landmarks in {}D, {} has {} in {}D; all shapes of a cohort must agree in both",
                  first.source, first.count(), first.dimension(), other.source, other.count(), other.dimension()));
}

double centroid_size(const Points& points) {
  VectorXd middle = VectorXd::Zero(points.rows());
  Index count = 0;
  for (const auto& point : points.colwise())
    if (point.allFinite()) {
      middle += point;
      ++count;
    }
  middle /= static_cast<double>(count);
  double sum = 0;
  for (const auto& point : points.colwise())
    if (point.allFinite()) sum += (point - middle).squaredNorm();
  return std::sqrt(sum);
}

Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind) {
  const SerialBlas serial;
  if (shapes.empty()) throw InputError("there are no shapes to take the mean of");
  if (kind == AlignmentKind::kAffine)
    throw InputError("a mean under affine alignment would shrink to a point; use similarity");
  Landmarks mean = shapes.front();
  mean.name = "mean";
  mean.source = fmt::format("mean of {} shapes", shapes.size());
  double size = 0;
  std::vector<Points> moved;
  for (const Landmarks& shape : shapes) {
    require_alike(shapes.front(), shape);
    size += centroid_size(shape.points) / static_cast<double>(shapes.size());
    moved.push_back(shape.points);
  }
  require_observed(shapes);
  if (kind == AlignmentKind::kNone) {
    mean.points = mean_of(moved);
    return mean;
  }
  for (const Landmarks& shape : shapes) require_determined(shape.points, shape.points, kind, shape.source);
  // A shape that has too few landmarks in common with those of the mean so far waits for others to add to these.
  mean.points = most_complete(shapes).points;
  std::size_t placed = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<Points> now;
    for (const Landmarks& shape : shapes)
      if (may_align(shape.points, mean.points, kind))
        now.push_back(align(shape.points, mean.points, kind).apply(shape.points));
    if (now.size() <= placed && placed < shapes.size()) fail_apart(shapes, mean.points, kind);
    Points next = mean_of(now);
    if (kind == AlignmentKind::kSimilarity) next = of_size(next, size);
    const bool is_whole = placed == shapes.size();
    placed = now.size();
    const double change = is_whole ? (next - mean.points).norm() / next.norm() : 1;
    mean.points = std::move(next);
    if (change < kRest) break;
  }
  const AlignmentKind back = kind == AlignmentKind::kTranslation ? kind : AlignmentKind::kRigid;
  mean.points = align(mean.points, shapes.front().points, back).apply(mean.points);
  return mean;
}

}  // namespace pulson
