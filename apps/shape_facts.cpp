#include "shape_facts.hpp"

#include <algorithm>
#include <vector>

namespace pulson {
namespace {

/// Sets of coincident landmarks are found by sorting; a tolerance, as in find_coincident, would not define sets.
void count_coincident(const Points& points, ShapeFacts& facts) {
  std::vector<int> order;
  for (int a = 0; a < points.cols(); ++a)
    if (!points.col(a).hasNaN()) order.push_back(a);
  const auto is_before = [&](int a, int b) {
    const auto place = [&](int i) { return points.col(i); };
    return std::lexicographical_compare(place(a).begin(), place(a).end(), place(b).begin(), place(b).end());
  };
  std::stable_sort(order.begin(), order.end(), is_before);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (is_before(order[i - 1], order[i])) continue;
    ++facts.coincident;
    if (!facts.first_coincident || order[i] < facts.first_coincident->second)
      facts.first_coincident = {order[i - 1], order[i]};
  }
}

bool repeats_end(const Points& points, const std::vector<int>& members) {
  return members.size() > 2 && points.col(members.front()) == points.col(members.back());
}

}  // namespace

ShapeFacts shape_facts(const Landmarks& shape) {
  ShapeFacts facts;
  facts.missing = incomplete_points(shape.points).size();
  count_coincident(shape.points, facts);
  for (const std::vector<int>& members : landmarks_by_group(shape))
    facts.repeats_end = facts.repeats_end || repeats_end(shape.points, members);
  facts.repeats_end = facts.repeats_end || (shape.count() > 2 && shape.points.leftCols(1) == shape.points.rightCols(1));
  return facts;
}

}  // namespace pulson
