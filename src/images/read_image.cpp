#include <array>
#include <limits>
#include <string>
#include <string_view>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "channels.hpp"
#include "core/text.hpp"
#include "file_checks.hpp"
#include "mats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/images/image_files.hpp"

namespace pulson {
namespace {

using images::mat_of;

/// Whether the file begins as one of the formats do; then what is wrong with it comes later.
bool has_signature(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr std::array kBeginnings{"\x89PNG"sv, "\xFF\xD8\xFF"sv, "II*\0"sv, "MM\0*"sv, "BM"sv, "P1"sv,
                                   "P2"sv,      "P3"sv,           "P4"sv,    "P5"sv,    "P6"sv};
  for (const std::string_view beginning : kBeginnings)
    if (bytes.starts_with(beginning)) return true;
  return false;
}

cv::Mat decode(std::string& bytes, const std::string& failure) {
  const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8U, bytes.data());
  try {
    return cv::imdecode(view, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    if (error.err.find("CV_IO_MAX_IMAGE") != std::string::npos)
      throw InputError(failure + "the image has more than 2^20 pixels on a side, or more than 2^30");
    if (error.code == cv::Error::StsNoMem) throw InputError(failure + "the image does not fit into memory");
    return {};
  }
}

Image from_opencv(const cv::Mat& pixels, const std::string& failure) {
  const int depth = pixels.depth();
  if (depth != CV_8U && depth != CV_16U && depth != CV_32F)
    throw InputError(
        failure +
        "its pixels are signed or of 64 bits; they must be unsigned of 8 or 16 bits, or 32-bit floating-point");
  const PixelDepth ours =
      depth == CV_8U ? PixelDepth::kUint8 : (depth == CV_16U ? PixelDepth::kUint16 : PixelDepth::kFloat32);
  Image image(pixels.cols, pixels.rows, pixels.channels(), ours);
  cv::Mat target = mat_of(image);
  if (pixels.channels() < 3)
    pixels.copyTo(target);
  else
    cv::cvtColor(pixels, target, pixels.channels() == 3 ? cv::COLOR_BGR2RGB : cv::COLOR_BGRA2RGBA);
  return image;
}

}  // namespace

Image read_image(const std::filesystem::path& path) {
  std::string bytes = io::read_text_file(path);
  const std::string failure = "cannot read '" + path.string() + "': ";
  if (bytes.size() > std::numeric_limits<int>::max()) throw InputError(failure + "it is larger than 2 GiB");
  const std::optional<images::TiffFacts> tiff = images::tiff_facts(bytes);
  if (tiff && !tiff->unreadable.empty())
    throw InputError(failure + "it is " + tiff->unreadable + ", which is not read; save it as a png");
  const cv::Mat pixels = images::is_cut_jpeg(bytes) ? cv::Mat() : decode(bytes, failure);
  if (pixels.empty() && has_signature(bytes)) throw InputError(failure + "the image is damaged or cut off");
  if (pixels.empty()) throw InputError(failure + "it is not an image; it must be a png, jpg, tif, bmp, pgm or ppm");
  Image image = from_opencv(pixels, failure);
  if (tiff && tiff->is_premultiplied && image.has_alpha()) images::unpremultiply(image);
  return image;
}

}  // namespace pulson
