#include "channels.hpp"

#include <algorithm>
#include <cassert>
#include <span>

#include "rounding.hpp"

namespace pulson::images {

int mat_type(PixelType type, int channels) {
  assert(type == PixelType::kUint8 || type == PixelType::kUint16 || type == PixelType::kFloat32);
  if (type == PixelType::kUint8) return CV_8UC(channels);
  return type == PixelType::kUint16 ? CV_16UC(channels) : CV_32FC(channels);
}

cv::Mat mat_of(Image& image) {
  return {image.height(), image.width(), mat_type(image.type(), image.channels()), image.bytes().data()};
}

cv::Mat mat_of(const Image& image) { return mat_of(const_cast<Image&>(image)); }

namespace {

/// An image of this format, each pixel made by set(pixel of the old, pixel of the new), which are spans of numbers.
template <class Set>
Image with_pixels(const Image& image, const PixelFormat& format, const Set& set) {
  Image result(image.width(), image.height(), format);
  with_number_type(image.type(), [&]<class Value>() {
    const auto from = image.values<Value>();
    const auto to = result.values<Value>();
    const auto before = static_cast<std::size_t>(image.channels()), after = static_cast<std::size_t>(format.channels);
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
      set(from.subspan(i * before, before), to.subspan(i * after, after));
  });
  return result;
}

}  // namespace

Image with_alpha(const Image& image) {
  if (image.has_alpha()) return image;
  PixelFormat format = image.format();
  ++format.channels;
  format.alpha = Alpha::kStraight;
  return with_pixels(image, format, [&]<class Value>(std::span<const Value> from, std::span<Value> to) {
    std::copy(from.begin(), from.end(), to.begin());
    to.back() = rounded<Value>(format.full, format.full);
  });
}

Image with_colours(const Image& image) {
  PixelFormat format = image.format();
  if (format.colours() >= 3) return image;
  format.channels = format.has_alpha() ? 4 : 3;
  return with_pixels(image, format, [&]<class Value>(std::span<const Value> from, std::span<Value> to) {
    std::fill_n(to.begin(), 3, from.front());
    if (format.has_alpha()) to.back() = from.back();
  });
}

Image first_channels(const Image& image) {
  PixelFormat format = image.format();
  const int kept = format.colours() == 3 ? 3 : 1;
  if (kept == format.colours()) return image;
  format.channels = format.has_alpha() ? kept + 1 : kept;
  return with_pixels(image, format, [&]<class Value>(std::span<const Value> from, std::span<Value> to) {
    std::copy_n(from.begin(), kept, to.begin());
    if (format.has_alpha()) to.back() = from.back();
  });
}

Image with_straight_alpha(const Image& image) {
  PixelFormat format = image.format();
  if (format.alpha != Alpha::kAssociated) return image;
  format.alpha = Alpha::kStraight;
  return with_pixels(image, format, [&]<class Value>(std::span<const Value> from, std::span<Value> to) {
    const double opacity = static_cast<double>(from.back()) / format.full;
    for (std::size_t c = 0; c + 1 < to.size(); ++c)
      to[c] = opacity > 0 ? rounded<Value>(static_cast<double>(from[c]) / opacity, format.full) : Value{0};
    to.back() = from.back();
  });
}

cv::Mat premultiplied(const cv::Mat& straight) {
  cv::Mat pixels;
  straight.convertTo(pixels, CV_32F);
  const int alpha = straight.channels() - 1;
  const auto full = static_cast<float>(straight.depth() == CV_8U ? 255 : straight.depth() == CV_16U ? 65535 : 1);
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
  const auto full = static_cast<float>(result.full());
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

void filter_pixels(const cv::Mat& source, Image& result, const std::function<void(const cv::Mat&, cv::Mat&)>& filter) {
  assert(source.type() == mat_type(result.type(), result.channels()));
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
