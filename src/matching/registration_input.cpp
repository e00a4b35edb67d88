#include "registration_input.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "core/landmark_range.hpp"
#include "core/shape_frames.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::matching {
namespace {

bool is_missing(const Landmarks& shape, int a) { return shape.points.col(a).array().isNaN().any(); }

void check_coordinates(const Landmarks& shape) {
  if (shape.count() == 0) throw InputError(fmt::format("{}: the shape has no landmarks", shape.source));
  if (shape.dimension() < 1 || shape.dimension() > 3)
    throw InputError(
        fmt::format("{}: landmarks in {} dimensions; 1, 2 or 3 are supported", shape.source, shape.dimension()));
  const auto check_list = [&](const char* what, std::size_t size) {
    if (size != 0 && size != static_cast<std::size_t>(shape.count()))
      throw InputError(fmt::format("{}: there are {} {} for {} landmarks", shape.source, size, what, shape.count()));
  };
  check_list("labels", shape.labels.size());
  check_list("groups", shape.groups.size());
  check_list("numbers", shape.numbers.size());
  for (int a = 0; a < shape.count(); ++a)
    if (shape.points.col(a).array().isInf().any())
      throw InputError(
          fmt::format("{}: landmark {} has a coordinate that is not a finite number", shape.source, shape.describe(a)));
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

LandmarkPairs pairs_of(MatchingShapes& shapes) {
  try {
    return pair_landmarks(shapes.source, shapes.target, shapes.notes,
                          shapes.data.by_order ? PairBy::kOrder : PairBy::kNames);
  } catch (const InputError& error) {
    if (shapes.source.dimension() == 1) throw;
    throw InputError(fmt::format("{} (outlines without correspondence: `data.kind = varifold`)", error.what()));
  }
}

void select_pairs(MatchingShapes& shapes) {
  const LandmarkPairs pairs = pairs_of(shapes);
  if (std::ssize(pairs.first) < shapes.source.count()) {
    shapes.source = selected(shapes.source, pairs.first);
    select_data(shapes.data, pairs.first);
  }
  const bool in_order = std::is_sorted(pairs.other.begin(), pairs.other.end());
  if (std::ssize(pairs.other) < shapes.target.count() || !in_order)
    shapes.target = selected(shapes.target, pairs.other);
}

// What either specimen does not have corresponds to nothing in the other.
void leave_out_absent(MatchingShapes& shapes) {
  const bool correspond = shapes.data.kind == DataKind::kLandmarks;
  const auto without = [&](Landmarks& shape, const std::vector<int>& absent) {
    std::vector<int> present;
    for (int a = 0; a < shape.count(); ++a)
      if (!std::binary_search(absent.begin(), absent.end(), a)) present.push_back(a);
    shape = selected(shape, present);
    return present;
  };
  const auto note = [&](const Landmarks& shape) {
    if (shape.absent.empty()) return;
    shapes.notes.push_back(fmt::format("{} does not have {}, which {} left out of both shapes: {}", shape.source,
                                       text::counted(shape.absent.size(), "landmark"),
                                       shape.absent.size() == 1 ? "is" : "are", listed(shape, shape.absent)));
  };
  std::vector<int> absent = shapes.source.absent;
  if (correspond) {
    absent.clear();
    std::set_union(shapes.source.absent.begin(), shapes.source.absent.end(), shapes.target.absent.begin(),
                   shapes.target.absent.end(), std::back_inserter(absent));
  }
  if (absent.empty() && shapes.target.absent.empty()) return;
  note(shapes.source);
  note(shapes.target);
  without(shapes.target, correspond ? absent : std::vector<int>(shapes.target.absent));
  select_data(shapes.data, without(shapes.source, absent));
  if (shapes.source.count() == 0)
    throw InputError(fmt::format("{} and {}: no landmark is left that both specimens have", shapes.source.source,
                                 shapes.target.source));
}

// Those left out of the source, and its others.
void leave_out_missing(MatchingShapes& shapes) {
  std::vector<int> present, missing;
  for (int a = 0; a < shapes.source.count(); ++a) (is_missing(shapes.source, a) ? missing : present).push_back(a);
  if (missing.empty()) return;
  shapes.notes.push_back(fmt::format("{}: {} of {} landmarks have a missing coordinate and are left out: {}",
                                     shapes.source.source, missing.size(), shapes.source.count(),
                                     listed(shapes.source, missing)));
  shapes.source = selected(shapes.source, present);
  if (shapes.data.kind != DataKind::kLandmarks) return;
  shapes.target = selected(shapes.target, present);
  select_data(shapes.data, present);
}

// Edges of the landmarks that remain, without those between the two.
void join_at_first(std::vector<std::pair<int, int>>& edges, int first, int second) {
  const auto remaining = [&](int a) { return a == second ? first : a > second ? a - 1 : a; };
  for (auto& [a, b] : edges) {
    a = remaining(a);
    b = remaining(b);
  }
  std::erase_if(edges, [](const auto& edge) { return edge.first == edge.second; });
}

// Two landmarks as one: the first, with the data of both. @param weight of each landmark in the mean of both targets
void merge_into_first(MatchingShapes& shapes, int first, int second, Eigen::VectorXd& weight) {
  std::vector<int> others;
  for (int a = 0; a < shapes.source.count(); ++a)
    if (a != second) others.push_back(a);
  shapes.source = selected(shapes.source, others);
  if (shapes.data.kind != DataKind::kLandmarks) {
    join_at_first(shapes.source_edges, first, second);
    return;
  }
  shapes.target = merged(shapes.target, first, second, {weight[first], weight[second]});
  weight[first] += weight[second];
  weight = Eigen::VectorXd(weight(others));
  if (shapes.data.weights.size() > 0) shapes.data.weights[first] += shapes.data.weights[second];
  select_data(shapes.data, others);
}

// A closed outline repeats its first point at its end, lines meet, and some landmarks have two names; other landmarks
// that are at one place no flow parts, but noise may.
void merge_coincident(MatchingShapes& shapes,
                      const std::function<bool(const Landmarks& source, int, int)>& may_separate) {
  const bool curves = shapes.data.kind != DataKind::kLandmarks;
  Eigen::VectorXd weight = shapes.data.weights;
  if (weight.size() == 0) weight.setOnes(shapes.source.count());
  while (const auto pair = find_coincident(shapes.source.points)) {
    const auto [first, second] = *pair;
    const bool in_both = !curves && is_repeated(shapes.target.points, first, second);
    const bool refused = !curves && !in_both && !shapes.data.merge_coincident;
    if (refused && may_separate && may_separate(shapes.source, first, second)) return;
    if (refused) throw InputError(coincident_error(shapes.source, first, second, shapes.target));
    shapes.notes.push_back(merged_note(shapes.source, first, second, in_both ? "in both shapes" : ""));
    merge_into_first(shapes, first, second, weight);
  }
}

void check_observed(MatchingShapes& shapes) {
  std::vector<int> missing;
  for (int a = 0; a < shapes.target.count(); ++a)
    if (is_missing(shapes.target, a)) missing.push_back(a);
  if (missing.empty()) return;
  if (shapes.data.kind != DataKind::kLandmarks)
    throw InputError(fmt::format("{}: landmark {} has a missing coordinate; a curve needs all", shapes.target.source,
                                 shapes.target.describe(missing.front())));
  shapes.notes.push_back(
      fmt::format("{}: {} of {} landmarks have a missing coordinate, which drops out of the data: {}",
                  shapes.target.source, missing.size(), shapes.target.count(), listed(shapes.target, missing)));
}

void check_sizes(const Landmarks& source, const DataOptions& data) {
  const auto count = static_cast<std::size_t>(source.count());
  if (data.weights.size() > 0 && static_cast<std::size_t>(data.weights.size()) != count)
    throw InputError(fmt::format("there are {} weights for {} landmarks", data.weights.size(), count));
  if (!data.covariances.empty() && data.covariances.size() != count)
    throw InputError(fmt::format("there are {} covariances for {} landmarks", data.covariances.size(), count));
  if (data.kind != DataKind::kLandmarks && (data.weights.size() > 0 || !data.covariances.empty()))
    throw InputError("weights and covariances are for `data.kind = landmarks`: curves have no corresponding points");
}

}  // namespace

MatchingShapes matching_shapes(const Landmarks& source, const Landmarks& target, const DataOptions& data,
                               const std::function<bool(const Landmarks& source, int, int)>& may_separate) {
  for (const Landmarks* shape : {&source, &target}) check_coordinates(*shape);
  check_together(source, target);
  check_sizes(source, data);
  for (const Landmarks* shape : {&source, &target}) require_usable_range(*shape);
  MatchingShapes shapes{source, target, data, {}};
  shapes.source = in_frame_of(target, source, shapes.notes);
  if (data.kind == DataKind::kLandmarks) select_pairs(shapes);
  leave_out_absent(shapes);
  leave_out_missing(shapes);
  if (data.kind != DataKind::kLandmarks) shapes.source_edges = make_curve(shapes.source, data.ends).edges;
  merge_coincident(shapes, may_separate);
  check_observed(shapes);
  return shapes;
}

}  // namespace pulson::matching
