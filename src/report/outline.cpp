#include "outline.hpp"

#include <algorithm>
#include <cmath>

#include "pulson/report/registration_picture.hpp"

namespace pulson {
namespace {

constexpr Eigen::Index kFewestPoints = 12;
constexpr double kLargestGap = 3;   // in median gaps
constexpr double kLargestStep = 2;  // median gap in median distances to the nearest point
constexpr double kDenseGap = 7;     // pixels between neighbours, below which marks would run into one another

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<double> gaps_of(const Points& points) {
  std::vector<double> gaps(static_cast<std::size_t>(points.cols() - 1));
  for (Eigen::Index i = 0; i + 1 < points.cols(); ++i) gaps[i] = (points.col(i + 1) - points.col(i)).norm();
  return gaps;
}

}  // namespace

OutlineKind outline_kind(const Points& points) {
  const Eigen::Index n = points.cols();
  if (points.rows() < 2 || n < kFewestPoints) return OutlineKind::kNone;
  std::vector<double> gaps = gaps_of(points);
  const double largest = *std::max_element(gaps.begin(), gaps.end());
  const double typical = median(std::move(gaps));
  if (!(typical > 0) || largest > kLargestGap * typical) return OutlineKind::kNone;
  if (typical > kLargestStep * median_nearest_distance(points)) return OutlineKind::kNone;
  const bool closes = (points.col(n - 1) - points.col(0)).norm() <= kLargestGap * typical;
  return closes ? OutlineKind::kClosed : OutlineKind::kOpen;
}

namespace picture {

Figure plan_figure(const Landmarks& shape, double scale) {
  Figure figure{};
  for (const std::vector<int>& members : landmarks_by_group(shape)) {
    const Points points = shape.points(Eigen::all, members);
    const OutlineKind kind = outline_kind(points);
    std::size_t stride = 1;
    if (kind != OutlineKind::kNone) {
      const double gap = scale * median(gaps_of(points));
      if (gap < kDenseGap) stride = static_cast<std::size_t>(std::ceil(kDenseGap / gap));
      figure.outlines.push_back({members, stride > 1});
      if (kind == OutlineKind::kClosed) figure.outlines.back().members.push_back(members.front());
    }
    if (stride == 1) figure.marked.insert(figure.marked.end(), members.begin(), members.end());
    for (std::size_t i = 0; i < members.size(); i += stride) figure.with_path.push_back(members[i]);
  }
  figure.spacing = std::numeric_limits<double>::infinity();
  if (figure.marked.size() > 1)
    figure.spacing = scale * median_nearest_distance(shape.points(Eigen::all, figure.marked));
  return figure;
}

std::vector<Points> trace(const Figure& figure, bool dense, const Points& points) {
  std::vector<Points> lines;
  for (const Outline& outline : figure.outlines)
    if (outline.dense == dense) lines.emplace_back(points(Eigen::all, outline.members));
  return lines;
}

}  // namespace picture
}  // namespace pulson
