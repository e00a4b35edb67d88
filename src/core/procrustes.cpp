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

Points mean_of(const std::vector<Points>& shapes, const Landmarks& first) {
  Points sum = Points::Zero(shapes.front().rows(), shapes.front().cols());
  VectorXd counts = VectorXd::Zero(sum.cols());
  for (const Points& shape : shapes)
    for (Index a = 0; a < sum.cols(); ++a)
      if (shape.col(a).allFinite()) {
        sum.col(a) += shape.col(a);
        counts[a] += 1;
      }
  for (Index a = 0; a < sum.cols(); ++a)
    if (counts[a] == 0)
      throw InputError(fmt::format("landmark {} is missing in every shape", first.describe(static_cast<int>(a))));
  return (sum.array().rowwise() / counts.transpose().array()).matrix();
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
  if (kind == AlignmentKind::kNone) {
    mean.points = mean_of(moved, mean);
    return mean;
  }
  for (const Landmarks& shape : shapes) require_determined(shape.points, shape.points, kind, shape.source);
  // The first shape may miss landmarks, which the mean then takes from the others.
  for (int round = 0; round < kMostRounds; ++round) {
    for (std::size_t s = 0; s < shapes.size(); ++s)
      moved[s] = align(shapes[s].points, mean.points, kind).apply(shapes[s].points);
    Points next = mean_of(moved, mean);
    if (kind == AlignmentKind::kSimilarity) {
      const VectorXd middle = next.rowwise().mean();
      next = ((next.colwise() - middle) * (size / centroid_size(next))).colwise() + middle;
    }
    const double change = round == 0 ? 1 : (next - mean.points).norm() / next.norm();
    mean.points = std::move(next);
    if (change < kRest) break;
  }
  const AlignmentKind back = kind == AlignmentKind::kTranslation ? kind : AlignmentKind::kRigid;
  mean.points = align(mean.points, shapes.front().points, back).apply(mean.points);
  return mean;
}

}  // namespace pulson
