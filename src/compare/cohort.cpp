#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "core/determined.hpp"
#include "core/landmark_pairs.hpp"
#include "core/landmark_range.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {

Cohort make_cohort(const Landmarks& source, const std::vector<Landmarks>& targets, AlignmentKind alignment,
                   std::vector<Eigen::VectorXd> weights) {
  if (targets.empty()) throw InputError("there is no target; a comparison needs at least one");
  if (!incomplete_points(source.points).empty())
    throw InputError(
        fmt::format("{}: landmark {} has a missing coordinate; the shape that the others are compared with "
                    "must be complete",
                    source.source, source.describe(incomplete_points(source.points).front())));
  require_usable_range(source);
  Cohort cohort{source, targets, alignment, std::move(weights)};
  for (std::size_t i = 0; i < targets.size(); ++i) {
    Landmarks& target = cohort.targets[i];
    const Eigen::VectorXd of_target = cohort.weights_of(i);
    require_alike(source, target);
    require_usable_range(target);
    require_determined(source.points, target.points, alignment, target.source, of_target);
    if (alignment != AlignmentKind::kNone)
      target.points = align(target.points, source.points, alignment, {.weights = of_target}).apply(target.points);
  }
  return cohort;
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
  const auto of = [&](const std::vector<Landmarks>& shapes, std::vector<Eigen::VectorXd> of_shapes) {
    Cohort cohort =
        make_cohort(source ? *source : procrustes_mean(shapes, alignment), shapes, alignment, std::move(of_shapes));
    cohort.about_own_mean = !source;
    return cohort;
  };
  if (chosen.empty()) return of(targets, weights);
  std::vector<Landmarks> some;
  std::vector<Eigen::VectorXd> of_some;
  for (const int s : chosen) {
    some.push_back(targets[static_cast<std::size_t>(s)]);
    if (!weights.empty()) of_some.push_back(weights[static_cast<std::size_t>(s)]);
  }
  return of(some, std::move(of_some));
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

}  // namespace pulson::compare
