#include "images/drawing.hpp"

#include <cmath>
#include <string>

#include <opencv2/imgproc.hpp>

#include "channels.hpp"
#include "core/text.hpp"
#include "images/compose.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

constexpr int kFractionBits = 8;

int fixed_point(double x) { return static_cast<int>(std::lround(std::ldexp(x, kFractionBits))); }

bool is_drawn(const Points& points, Eigen::Index i) {
  constexpr double kFarthest = 1e6;  // its fixed point number fits into 32 bits
  return std::abs(points(0, i)) <= kFarthest && std::abs(points(1, i)) <= kFarthest;
}

cv::Point fixed_point(const Points& points, Eigen::Index i) {
  return {fixed_point(points(0, i)), fixed_point(points(1, i))};
}

/// The runs of vertices between those that are not drawn.
std::vector<std::vector<cv::Point>> runs_of(const Points& line) {
  std::vector<std::vector<cv::Point>> runs(1);
  for (Eigen::Index i = 0; i < line.cols(); ++i) {
    if (is_drawn(line, i))
      runs.back().push_back(fixed_point(line, i));
    else if (!runs.back().empty())
      runs.emplace_back();
  }
  if (runs.back().empty()) runs.pop_back();
  return runs;
}

/// Lays the colour over the image (to_rgba8) where `cover`, one byte a pixel, is not 0: the "over" of Porter and Duff
/// (1984) for straight alpha. Drawing into a cover first lets the alpha of the image be blended as well as its colours.
Image blended(Image image, const cv::Mat& cover, const Colour& colour) {
  const double top[3] = {static_cast<double>(colour.red), static_cast<double>(colour.green),
                         static_cast<double>(colour.blue)};
  std::uint8_t* pixel = image.values<std::uint8_t>().data();
  for (std::size_t i = 0; i < image.pixel_count(); ++i, pixel += 4) {
    if (cover.data[i] == 0) continue;
    const double share = cover.data[i] / 255.0 * (colour.alpha / 255.0);
    const double rest = (1 - share) * (pixel[3] / 255.0);
    const double alpha = share + rest;
    if (!(alpha > 0)) continue;
    for (int c = 0; c < 3; ++c)
      pixel[c] = static_cast<std::uint8_t>(std::lround((share * top[c] + rest * pixel[c]) / alpha));
    pixel[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
  }
  return image;
}

int line_type(bool antialias) { return antialias ? cv::LINE_AA : cv::LINE_8; }

cv::Mat empty_cover(const Image& image) { return cv::Mat::zeros(image.height(), image.width(), CV_8U); }

}  // namespace

Image blend_lines(const Image& image, const std::vector<Points>& lines, const LineStyle& style) {
  if (style.thickness < 1)
    throw InputError("line " + std::to_string(style.thickness) + " pixels thick; 1 is the least");
  cv::Mat cover = empty_cover(image);
  for (const Points& line : lines) {
    require_size("a line of a drawing", line, 2, line.cols());
    cv::polylines(cover, runs_of(line), false, 255, style.thickness, line_type(style.antialias), kFractionBits);
  }
  return blended(to_rgba8(image), cover, style.colour);
}

Image blend_rings(const Image& image, const Points& centres, double radius, const LineStyle& style) {
  require_size("the centres of rings", centres, 2, centres.cols());
  if (!(radius >= 0)) throw InputError("rings of radius " + std::to_string(radius) + "; it must not be negative");
  cv::Mat cover = empty_cover(image);
  for (Eigen::Index i = 0; i < centres.cols(); ++i)
    if (is_drawn(centres, i))
      cv::circle(cover, fixed_point(centres, i), fixed_point(radius), 255, style.thickness, line_type(style.antialias),
                 kFractionBits);
  return blended(to_rgba8(image), cover, style.colour);
}

}  // namespace pulson
