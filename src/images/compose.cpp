#include "images/compose.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "channels.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {

namespace {

using images::mat_of;

Image resized(const Image& image, int width, int height, int interpolation) {
  Image result(width, height, image.format());
  images::filter_pixels(mat_of(image), result, [&](const cv::Mat& from, cv::Mat& to) {
    cv::resize(from, to, cv::Size(width, height), 0, 0, interpolation);
  });
  return result;
}

/// A pixel of four numbers in 8 bits.
template <class Value>
void set_rgba8(std::span<const Value> from, double full, std::uint8_t* to) {
  if (std::any_of(from.begin(), from.end(), [](Value value) { return value != value; })) return;  // NaN
  for (std::size_t c = 0; c < 4; ++c) {
    const double part = std::clamp(static_cast<double>(from[c]) / full, 0.0, 1.0);
    to[c] = static_cast<std::uint8_t>(std::lround(255 * part));
  }
}

std::pair<Image, Image> of_one_size(const Image& a, const Image& b) {
  if (a.width() != b.width() || a.height() != b.height())
    throw InputError("images of " + std::to_string(a.width()) + " x " + std::to_string(a.height()) + " and " +
                     std::to_string(b.width()) + " x " + std::to_string(b.height()) + " pixels cannot be compared");
  return {to_rgba8(a), to_rgba8(b)};
}

template <class AnyImage>
auto* pixel_of(AnyImage& image, int x, int y) {
  using Byte = std::conditional_t<std::is_const_v<AnyImage>, const std::uint8_t, std::uint8_t>;
  return reinterpret_cast<Byte*>(image.bytes().data()) +
         4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(x));
}

/// Each pixel of both by `combine(a, b, result)`.
template <class Combine>
Image combined(const Image& a, const Image& b, const Combine& combine) {
  const auto [first, second] = of_one_size(a, b);
  Image result(a.width(), a.height(), 4, PixelType::kUint8);
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) combine(pixel_of(first, x, y), pixel_of(second, x, y), pixel_of(result, x, y));
  return result;
}

}  // namespace

Image to_rgba8(const Image& image) {
  Image colours = with_alpha(with_colours(first_channels(with_straight_alpha(image))));
  if (colours.type() == PixelType::kUint8 && colours.full() == 255) return colours;
  Image result(image.width(), image.height(), 4, PixelType::kUint8);
  std::uint8_t* to = result.values<std::uint8_t>().data();
  with_number_type(colours.type(), [&]<class Value>() {
    const auto from = std::as_const(colours).values<Value>();
    for (std::size_t i = 0; i < colours.pixel_count(); ++i)
      set_rgba8(from.subspan(4 * i, 4), colours.full(), to + 4 * i);
  });
  return result;
}

std::vector<std::uint8_t> rgb_on_white(const Image& image) {
  const auto values = image.values<std::uint8_t>();
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.pixel_count() * 3);
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const int alpha = values[4 * i + 3];
      rgb.push_back(static_cast<std::uint8_t>((values[4 * i + c] * alpha + 255 * (255 - alpha) + 127) / 255));
    }
  return rgb;
}

Image checkerboard(const Image& a, const Image& b, int squares) {
  const auto [first, second] = of_one_size(a, b);
  if (squares < 1) throw InputError("a checkerboard needs one square or more");
  const int side = std::max(1, (std::max(a.width(), a.height()) + squares - 1) / squares);
  Image result = first;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x)
      if ((x / side + y / side) % 2 == 1) std::copy_n(pixel_of(second, x, y), 4, pixel_of(result, x, y));
  return result;
}

Image blend(const Image& a, const Image& b) {
  return combined(a, b, [](const std::uint8_t* one, const std::uint8_t* other, std::uint8_t* result) {
    const int weight = one[3] + other[3];
    for (int c = 0; c < 3; ++c)
      result[c] =
          static_cast<std::uint8_t>(weight > 0 ? (one[c] * one[3] + other[c] * other[3] + weight / 2) / weight : 0);
    result[3] = std::max(one[3], other[3]);
  });
}

Image difference(const Image& a, const Image& b) {
  return combined(a, b, [](const std::uint8_t* one, const std::uint8_t* other, std::uint8_t* result) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::abs(int{one[c]} - int{other[c]});
    std::fill_n(result, 3, static_cast<std::uint8_t>(255 - (sum + 1) / 3));
    result[3] = std::min(one[3], other[3]);
  });
}

Image scaled_down(const Image& image, double factor) {
  if (!(factor >= 1) || !std::isfinite(factor))
    throw InputError("an image cannot be scaled down by " + std::to_string(factor) + "; the factor must be at least 1");
  const auto divided = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / factor))); };
  return resized(image, divided(image.width()), divided(image.height()), cv::INTER_AREA);
}

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

}  // namespace pulson::images
