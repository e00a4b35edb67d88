#include "core/landmark_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson {

namespace {

using Places = std::map<std::string, int>;

// Labels and numbers pair if at least this part of the smaller shape's, and so many, are the other's.
constexpr double kLeastCommon = 0.5;
constexpr int kFewestCommon = 2;

/// Where each label, or else number, is; none where they do not name all landmarks, each by another name.
std::optional<Places> places_of(const Landmarks& shape) {
  if (shape.labels.empty() && shape.numbers.empty()) return std::nullopt;
  Places places;
  for (int a = 0; a < shape.count(); ++a) {
    const std::string name =
        shape.labels.empty() ? fmt::to_string(shape.number(a)) : shape.labels[static_cast<std::size_t>(a)];
    if (name.empty() || !places.try_emplace(name, a).second) return std::nullopt;
  }
  return places;
}

std::vector<int> others_than(const std::vector<int>& chosen, int count) {
  std::vector<bool> is_chosen(static_cast<std::size_t>(count));
  for (const int a : chosen) is_chosen[static_cast<std::size_t>(a)] = true;
  std::vector<int> others;
  for (int a = 0; a < count; ++a)
    if (!is_chosen[static_cast<std::size_t>(a)]) others.push_back(a);
  return others;
}

void note_left_out(const Landmarks& shape, const std::vector<int>& chosen, const Landmarks& other,
                   std::vector<std::string>& notes) {
  const std::vector<int> left = others_than(chosen, shape.count());
  if (left.empty()) return;
  notes.push_back(fmt::format("{}: {} of {} landmarks {} not in {} and {} left out: {}", shape.source, left.size(),
                              shape.count(), left.size() == 1 ? "is" : "are", other.source,
                              left.size() == 1 ? "is" : "are", listed(shape, left)));
}

std::string of_kind(const Landmarks& shape) { return shape.labels.empty() ? "numbers" : "labels"; }

// @param common landmarks that have the same name in both, none where one has no names
LandmarkPairs pairs_by_order(const Landmarks& first, const Landmarks& other, std::optional<int> common) {
  if (first.count() != other.count())
    throw InputError(
        fmt::format("the shapes have different numbers of landmarks: {} has {}, {} has {}; {}{}", first.source,
                    first.count(), other.source, other.count(),
                    common ? fmt::format("{} of their {} are in both, and landmarks are paired by these only where "
                                         "half of the smaller shape's are",
                                         *common == 0 ? "none" : fmt::format("only {}", *common), of_kind(first))
                           : "both need the same landmarks, or labels or numbers that say which correspond",
                    first.dimension() > 1 ? " (outlines without correspondence: `data.kind = varifold`)" : ""));
  std::vector<int> all(static_cast<std::size_t>(first.count()));
  std::iota(all.begin(), all.end(), 0);
  return {all, all};
}

}  // namespace

LandmarkPairs pair_landmarks(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes) {
  const std::optional<Places> wanted = places_of(first), given = places_of(other);
  if (!wanted || !given) return pairs_by_order(first, other, std::nullopt);
  std::vector<std::pair<int, int>> found;
  std::string elsewhere;
  for (const auto& [name, a] : *wanted) {
    const auto place = given->find(name);
    if (place == given->end()) continue;
    found.emplace_back(a, place->second);
    if (elsewhere.empty() && place->second != a) elsewhere = first.describe(a);
  }
  const auto common = static_cast<int>(found.size());
  const int smaller = std::min(first.count(), other.count());
  if (common < std::min(kFewestCommon, smaller) || common < kLeastCommon * smaller) {
    if (!elsewhere.empty() && first.count() == other.count())
      notes.push_back(fmt::format(
          "{} and {}: the landmark {} is in different positions and most other labels differ; landmarks are "
          "paired by their "
          "order",
          first.source, other.source, elsewhere));
    return pairs_by_order(first, other, common);
  }
  std::sort(found.begin(), found.end());
  LandmarkPairs pairs;
  for (const auto& [a, b] : found) {
    pairs.first.push_back(a);
    pairs.other.push_back(b);
  }
  if (!std::is_sorted(pairs.other.begin(), pairs.other.end()))
    notes.push_back(
        fmt::format("{}: its landmarks are in a different order from those of {}; they are paired by their {}",
                    other.source, first.source, of_kind(first)));
  note_left_out(first, pairs.first, other, notes);
  note_left_out(other, pairs.other, first, notes);
  return pairs;
}

namespace {

// Those whose two landmarks are both chosen, between the places of these in the choice.
std::vector<std::pair<int, int>> links_among(const std::vector<std::pair<int, int>>& links,
                                             const std::vector<int>& chosen) {
  std::map<int, int> places;
  for (std::size_t i = 0; i < chosen.size() && !links.empty(); ++i) places.try_emplace(chosen[i], static_cast<int>(i));
  std::vector<std::pair<int, int>> among;
  for (const auto& [a, b] : links) {
    const auto from = places.find(a), to = places.find(b);
    if (from != places.end() && to != places.end()) among.emplace_back(from->second, to->second);
  }
  return among;
}

}  // namespace

Landmarks selected(const Landmarks& shape, const std::vector<int>& landmarks) {
  Landmarks part = shape;
  part.points = shape.points(Eigen::all, landmarks);
  part.labels.clear();
  part.groups.clear();
  part.numbers.clear();
  part.links = links_among(shape.links, landmarks);
  for (const int a : landmarks) {
    part.numbers.push_back(shape.number(a));
    const auto i = static_cast<std::size_t>(a);
    if (!shape.labels.empty()) part.labels.push_back(shape.labels[i]);
    if (!shape.groups.empty()) part.groups.push_back(shape.groups[i]);
  }
  return part;
}

Landmarks in_order_of(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes) {
  const LandmarkPairs pairs = pair_landmarks(first, other, notes);
  if (pairs.first.size() == pairs.other.size() && std::ssize(pairs.first) == first.count())
    return selected(other, pairs.other);
  Landmarks result = other;
  result.points.setConstant(other.dimension(), first.count(), std::numeric_limits<double>::quiet_NaN());
  result.points(Eigen::all, pairs.first) = other.points(Eigen::all, pairs.other);
  result.labels = first.labels;
  result.groups = first.groups;
  result.numbers = first.numbers;
  result.links = first.links;
  return result;
}

std::string listed(const Landmarks& shape, const std::vector<int>& landmarks) {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t i = 0; i < landmarks.size() && i < kMost; ++i)
    text += (i > 0 ? ", " : "") + shape.describe(landmarks[i]);
  return landmarks.size() > kMost ? text + ", …" : text;
}

bool is_repeated(const Points& points, int a, int b) {
  if (points.col(a).hasNaN() || points.col(b).hasNaN()) return true;
  constexpr double kRounding = 1e-12;  // of the diameter, as in find_coincident()
  return (points.col(a) - points.col(b)).norm() <= kRounding * diameter(points);
}

Landmarks merged(const Landmarks& shape, int first, int second, const Eigen::Vector2d& weights) {
  std::vector<int> others;
  for (int a = 0; a < shape.count(); ++a)
    if (a != second) others.push_back(a);
  Landmarks result = shape;
  Points& x = result.points;
  if (x.col(first).hasNaN())
    x.col(first) = Eigen::VectorXd(x.col(second));
  else if (!x.col(second).hasNaN() && weights.sum() > 0)
    x.col(first) = (weights[0] * x.col(first) + weights[1] * x.col(second)) / weights.sum();
  for (auto& [a, b] : result.links) {
    if (a == second) a = first;
    if (b == second) b = first;
  }
  std::erase_if(result.links, [](const auto& link) { return link.first == link.second; });
  return selected(result, others);
}

std::string merged_note(const Landmarks& shape, int first, int second, const std::string& shapes) {
  const bool closes = first == 0 && second == shape.count() - 1;
  return fmt::format("{}: landmarks {} and {} are at the same position{}{} and are merged{}", shape.source,
                     shape.describe(first), shape.describe(second), shapes.empty() ? "" : " ", shapes,
                     closes ? ": a closed outline" : "");
}

std::string coincident_error(const Landmarks& shape, int first, int second, const Landmarks& other) {
  return fmt::format(
      "{}: landmarks {} and {} are at the same position, but apart in {}, which no flow can reach: merge them with "
      "`merge_coincident`, or omit one from every file",
      shape.source, shape.describe(first), shape.describe(second), other.source);
}

namespace {

std::optional<double> metres(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 5> kUnits = {
      {{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}}};
  for (const auto& [name, size] : kUnits)
    if (name == unit) return size;
  return std::nullopt;
}

bool differ(const std::string& a, const std::string& b) { return !a.empty() && !b.empty() && a != b; }

}  // namespace

Landmarks in_frame_of(const Landmarks& frame, const Landmarks& shape, std::vector<std::string>& notes) {
  Landmarks result = shape;
  if (differ(frame.axes, shape.axes) && shape.dimension() >= 2) {
    change_points(result, [](Points& points) { points.topRows(2) *= -1; });
    notes.push_back(fmt::format("{}: its axes are {}, those of {} {}; converted by changing the signs of x and y",
                                shape.source, shape.axes, frame.source, frame.axes));
  }
  if (differ(frame.units, shape.units)) {
    const auto from = metres(shape.units), to = metres(frame.units);
    if (!from || !to)
      throw InputError(fmt::format("{}: its coordinates are in {}, those of {} in {}; both need the same unit",
                                   shape.source, shape.units, frame.source, frame.units));
    change_points(result, [&](Points& points) { points *= *from / *to; });
    notes.push_back(fmt::format("{}: its unit of length is {}, that of {} {}; converted", shape.source, shape.units,
                                frame.source, frame.units));
  }
  if (!frame.axes.empty()) result.axes = frame.axes;
  if (!frame.units.empty()) result.units = frame.units;
  return result;
}

Eigen::VectorXd landmark_weights(const Eigen::VectorXd& weights, Eigen::Index count) {
  if (weights.size() == 0) return Eigen::VectorXd::Ones(count);
  if (weights.size() != count)
    throw InputError(fmt::format("there are {} weights for {} landmarks", weights.size(), count));
  for (Eigen::Index a = 0; a < count; ++a)
    if (!(std::isfinite(weights[a]) && weights[a] >= 0))
      throw InputError(
          fmt::format("the weight of landmark {} is {}; it must be a finite number, 0 or greater", a + 1, weights[a]));
  return weights;
}

}  // namespace pulson
