#include "outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pulson/draw/pictures.hpp"

namespace pulson {
namespace {

constexpr Eigen::Index kFewestPoints = 12;
constexpr double kLargestGap = 3;   // in median gaps
constexpr double kLargestStep = 2;  // median gap in median distances to the nearest point
constexpr double kSharpTurn = 60;   // degrees
constexpr double kMostSharp = 6;    // of so many turns, one may be sharp
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

// Whether so many turns are sharp that the points in their order are corners and not samples of a curve.
bool is_jagged(const Points& points) {
  const double least = std::cos(kSharpTurn * std::numbers::pi / 180);
  Eigen::Index sharp = 0;
  for (Eigen::Index i = 1; i + 1 < points.cols(); ++i) {
    const Eigen::VectorXd before = points.col(i) - points.col(i - 1), after = points.col(i + 1) - points.col(i);
    if (before.dot(after) < least * before.norm() * after.norm()) ++sharp;
  }
  return kMostSharp * static_cast<double>(sharp) > static_cast<double>(points.cols() - 2);
}

double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) { return u.x() * v.y() - u.y() * v.x(); }

// Whether the open segments ab and cd cross.
bool cross_each_other(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                      const Eigen::Vector2d& d) {
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 && cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

bool crosses_itself(const Points& points) {
  for (Eigen::Index j = 2; j + 1 < points.cols(); ++j)
    for (Eigen::Index i = 0; i + 1 < j; ++i)
      if (cross_each_other(points.col(i), points.col(i + 1), points.col(j), points.col(j + 1))) return true;
  return false;
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
  if (is_jagged(points)) return OutlineKind::kNone;
  if (points.rows() == 2 && crosses_itself(points)) return OutlineKind::kNone;
  const bool closes = (points.col(n - 1) - points.col(0)).norm() <= kLargestGap * typical;
  return closes ? OutlineKind::kClosed : OutlineKind::kOpen;
}

namespace picture {

namespace {

void remove(std::vector<int>& from, const std::vector<int>& landmarks) {
  std::erase_if(from, [&](int a) { return std::binary_search(landmarks.begin(), landmarks.end(), a); });
}

std::vector<std::vector<int>> complete_landmarks_by_group(const Landmarks& shape) {
  const std::vector<int> incomplete = incomplete_points(shape.points);
  std::vector<std::vector<int>> groups = landmarks_by_group(shape);
  for (std::vector<int>& members : groups) remove(members, incomplete);
  std::erase_if(groups, [](const std::vector<int>& members) { return members.empty(); });
  return groups;
}

}  // namespace

Figure plan_figure(const Landmarks& shape, double scale) {
  Figure figure{};
  for (const std::vector<int>& members : complete_landmarks_by_group(shape)) {
    const Points points = shape.points(Eigen::all, members);
    const OutlineKind kind = outline_kind(points);
    std::size_t stride = 1;
    if (kind != OutlineKind::kNone) {
      const double gap = scale * median(gaps_of(points));
      if (gap < kDenseGap) stride = static_cast<std::size_t>(std::ceil(kDenseGap / gap));
      figure.outlines.push_back({members, figure.groups.size(), stride > 1});
      if (kind == OutlineKind::kClosed) figure.outlines.back().members.push_back(members.front());
    }
    figure.groups.push_back(stride == 1 ? members : std::vector<int>());
    if (!shape.groups.empty()) figure.names.push_back(shape.groups[static_cast<std::size_t>(members.front())]);
    figure.marked.insert(figure.marked.end(), figure.groups.back().begin(), figure.groups.back().end());
    for (std::size_t i = 0; i < members.size(); i += stride) figure.with_path.push_back(members[i]);
  }
  if (figure.groups.size() < 2) figure.names.clear();
  figure.spacing = std::numeric_limits<double>::infinity();
  if (figure.marked.size() > 1)
    figure.spacing = scale * median_nearest_distance(shape.points(Eigen::all, figure.marked));
  return figure;
}

Figure without(Figure figure, const std::vector<int>& left_out) {
  for (std::vector<int>& members : figure.groups) remove(members, left_out);
  remove(figure.marked, left_out);
  for (Outline& outline : figure.outlines) {
    const bool closed = outline.members.front() == outline.members.back();
    if (closed) outline.members.pop_back();
    remove(outline.members, left_out);
    if (closed && outline.members.size() > 1) outline.members.push_back(outline.members.front());
  }
  std::erase_if(figure.outlines, [](const Outline& outline) { return outline.members.size() < 2; });
  return figure;
}

std::vector<Points> trace(const Figure& figure, bool dense, const Points& points, std::size_t group) {
  std::vector<Points> lines;
  for (const Outline& outline : figure.outlines)
    if (outline.dense == dense && outline.group == group) lines.emplace_back(points(Eigen::all, outline.members));
  return lines;
}

std::vector<Points> trace(const Figure& figure, bool dense, const Points& points) {
  std::vector<Points> lines;
  for (const Outline& outline : figure.outlines)
    if (outline.dense == dense) lines.emplace_back(points(Eigen::all, outline.members));
  return lines;
}

}  // namespace picture
}  // namespace pulson
