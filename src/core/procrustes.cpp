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
      throw InputError(fmt::format("landmark {} is missing in every shape: leave it out", shapes.front().describe(a)));
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
  std::vector<int> known;
  for (Index a = 0; a < points.cols(); ++a)
    if (points.col(a).allFinite()) known.push_back(static_cast<int>(a));
  const Points all = points(Eigen::all, known);
  const VectorXd middle = all.rowwise().mean();
  return ((points.colwise() - middle) * (size / centroid_size(points))).colwise() + middle;
}

struct MeanStart {
  Points points;
  std::vector<int> as_given;  // landmarks whose place beside the others is that of one shape's coordinates
};

// The most complete shape; and where others have too few landmarks in common with those that can be aligned with it,
// one after the other, the landmarks of the most complete one of them as its file has them.
MeanStart start_of(const std::vector<Landmarks>& shapes, AlignmentKind kind) {
  MeanStart start{most_complete(shapes).points, {}};
  Points reached = start.points;  // finite where a landmark is in a shape that can be aligned
  std::vector<Landmarks> waiting = shapes;
  while (!waiting.empty()) {
    const auto joined = std::partition(waiting.begin(), waiting.end(),
                                       [&](const Landmarks& shape) { return !may_align(shape.points, reached, kind); });
    const bool is_stuck = joined == waiting.end();
    const Points& apart = most_complete(waiting).points;
    for (Index a = 0; is_stuck && a < reached.cols(); ++a)
      if (!reached.col(a).allFinite() && apart.col(a).allFinite()) {
        start.points.col(a) = reached.col(a) = apart.col(a);
        start.as_given.push_back(static_cast<int>(a));
      }
    for (auto shape = joined; shape != waiting.end(); ++shape)
      for (Index a = 0; a < reached.cols(); ++a)
        if (!reached.col(a).allFinite()) reached.col(a) = shape->points.col(a);
    waiting.erase(joined, waiting.end());
  }
  return start;
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

std::vector<int> placed_as_given(const std::vector<Landmarks>& shapes, AlignmentKind kind) {
  return kind == AlignmentKind::kNone ? std::vector<int>{} : start_of(shapes, kind).as_given;
}

Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind) {
  const SerialBlas serial;
  if (shapes.empty()) throw InputError("there are no shapes to take the mean of");
  if (kind == AlignmentKind::kAffine)
    throw InputError("a mean under affine alignment would shrink to a point; use similarity");
  Landmarks mean = shapes.front();
  mean.name = "mean";
  mean.absent.clear();
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
  mean.points = start_of(shapes, kind).points;
  std::size_t placed = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<Points> now;
    for (const Landmarks& shape : shapes)
      if (may_align(shape.points, mean.points, kind))
        now.push_back(align(shape.points, mean.points, kind).apply(shape.points));
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
