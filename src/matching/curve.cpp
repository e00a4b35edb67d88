#include <algorithm>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {
namespace {

using Joined = std::vector<std::pair<int, int>>;

constexpr EnumNames<CurveEnds, 3> kEndsNames = {
    "ends", {{{"auto", CurveEnds::kAuto}, {"closed", CurveEnds::kClosed}, {"open", CurveEnds::kOpen}}}};

constexpr double kLargestGap = 2;   // of an outline that is closed, in median lengths of its other edges
constexpr double kWidthPart = 0.1;  // of the diameter
constexpr double kFewestEdgesPerWidth = 2;

// The lower one of the two middle values; 0 of no edges.
double median_length(const Points& points, const Joined& joined) {
  if (joined.empty()) return 0;
  std::vector<double> lengths;
  lengths.reserve(joined.size());
  for (const auto& [a, b] : joined) lengths.push_back((points.col(b) - points.col(a)).norm());
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>((lengths.size() - 1) / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

bool is_closed(const Points& points, const std::vector<int>& group, const Joined& others, CurveEnds ends) {
  if (group.size() < 3 || ends == CurveEnds::kOpen) return false;
  if (ends == CurveEnds::kClosed) return true;
  const double gap = (points.col(group.front()) - points.col(group.back())).norm();
  return gap <= kLargestGap * median_length(points, others);
}

}  // namespace

CurveEnds parse_curve_ends(std::string_view name) { return kEndsNames.parse(name); }

std::string curve_ends_name(CurveEnds ends) { return kEndsNames.name(ends); }

Curve make_curve(const Landmarks& shape, CurveEnds ends) {
  if (shape.dimension() < 2)
    throw InputError(
        fmt::format("{}: curves need the plane or space; the shape is {}D", shape.source, shape.dimension()));
  if (shape.count() == 0) throw InputError(fmt::format("{}: the shape has no landmarks", shape.source));
  Curve curve{shape.points, {}};
  for (const std::vector<int>& group : landmarks_by_group(shape)) {
    if (group.size() < 2)
      throw InputError(fmt::format("{}: landmark {} is alone in its outline; a curve needs at least 2", shape.source,
                                   shape.describe(group.front())));
    Joined edges;
    for (std::size_t i = 1; i < group.size(); ++i) edges.emplace_back(group[i - 1], group[i]);
    if (is_closed(shape.points, group, edges, ends)) edges.emplace_back(group.back(), group.front());
    curve.edges.insert(curve.edges.end(), edges.begin(), edges.end());
  }
  return curve;
}

double automatic_data_width(const Curve& target) {
  return std::max(kWidthPart * diameter(target.points),
                  kFewestEdgesPerWidth * median_length(target.points, target.edges));
}

}  // namespace pulson::matching
