#include "channels.hpp"

#include <algorithm>
#include <vector>

namespace pulson::images {

int mat_type(PixelDepth depth, int channels) {
  if (depth == PixelDepth::kUint8) return CV_8UC(channels);
  return depth == PixelDepth::kUint16 ? CV_16UC(channels) : CV_32FC(channels);
}

cv::Mat mat_of(Image& image) {
  return {image.height(), image.width(), mat_type(image.depth(), image.channels()), image.bytes().data()};
}

cv::Mat mat_of(const Image& image) { return mat_of(const_cast<Image&>(image)); }

namespace {

PixelDepth depth_of(const cv::Mat& pixels) {
  if (pixels.depth() == CV_8U) return PixelDepth::kUint8;
  return pixels.depth() == CV_16U ? PixelDepth::kUint16 : PixelDepth::kFloat32;
}

}  // namespace

cv::Mat with_alpha(const cv::Mat& pixels) {
  const cv::Mat alpha(pixels.size(), pixels.depth(), full_value(depth_of(pixels)));
  cv::Mat result(pixels.size(), CV_MAKETYPE(pixels.depth(), pixels.channels() + 1));
  cv::merge(std::vector<cv::Mat>{pixels, alpha}, result);
  return result;
}

Image with_alpha(const Image& image) {
  if (image.has_alpha()) return image;
  Image result(image.width(), image.height(), image.channels() + 1, image.depth());
  cv::Mat pixels = mat_of(result);
  with_alpha(mat_of(image)).copyTo(pixels);
  return result;
}

Image with_colours(const Image& image) {
  if (image.channels() > 2) return image;
  Image result(image.width(), image.height(), image.channels() + 2, image.depth());
  const std::vector<cv::Mat> from{mat_of(image)};
  std::vector<cv::Mat> to{mat_of(result)};
  std::vector<int> source_and_place{0, 0, 0, 1, 0, 2};
  if (image.has_alpha()) source_and_place.insert(source_and_place.end(), {1, 3});
  cv::mixChannels(from, to, source_and_place);
  return result;
}

cv::Mat premultiplied(const cv::Mat& straight) {
  cv::Mat pixels;
  straight.convertTo(pixels, CV_32F);
  const int alpha = straight.channels() - 1;
  const auto full = static_cast<float>(full_value(depth_of(straight)));
  for (int y = 0; y < pixels.rows; ++y) {
    auto* pixel = pixels.ptr<float>(y);
    for (int x = 0; x < pixels.cols; ++x, pixel += straight.channels())
      for (int c = 0; c < alpha; ++c) pixel[c] *= pixel[alpha] / full;
  }
  return pixels;
}

void unpremultiply(const cv::Mat& pixels, Image& result) {
  assert(result.has_alpha() && pixels.type() == CV_32FC(result.channels()));
  const int channels = result.channels(), alpha = channels - 1;
  const auto full = static_cast<float>(full_value(result.depth()));
  cv::Mat straight(pixels.size(), pixels.type());
  for (int y = 0; y < pixels.rows; ++y) {
    const auto* from = pixels.ptr<float>(y);
    auto* to = straight.ptr<float>(y);
    for (int x = 0; x < pixels.cols; ++x, from += channels, to += channels) {
      to[alpha] = std::clamp(from[alpha], 0.0F, full);
      // Less than this is round-off of a filter that overshoots, and its colour is of no meaning.
      const bool is_clear = !(to[alpha] > 1e-5F * full);
      for (int c = 0; c < alpha; ++c) to[c] = is_clear ? 0.0F : from[c] * (full / to[alpha]);
    }
  }
  cv::Mat rounded = mat_of(result);
  straight.convertTo(rounded, rounded.depth());
}

void unpremultiply(Image& image) {
  cv::Mat pixels;
  mat_of(image).convertTo(pixels, CV_32F);
  unpremultiply(pixels, image);
}

void filter_pixels(const cv::Mat& source, Image& result, const std::function<void(const cv::Mat&, cv::Mat&)>& filter) {
  assert(source.type() == mat_type(result.depth(), result.channels()));
  if (result.has_alpha()) {
    cv::Mat filtered;
    filter(premultiplied(source), filtered);
    return unpremultiply(filtered, result);
  }
  cv::Mat pixels = mat_of(result);
  filter(source, pixels);
  assert(static_cast<const void*>(pixels.data) == result.bytes().data());
}

}  // namespace pulson::images
