#include "html_sketch.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>
#include <string_view>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::html {
namespace {

constexpr double kWidth = 160, kHeight = 120, kEdge = 6;
constexpr Eigen::Index kManyMarks = 80;  // landmarks, from which on marks are small

// The two axes of the largest extent, in their order; of the line its own alone.
std::vector<int> shown_axes(const Points& points) {
  std::vector<int> axes(static_cast<std::size_t>(points.rows()));
  std::iota(axes.begin(), axes.end(), 0);
  const Eigen::VectorXd extent = points.rowwise().maxCoeff() - points.rowwise().minCoeff();
  if (axes.size() > 2)
    axes.erase(std::min_element(axes.begin(), axes.end(), [&](int a, int b) { return extent[a] < extent[b]; }));
  return axes;
}

// From coordinates to those of the drawing. Shapes on a line lie below one another, `row` by `row`.
class Place {
 public:
  explicit Place(const ReportSketch& sketch)
      : axes_(shown_axes(sketch.source.points)), y_down_(sketch.source.frame.y_down) {
    Points all(sketch.source.points.rows(), 2 * sketch.source.points.cols() + sketch.target.cols());
    all << sketch.source.points, sketch.result, sketch.target;
    const auto [low, high] = bounding_box(all);
    const Eigen::VectorXd extent = high - low;
    middle_ = (low + high) / 2;
    scale_ = (kWidth - 2 * kEdge) / std::max(extent[axes_[0]], 1e-300);
    if (axes_.size() > 1) scale_ = std::min(scale_, (kHeight - 2 * kEdge) / std::max(extent[axes_[1]], 1e-300));
  }

  Eigen::Vector2d operator()(const Eigen::VectorXd& point, double row) const {
    const double x = kWidth / 2 + scale_ * (point[axes_[0]] - middle_[axes_[0]]);
    if (axes_.size() == 1) return {x, kHeight * (0.5 + 0.3 * row)};
    const double up = scale_ * (point[axes_[1]] - middle_[axes_[1]]);
    return {x, kHeight / 2 + (y_down_ ? up : -up)};
  }

 private:
  std::vector<int> axes_;
  bool y_down_;
  Eigen::VectorXd middle_;
  double scale_ = 1;
};

// One path for all outlines and links, and a dot or ring for each landmark that is on none.
void draw(std::string& svg, const Points& points, const Landmarks& source, const Place& place, std::string_view style,
          double row, double radius) {
  std::string lines, marks;
  for (const std::vector<int>& group : landmarks_by_group(source)) {
    const draw::OutlineKind kind = draw::outline_kind(source.points(Eigen::all, group));
    bool begun = false;
    for (const int a : group) {
      if (!points.col(a).allFinite()) continue;
      const Eigen::Vector2d at = place(points.col(a), row);
      if (kind != draw::OutlineKind::kNone) {
        fmt::format_to(std::back_inserter(lines), "{}{:.1f} {:.1f}", begun ? "L" : "M", at.x(), at.y());
        begun = true;
      } else {  // a circle of two arcs
        fmt::format_to(std::back_inserter(marks), "M{0:.1f} {1:.1f}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0 -{3} 0",
                       at.x() - radius, at.y(), radius, 2 * radius);
      }
    }
    if (begun && kind == draw::OutlineKind::kClosed) lines += "Z";
  }
  for (const auto& [a, b] : source.links) {
    if (!points.col(a).allFinite() || !points.col(b).allFinite()) continue;
    const Eigen::Vector2d from = place(points.col(a), row), to = place(points.col(b), row);
    fmt::format_to(std::back_inserter(lines), "M{:.1f} {:.1f}L{:.1f} {:.1f}", from.x(), from.y(), to.x(), to.y());
  }
  if (const std::string path = lines + marks; !path.empty())
    fmt::format_to(std::back_inserter(svg), R"(<path class="{}" d="{}"/>)", style, path);
}

}  // namespace

std::string sketch(const ReportSketch& sketch) {
  const Points& source = sketch.source.points;
  if (sketch.result.rows() != source.rows() || sketch.result.cols() != source.cols() ||
      (sketch.target.size() > 0 && (sketch.target.rows() != source.rows() || sketch.target.cols() != source.cols())))
    throw InputError("report: the shapes of a sketch have different sizes");
  if (source.cols() == 0 || !source.allFinite() || !sketch.result.allFinite())
    throw InputError("report: a sketch needs landmarks that are finite");
  const Place place(sketch);
  const double radius = source.cols() > kManyMarks ? 1 : 2;
  std::string svg = fmt::format(R"(<svg class="sketch" viewBox="0 0 {} {}" aria-hidden="true">)", kWidth, kHeight);
  std::string moves;
  for (Eigen::Index a = 0; a < source.cols(); ++a) {
    const Eigen::Vector2d from = place(source.col(a), -1), to = place(sketch.result.col(a), 1);
    fmt::format_to(std::back_inserter(moves), "M{:.1f} {:.1f}L{:.1f} {:.1f}", from.x(), from.y(), to.x(), to.y());
  }
  svg += R"(<path class="move" d=")" + moves + "\"/>";
  draw(svg, source, sketch.source, place, "source", -1, radius);
  if (sketch.target.size() > 0) draw(svg, sketch.target, sketch.source, place, "target", 1, 1.75 * radius);
  draw(svg, sketch.result, sketch.source, place, "result", 1, radius);
  return svg + "</svg>";
}

}  // namespace pulson::html
