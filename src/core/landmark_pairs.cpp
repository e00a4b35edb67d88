#include "core/landmark_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

namespace {

// Names pair if at least this part of the smaller shape's landmarks, and so many, have a partner.
constexpr double kLeastCommon = 0.5;
constexpr int kFewestCommon = 2;

bool are_all_equal(const std::vector<std::string>& names) {
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) { return name == names.front(); });
}

bool have_repeats(const std::vector<std::string>& names) {
  return std::set<std::string_view>(names.begin(), names.end()).size() < names.size();
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
                              left.size() == 1 ? "is" : "are", all_listed(shape, left)));
}

std::string of_kind(const Landmarks& shape) { return shape.labels.empty() ? "numbers" : "labels"; }

LandmarkPairs pairs_by_order(const Landmarks& first, const Landmarks& other, PairBy by) {
  if (first.count() != other.count())
    throw InputError(fmt::format("the shapes have different numbers of landmarks: {} has {}, {} has {}; {}",
                                 first.source, first.count(), other.source, other.count(),
                                 by == PairBy::kOrder
                                     ? "pairs by order need as many"
                                     : "nothing says which of them correspond: both need the same landmarks, or "
                                       "labels or numbers that say so"));
  std::vector<int> all(static_cast<std::size_t>(first.count()));
  std::iota(all.begin(), all.end(), 0);
  return {all, all};
}

// How to pair by order all the same, where that is possible.
std::string or_by_order(std::size_t count, std::size_t other_count) {
  return count == other_count ? "; `by_order` pairs them in the order of the files" : "";
}

// The names of both, with numbers for the one that has none.
struct BothNames {
  NameList first, other;
};

BothNames both_names(const NameList& first, int count, const NameList& other, int other_count) {
  BothNames both{first, other};
  if (both.first.names.empty()) both.first.names = numbers_for(both.other, count);
  if (both.other.names.empty()) both.other.names = numbers_for(both.first, other_count);
  if (!both.first.names.empty() && !both.other.names.empty()) return both;
  const bool first_lacks = first.names.empty();
  throw InputError(fmt::format(
      "{} names its landmarks ({}, …), {} does not, so that nothing says which correspond; name them alike in both{}",
      (first_lacks ? other : first).source, quoted_line((first_lacks ? other : first).names.front()),
      (first_lacks ? first : other).source,
      or_by_order(static_cast<std::size_t>(count), static_cast<std::size_t>(other_count))));
}

// Whether a list without names cannot be counted as the names of the other are.
bool lacks_names(const NameList& list, const NameList& other, int count) {
  return list.names.empty() && numbers_for(other, count).empty();
}

NameMatch matched(const BothNames& both, std::vector<std::string>& notes) {
  NameMatch match = match_names(both.first, both.other, NameKind::kLandmarks);
  if (!match.problem.empty())
    throw InputError(match.problem + or_by_order(both.first.names.size(), both.other.names.size()));
  if (!match.note.empty()) notes.push_back(match.note);
  return match;
}

[[noreturn]] void fail_few_partners(const Landmarks& first, const Landmarks& other, const NameMatch& match) {
  const int common = match.matched();
  throw InputError(fmt::format(
      "{} and {}: {} of the smaller shape's {} landmarks {} a partner of the same name, and at least half need one; "
      "without: {} of {}; {} of {}{}",
      first.source, other.source, common == 0 ? "none" : fmt::format("only {}", common),
      std::min(first.count(), other.count()), common == 1 ? "has" : "have", all_listed(first, match.unmatched()),
      first.source, all_listed(other, match.spare(other.count())), other.source,
      or_by_order(static_cast<std::size_t>(first.count()), static_cast<std::size_t>(other.count()))));
}

}  // namespace

std::vector<std::string> landmark_names(const Landmarks& shape) {
  std::vector<std::string> names = shape.labels;
  if (names.size() > 1 && are_all_equal(names)) return {};
  for (const int number : shape.labels.empty() ? shape.numbers : std::vector<int>{})
    names.push_back(fmt::to_string(number));
  if (shape.groups.empty() || shape.labels.empty() || !have_repeats(names)) return names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] += " of " + shape.groups[i];
  return names;
}

LandmarkPairs pair_landmarks(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes,
                             PairBy by) {
  const NameList mine{first.source, landmark_names(first)}, theirs{other.source, landmark_names(other)};
  if (by == PairBy::kOrder || mine.names == theirs.names) return pairs_by_order(first, other, by);
  if (const bool lacks = lacks_names(mine, theirs, first.count()) || lacks_names(theirs, mine, other.count());
      lacks && first.count() == other.count()) {
    notes.push_back(fmt::format("{} does not name its landmarks; they are paired with those of {} by their order",
                                (mine.names.empty() ? first : other).source,
                                (mine.names.empty() ? other : first).source));
    return pairs_by_order(first, other, by);
  }
  const BothNames both = both_names(mine, first.count(), theirs, other.count());
  const NameMatch match = matched(both, notes);
  const int smaller = std::min(first.count(), other.count());
  if (match.matched() < std::min(kFewestCommon, smaller) || match.matched() < kLeastCommon * smaller)
    fail_few_partners(first, other, match);
  LandmarkPairs pairs;
  for (std::size_t a = 0; a < match.partners.size(); ++a) {
    if (match.partners[a] < 0) continue;
    pairs.first.push_back(static_cast<int>(a));
    pairs.other.push_back(match.partners[a]);
  }
  if (!std::is_sorted(pairs.other.begin(), pairs.other.end()))
    notes.push_back(
        fmt::format("{}: its landmarks are in a different order from those of {}; they are paired by their {}",
                    other.source, first.source, of_kind(first)));
  note_left_out(first, pairs.first, other, notes);
  note_left_out(other, pairs.other, first, notes);
  return pairs;
}

std::vector<int> places_in_list(const Landmarks& shape, const NameList& list, std::size_t count, std::string_view what,
                                std::vector<std::string>& notes, PairBy by) {
  const NameList mine{shape.source, landmark_names(shape)};
  const auto landmarks = static_cast<std::size_t>(shape.count());
  if (by == PairBy::kOrder || mine.names == list.names) {
    if (count != landmarks)
      throw InputError(fmt::format("{} has {} of numbers; each of the {} landmarks needs one", list.source,
                                   text::counted(count, "row"), landmarks));
    std::vector<int> all(landmarks);
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  const NameMatch match = matched(both_names(mine, shape.count(), list, static_cast<int>(count)), notes);
  if (const std::vector<int> lonely = match.unmatched(); !lonely.empty())
    throw InputError(fmt::format("{} has no row for {} of the {} landmarks of {}, and each needs {}: {}", list.source,
                                 lonely.size(), landmarks, shape.source, what, all_listed(shape, lonely)));
  if (const std::size_t spare = count - landmarks; spare > 0)
    notes.push_back(fmt::format("{}: {} {} to no landmark and {} not used", list.source, text::counted(spare, "row"),
                                spare == 1 ? "belongs" : "belong", spare == 1 ? "is" : "are"));
  return match.partners;
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

// The places in the choice of those that are absent.
std::vector<int> absent_among(const std::vector<int>& absent, const std::vector<int>& chosen) {
  std::vector<int> places;
  for (std::size_t i = 0; i < chosen.size() && !absent.empty(); ++i)
    if (std::binary_search(absent.begin(), absent.end(), chosen[i])) places.push_back(static_cast<int>(i));
  return places;
}

}  // namespace

Landmarks selected(const Landmarks& shape, const std::vector<int>& landmarks) {
  Landmarks part = shape;
  part.points = shape.points(Eigen::all, landmarks);
  part.labels.clear();
  part.groups.clear();
  part.numbers.clear();
  part.links = links_among(shape.links, landmarks);
  part.absent = absent_among(shape.absent, landmarks);
  for (const int a : landmarks) {
    part.numbers.push_back(shape.number(a));
    const auto i = static_cast<std::size_t>(a);
    if (!shape.labels.empty()) part.labels.push_back(shape.labels[i]);
    if (!shape.groups.empty()) part.groups.push_back(shape.groups[i]);
  }
  return part;
}

Landmarks in_order_of(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes, PairBy by) {
  const LandmarkPairs pairs = pair_landmarks(first, other, notes, by);
  const bool are_whole = std::ssize(pairs.first) == first.count();
  Landmarks result = are_whole ? selected(other, pairs.other) : other;
  if (!are_whole) {
    result.points.setConstant(other.dimension(), first.count(), std::numeric_limits<double>::quiet_NaN());
    result.points(Eigen::all, pairs.first) = other.points(Eigen::all, pairs.other);
    result.groups = first.groups;
    result.absent.clear();
    for (const int i : absent_among(other.absent, pairs.other))
      result.absent.push_back(pairs.first[static_cast<std::size_t>(i)]);
  }
  result.labels = first.labels;
  result.numbers = first.numbers;
  result.links = first.links;
  return result;
}

namespace {

std::vector<std::string> described(const Landmarks& shape, const std::vector<int>& landmarks) {
  std::vector<std::string> names;
  for (const int a : landmarks) names.push_back(shape.describe(a));
  return names;
}

}  // namespace

std::string listed(const Landmarks& shape, const std::vector<int>& landmarks) {
  constexpr std::size_t kMost = 5;
  return text::first_of(described(shape, landmarks), kMost);
}

std::string all_listed(const Landmarks& shape, const std::vector<int>& landmarks) {
  return text::first_of(described(shape, landmarks), landmarks.size());
}

bool is_undigitised(const Landmarks& shape) {
  const auto missing = std::ssize(incomplete_points(shape.points));
  const bool has_one = shape.count() - missing == 1;
  return shape.count() > 1 && !has_one && diameter(shape.points) == 0;
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
  std::erase_if(result.absent, [&](int a) { return !x.col(a).hasNaN(); });
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
