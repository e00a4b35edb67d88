#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "channels.hpp"
#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "mats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/images/image_files.hpp"

namespace pulson {
namespace {

/// What a format can hold.
struct Format {
  std::vector<std::string> extensions;
  bool grey, colour, alpha;
  std::vector<PixelDepth> depths;

  bool holds_depth(PixelDepth depth) const { return std::find(depths.begin(), depths.end(), depth) != depths.end(); }
  bool holds_channels(const Image& image) const {
    return image.has_alpha() ? alpha : (image.channels() == 1 ? grey : colour);
  }
  bool holds(const Image& image) const { return holds_depth(image.depth()) && holds_channels(image); }
};

const std::vector<Format>& formats() {
  using enum PixelDepth;
  static const std::vector<Format> kFormats{{{".png"}, true, true, true, {kUint8, kUint16}},
                                            {{".tif", ".tiff"}, true, true, true, {kUint8, kUint16, kFloat32}},
                                            {{".jpg", ".jpeg"}, true, true, false, {kUint8}},
                                            {{".bmp"}, true, true, false, {kUint8}},
                                            {{".pgm"}, true, false, false, {kUint8, kUint16}},
                                            {{".ppm"}, false, true, false, {kUint8, kUint16}}};
  return kFormats;
}

std::string extension_of(const std::filesystem::path& path) { return io::to_lower(path.extension().string()); }

std::string failure_of(const std::filesystem::path& path) { return "cannot write '" + path.string() + "': "; }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

const Format& find_format(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  std::vector<std::string> known;
  for (const Format& format : formats())
    for (const std::string& name : format.extensions) {
      if (name == extension) return format;
      known.push_back(name);
    }
  const std::string found =
      extension.empty() ? "it has no extension" : "no image format has the extension '" + extension + "'";
  throw InputError(failure_of(path) + found + "; valid: " + joined(known));
}

[[noreturn]] void fail_to_hold(const std::filesystem::path& path, const Format& format, const Image& image) {
  const std::string channels = image.has_alpha() ? "an alpha channel" : (image.channels() == 1 ? "grey" : "colours");
  const std::string refused = format.holds_depth(image.depth()) ? channels : describe(image.depth()) + " pixels";
  std::vector<std::string> fit;
  for (const Format& other : formats())
    if (other.holds(image)) fit.push_back(other.extensions.front());
  throw InputError(failure_of(path) + extension_of(path) + " does not hold " + refused +
                   "; what does for this image: " + joined(fit));
}

/// In OpenCV's order of channels, of which it writes 1, 3 or 4.
cv::Mat for_opencv(const Image& image) {
  if (image.channels() == 1) return images::mat_of(image);
  cv::Mat pixels;
  cv::cvtColor(images::mat_of(images::with_colours(image)), pixels,
               image.has_alpha() ? cv::COLOR_RGBA2BGRA : cv::COLOR_RGB2BGR);
  return pixels;
}

}  // namespace

void check_image_extension(const std::filesystem::path& path) { find_format(path); }

void write_image(const std::filesystem::path& path, const Image& image) {
  if (image.empty()) throw InputError(failure_of(path) + "there is no image");
  const Format& format = find_format(path);
  if (!format.holds(image)) fail_to_hold(path, format, image);
  // LZW named, not left to OpenCV: without a name it writes float colours in the lossy LogLuv.
  constexpr int kLzw = 5;
  std::vector<unsigned char> bytes;
  bool is_encoded = false;
  try {
    is_encoded =
        cv::imencode(format.extensions.front(), for_opencv(image), bytes, {cv::IMWRITE_TIFF_COMPRESSION, kLzw});
  } catch (const cv::Exception&) {
    is_encoded = false;
  }
  if (!is_encoded)
    throw InputError(failure_of(path) + extension_of(path) + " does not take " + std::to_string(image.width()) + " x " +
                     std::to_string(image.height()) + " pixels");
  write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace pulson
