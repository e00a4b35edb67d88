#include "canvas.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>
#include <unistd.h>

#include "core/text.hpp"
#include "draw/gnuplot.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

constexpr double kViridisEnd = 0.8;
constexpr std::string_view kNarrow = " fijlrtI.,:;'|()[]-";
constexpr std::string_view kWide = "mwMW@%=+<>";
constexpr double kSmallestText = 0.55;  // of the size asked for, before text is cut
constexpr double kBarb = 4;             // of an arrow's tip, pixels for a stroke of no width
constexpr double kBarbSlope = 0.45;
constexpr double kShortestArrow = 1;  // pixels
constexpr double kPixelsPerInch = 96, kMillimetresPerInch = 25.4;
constexpr double kPdfLine = 4.0 / 3, kPdfText = 0.5625;  // in pdfcairo, found by comparison with the png
constexpr double kPointsPerPixel = 0.75;                 // pngcairo counts text in points, the SVG terminal in pixels

/// Width of one byte's letter in font sizes, DejaVu Sans; 0 for the later bytes of a letter.
double letter_width(char c) {
  if (!begins_character(c)) return 0;
  return kNarrow.find(c) != std::string_view::npos ? 0.37 : kWide.find(c) != std::string_view::npos ? 0.92 : 0.63;
}

/// The text, cut after a letter and closed by an ellipsis where it would be wider than `room`.
std::string cut(std::string_view text, double size, double room) {
  if (text_width(text, size) <= room) return std::string(text);
  std::size_t end = 0;
  for (double width = size; end < text.size(); ++end) {
    width += size * letter_width(text[end]);
    if (width > room) break;
  }
  return std::string(text.substr(0, end)) + "…";
}

void add_vertex(std::string& rows, double x, double y) {
  fmt::format_to(std::back_inserter(rows), "{:.2f} {:.2f}\n", x, y);
}

std::string in_pixels(double width, double height) {
  return fmt::format("{:.0f},{:.0f}", std::round(width), std::round(height));
}

std::string terminal(std::string_view name, const std::string& size, double text_scale, double line_scale) {
  return fmt::format(
      "set terminal {} noenhanced size {} font 'sans-serif,20' fontscale {} linewidth {} rounded background '{}'", name,
      size, text_scale, line_scale, colour::kPaper);
}

}  // namespace

Colour time_colour(double s) {
  const auto [red, green, blue] = colour_at(kViridis, std::clamp(s, 0.0, 1.0) * kViridisEnd);
  return fmt::format("#{:02X}{:02X}{:02X}", red, green, blue);
}

Colour faded(const Colour& opaque, double transparency) {
  return fmt::format("#{:02X}{}", static_cast<int>(std::lround(255 * transparency)), opaque.substr(1));
}

double text_width(std::string_view text, double size) {
  double width = 0;
  for (const char c : text) width += letter_width(c);
  return width * size;
}

void Canvas::lines(const std::vector<Points>& lines, const Stroke& stroke) { add(lines, stroke, false); }

void Canvas::areas(const std::vector<Points>& outlines, const Colour& colour) { add(outlines, {colour, 0}, true); }

void Canvas::add(const std::vector<Points>& lines, const Stroke& stroke, bool filled) {
  Layer layer{{}, stroke, filled};
  for (const Points& line : lines) {
    for (Eigen::Index i = 0; i < line.cols(); ++i) add_vertex(layer.rows, line(0, i), line(1, i));
    layer.rows += '\n';
  }
  if (layer.rows.size() > lines.size()) layers_.push_back(std::move(layer));
}

void Canvas::segments(const Points& from, const Points& to, const Stroke& stroke) {
  Layer layer{{}, stroke, false};
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    add_vertex(layer.rows, from(0, i), from(1, i));
    add_vertex(layer.rows, to(0, i), to(1, i));
    layer.rows += '\n';
  }
  if (!layer.rows.empty()) layers_.push_back(std::move(layer));
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
  this->lines(lines, stroke);
}

void Canvas::dots(const Points& centres, double radius, const Colour& colour) {
  // A line of almost no length with round ends is a disc; gnuplot drops one of no length at all.
  const Eigen::Vector2d nudge(0.02, 0);
  segments(centres, centres.colwise() + nudge, {colour, 2 * radius});
}

void Canvas::rings(const Points& centres, double radius, const Stroke& stroke) {
  const int corners = std::clamp(static_cast<int>(std::lround(10 + 2 * radius)), 12, 48);
  Points circle(2, corners + 1);
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    circle.col(i) << radius * std::cos(angle), radius * std::sin(angle);
  }
  std::vector<Points> circles;
  for (Eigen::Index i = 0; i < centres.cols(); ++i)
    circles.emplace_back(circle.colwise() + Eigen::Vector2d(centres.col(i)));
  lines(circles, stroke);
}

void Canvas::raster(const Raster& raster, const Box& box) {
  const std::shared_ptr<std::FILE> file = scratch_.emplace_back(make_scratch_file("gnuplot"));
  if (std::fwrite(raster.rgba.data(), 1, raster.rgba.size(), file.get()) != raster.rgba.size() ||
      std::fflush(file.get()) != 0)
    throw InputError("a picture cannot be kept in the folder of temporary files");
  const double dx = box.width / raster.width, dy = box.height / raster.height;
  Layer layer;
  layer.image = fmt::format(
      "'/proc/{}/fd/{}' binary array=({},{}) format='%uchar%uchar%uchar%uchar' flipy origin=({:.4f},{:.4f}) "
      "dx={:.6f} dy={:.6f} using 1:2:3:4 with rgbalpha title ''",
      ::getpid(), ::fileno(file.get()), raster.width, raster.height, box.left + dx / 2, box.bottom + dy / 2, dx, dy);
  layers_.push_back(std::move(layer));
}

void Canvas::text(double x, double y, std::string_view text, double size, const Colour& colour, Align align,
                  double max_width) {
  const double shrink = std::clamp(max_width / std::max(text_width(text, size), 1e-9), kSmallestText, 1.0);
  const char* side = align == Align::kLeft ? "left" : align == Align::kCentre ? "center" : "right";
  labels_.push_back(fmt::format("set label {} at first {:.2f},{:.2f} {} front font ',{:.1f}' textcolor rgb '{}'",
                                Gnuplot::quoted(cut(text, size * shrink, max_width)), x, y, side, size * shrink,
                                colour));
}

void Canvas::text_on_image(double x, double y, std::string_view text, double size, const Colour& colour) {
  constexpr double kMargin = 1.9;
  constexpr int kAround = 12;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    this->text(x + kMargin * std::cos(angle), y + kMargin * std::sin(angle), text, size, colour::kPaper);
  }
  this->text(x, y, text, size, colour);
}

void Canvas::write(const PictureFiles& files) const {
  Gnuplot gnuplot;
  gnuplot.command("set encoding utf8\nunset border\nunset tics\nunset key");
  gnuplot.command("set lmargin at screen 0\nset rmargin at screen 1\nset bmargin at screen 0\nset tmargin at screen 1");
  gnuplot.command(fmt::format("set xrange [0:{}]\nset yrange [{}:{}]", width_, -below_, height_));
  for (const std::string& label : labels_) gnuplot.command(label);
  std::string plot = "plot ";
  for (const Layer& layer : layers_) {
    plot += plot.size() > 5 ? ", " : "";
    plot += !layer.image.empty() ? layer.image
                                 : fmt::format("{} with {} linecolor rgb '{}' title ''", gnuplot.add_block(layer.rows),
                                               layer.filled ? "filledcurves closed fillstyle solid noborder"
                                                            : fmt::format("lines linewidth {:.2f}", layer.stroke.width),
                                               layer.stroke.colour);
  }
  const double tall = height_ + below_;
  const double enlarged = files.width ? *files.width / kMillimetresPerInch * kPixelsPerInch / width_ : 1;
  const auto draw = [&](const std::filesystem::path& file, const std::string& terminal) {
    if (file.empty()) return;
    gnuplot.command(terminal);
    gnuplot.set_output(file);
    gnuplot.command(plot);
  };
  const double of_png = enlarged * files.dpi / kPixelsPerInch;
  draw(files.png, terminal("pngcairo", in_pixels(width_ * of_png, tall * of_png), kPointsPerPixel * of_png, of_png));
  draw(files.svg, terminal("svg", in_pixels(width_ * enlarged, tall * enlarged), enlarged, enlarged));
  draw(files.pdf,
       terminal("pdfcairo",
                fmt::format("{:.4f}in,{:.4f}in", enlarged * width_ / kPixelsPerInch, enlarged * tall / kPixelsPerInch),
                kPdfText * enlarged, kPdfLine * enlarged));
  gnuplot.run();
}

}  // namespace pulson::draw
