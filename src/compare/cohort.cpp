#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostRounds = 100;
constexpr double kRest = 1e-10;  // change of the mean, of its size

void check_alike(const Landmarks& first, const Landmarks& other) {
  if (first.count() == other.count() && first.dimension() == other.dimension()) return;
  throw InputError(
      fmt::format("{} has {} landmarks in {}D, {} has {} in {}D; all shapes of a cohort must agree in both",
                  first.source, first.count(), first.dimension(), other.source, other.count(), other.dimension()));
}

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

Cohort make_cohort(const Landmarks& source, const std::vector<Landmarks>& targets, AlignmentKind alignment) {
  if (targets.empty()) throw InputError("there is no target; a comparison needs at least one");
  if (!incomplete_points(source.points).empty())
    throw InputError(
        fmt::format("{}: landmark {} has a missing coordinate; the shape that the others are compared with "
                    "must be complete",
                    source.source, source.describe(incomplete_points(source.points).front())));
  Cohort cohort{source, targets, alignment};
  for (Landmarks& target : cohort.targets) {
    check_alike(source, target);
    if (alignment != AlignmentKind::kNone)
      target.points = align(target.points, source.points, alignment).apply(target.points);
  }
  return cohort;
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
    check_alike(shapes.front(), shape);
    size += centroid_size(shape.points) / static_cast<double>(shapes.size());
    moved.push_back(shape.points);
  }
  if (kind == AlignmentKind::kNone) {
    mean.points = mean_of(moved, mean);
    return mean;
  }
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

namespace {

using Pair = std::pair<int, int>;

// The first shape that has the two landmarks apart.
const Landmarks* find_apart(const std::vector<Landmarks>& shapes, const Pair& pair) {
  const auto found = std::find_if(shapes.begin(), shapes.end(), [&](const Landmarks& shape) {
    return !is_repeated(shape.points, pair.first, pair.second);
  });
  return found == shapes.end() ? nullptr : &*found;
}

// A pair that no shape has apart, and one shape has at one place.
std::optional<Pair> coincident_in_all(const std::vector<Landmarks>& shapes) {
  for (const Landmarks& shape : shapes)
    for (const Pair& pair : coincident_pairs(shape.points))
      if (find_apart(shapes, pair) == nullptr) return pair;
  return std::nullopt;
}

void merge_into_first(CohortShapes& shapes, const Pair& pair, std::vector<double>& weights) {
  const auto [first, second] = pair;
  double& weight = weights[static_cast<std::size_t>(first)];
  const double added = weights[static_cast<std::size_t>(second)];
  const auto one = [&](const Landmarks& shape) { return merged(shape, first, second, {weight, added}); };
  if (shapes.source) shapes.source = one(*shapes.source);
  std::transform(shapes.targets.begin(), shapes.targets.end(), shapes.targets.begin(), one);
  weight += added;
  weights.erase(weights.begin() + second);
}

}  // namespace

Cohort CohortShapes::cohort(const std::vector<int>& chosen) const {
  std::vector<Landmarks> some;
  for (const int s : chosen) some.push_back(targets[static_cast<std::size_t>(s)]);
  const std::vector<Landmarks>& shapes = chosen.empty() ? targets : some;
  return make_cohort(source ? *source : procrustes_mean(shapes, alignment), shapes, alignment);
}

void merge_coincident(CohortShapes& shapes, bool merge, std::vector<std::string>& notes) {
  const Landmarks& first = shapes.source ? *shapes.source : shapes.targets.front();
  std::vector<double> weights(static_cast<std::size_t>(first.count()), 1);  // landmarks that each stands for
  while (const auto pair = shapes.source ? find_coincident(first.points) : coincident_in_all(shapes.targets)) {
    const Landmarks* apart = find_apart(shapes.targets, *pair);
    if (apart != nullptr && !merge) throw InputError(coincident_error(first, pair->first, pair->second, *apart));
    notes.push_back(merged_note(first, pair->first, pair->second, apart == nullptr ? "in all shapes" : ""));
    merge_into_first(shapes, *pair, weights);
  }
}

}  // namespace pulson
