#include "mats.hpp"

namespace pulson::images {

int mat_type(PixelDepth depth, int channels) {
  if (depth == PixelDepth::kUint8) return CV_8UC(channels);
  return depth == PixelDepth::kUint16 ? CV_16UC(channels) : CV_32FC(channels);
}

cv::Mat mat_of(Image& image) {
  return {image.height(), image.width(), mat_type(image.depth(), image.channels()), image.bytes().data()};
}

cv::Mat mat_of(const Image& image) { return mat_of(const_cast<Image&>(image)); }

}  // namespace pulson::images
