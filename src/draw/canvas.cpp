#include "canvas.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/atomic_file.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

constexpr double kSmallestText = 0.55;  // of the size asked for, before text is cut
constexpr double kBarb = 4;             // of an arrow's tip, pixels for a stroke of no width
constexpr double kBarbSlope = 0.45;
constexpr double kShortestArrow = 1;  // pixels
constexpr double kTextMargin = 1.9;   // pixels
constexpr double kPixelsPerInch = 96, kMillimetresPerInch = 25.4;

/// Without vertices within straight parts: they would only take time and space.
void straighten(Points& line) {
  constexpr double kStraight = 0.005;  // pixels from the line that passes a vertex over
  constexpr Eigen::Index kMostPassed = 32;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < line.cols(); ++i) {
    if (i > 0 && i + 1 < line.cols() && i - kept.back() < kMostPassed) {
      const Eigen::Vector2d before = line.col(i) - line.col(kept.back()), after = line.col(i + 1) - line.col(i);
      const double across = std::abs(before.x() * after.y() - before.y() * after.x());
      if (before.dot(after) > 0 && across < kStraight * after.norm()) continue;
    }
    kept.push_back(i);
  }
  if (static_cast<Eigen::Index>(kept.size()) < line.cols()) line = Points(line(Eigen::all, kept));
}

}  // namespace

void Canvas::lines(std::vector<Points> lines, const Stroke& stroke) {
  for (Points& line : lines) straighten(line);
  if (std::any_of(lines.begin(), lines.end(), [](const Points& line) { return line.cols() > 0; }))
    add(Lines{std::move(lines), stroke});
}

void Canvas::areas(std::vector<Points> outlines, const Colour& colour) {
  if (std::any_of(outlines.begin(), outlines.end(), [](const Points& outline) { return outline.cols() > 0; }))
    add(Areas{std::move(outlines), colour});
}

void Canvas::segments(const Points& from, const Points& to, const Stroke& stroke) {
  std::vector<Points> lines;
  for (Eigen::Index i = 0; i < from.cols(); ++i) lines.push_back((Points(2, 2) << from.col(i), to.col(i)).finished());
  this->lines(std::move(lines), stroke);
}

void Canvas::arrows(const Points& from, const Points& to, const Stroke& stroke) {
  std::vector<Points> lines;
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    const Eigen::Vector2d tip = to.col(i), shaft = tip - from.col(i);
    const double length = shaft.norm(), barb = std::min(0.4 * length, kBarb + 3 * stroke.width);
    if (length < kShortestArrow) continue;
    const Eigen::Vector2d back = -barb / length * shaft, side = kBarbSlope * Eigen::Vector2d(-back.y(), back.x());
    lines.push_back((Points(2, 2) << from.col(i), tip).finished());
    lines.push_back((Points(2, 3) << tip + back + side, tip, tip + back - side).finished());
  }
  this->lines(std::move(lines), stroke);
}

void Canvas::dots(const Points& centres, double radius, const Colour& colour) {
  if (centres.cols() > 0) add(Circles{centres, radius, colour});
}

void Canvas::rings(const Points& centres, double radius, const Stroke& stroke) {
  if (centres.cols() > 0) add(Circles{centres, radius, stroke.colour, stroke.width});
}

void Canvas::raster(Raster raster, const Box& box) { add(Picture{std::move(raster), box}); }

void Canvas::text(double x, double y, std::string_view text, double size, const Colour& colour, Align align,
                  double max_width) {
  const std::string shown = printable(text);
  const double room = std::min(max_width, width());
  size *= std::clamp(room / std::max(text_width(shown, size), 1e-9), kSmallestText, 1.0);
  std::string cut = fitted(shown, size, room);
  const double width = text_width(cut, size);
  drawing_.texts.push_back({x, y, std::move(cut), size, colour, align, width, 0});
}

void Canvas::text_on_image(double x, double y, std::string_view text, double size, const Colour& colour) {
  this->text(x, y, text, size, colour);
  drawing_.texts.back().margin = kTextMargin;
}

double Canvas::scale_of(const std::optional<double>& width) const {
  return width ? *width / kMillimetresPerInch * kPixelsPerInch / this->width() : 1;
}

std::string Canvas::svg() const { return svg_of(drawing_, 1); }

std::string Canvas::png(const std::optional<double>& width, double dpi) const {
  return png_of(drawing_, scale_of(width) * dpi / kPixelsPerInch);
}

void Canvas::write(const PictureFiles& files) const try {
  for (const auto* file : {&files.png, &files.svg, &files.pdf})
    if (!file->empty()) check_output_file(*file);
  const double scale = scale_of(files.width);
  const std::string png = files.png.empty() ? "" : this->png(files.width, files.dpi);
  const std::string svg = files.svg.empty() ? "" : svg_of(drawing_, scale);
  const std::string pdf = files.pdf.empty() ? "" : pdf_of(drawing_, scale);
  if (!png.empty()) write_file_atomically(files.png, png);
  if (!svg.empty()) write_file_atomically(files.svg, svg);
  if (!pdf.empty()) write_file_atomically(files.pdf, pdf);
} catch (const std::bad_alloc&) {
  throw InputError("a picture does not fit into memory; lower its resolution or its width");
}

}  // namespace pulson::draw
