#include "images/compose.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <opencv2/imgproc.hpp>

#include "channels.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

using images::mat_of;

Image resized(const Image& image, int width, int height, int interpolation) {
  Image result(width, height, image.channels(), image.depth());
  images::filter_pixels(mat_of(image), result, [&](const cv::Mat& from, cv::Mat& to) {
    cv::resize(from, to, cv::Size(width, height), 0, 0, interpolation);
  });
  return result;
}

void clear_nan_pixels(Image& image) {
  const std::span<float> values = image.values<float>();
  for (std::size_t i = 0; i < values.size(); i += 4)
    if (std::any_of(&values[i], &values[i] + 4, [](float value) { return std::isnan(value); }))
      std::fill_n(&values[i], 4, 0.0F);
}

}  // namespace

Image to_rgba8(const Image& image) {
  Image colours = images::with_alpha(images::with_colours(image));
  if (colours.depth() == PixelDepth::kUint8) return colours;
  if (colours.depth() == PixelDepth::kFloat32) clear_nan_pixels(colours);
  Image result(image.width(), image.height(), 4, PixelDepth::kUint8);
  cv::Mat pixels = mat_of(result);
  mat_of(colours).convertTo(pixels, CV_8U, 255 / full_value(image.depth()));
  return result;
}

Image side_by_side(const std::vector<Image>& images, int gap) {
  if (images.empty() || gap < 0) throw InputError("images side by side: one or more, with a gap of 0 pixels or more");
  const auto is_lower = [](const Image& a, const Image& b) { return a.height() < b.height(); };
  const int height = std::max_element(images.begin(), images.end(), is_lower)->height();
  std::vector<Image> panels;
  int width = -gap;
  for (const Image& image : images) {
    panels.push_back(to_rgba8(image));
    const double factor = static_cast<double>(height) / image.height();
    if (image.height() < height)
      panels.back() =
          resized(panels.back(), static_cast<int>(std::lround(factor * image.width())), height, cv::INTER_LINEAR);
    width += panels.back().width() + gap;
  }
  Image result(width, height, 4, PixelDepth::kUint8);
  cv::Rect place(0, 0, 0, height);
  for (const Image& panel : panels) {
    place.width = panel.width();
    mat_of(panel).copyTo(mat_of(result)(place));
    place.x += panel.width() + gap;
  }
  return result;
}

Image scaled_down(const Image& image, double factor) {
  if (!(factor >= 1) || !std::isfinite(factor))
    throw InputError("an image cannot be scaled down by " + std::to_string(factor) + "; the factor must be at least 1");
  const auto divided = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / factor))); };
  return resized(image, divided(image.width()), divided(image.height()), cv::INTER_AREA);
}

}  // namespace pulson
