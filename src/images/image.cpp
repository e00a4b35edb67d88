#include "pulson/images/image.hpp"

#include <algorithm>
#include <new>
#include <string_view>

#include "channels.hpp"
#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "core/text.hpp"
#include "images/codecs/codecs.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {

std::size_t byte_count(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return 1;
  return depth == PixelDepth::kUint16 ? 2 : 4;
}

double full_value(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return 255;
  return depth == PixelDepth::kUint16 ? 65535 : 1;
}

std::string describe(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return "8-bit";
  return depth == PixelDepth::kUint16 ? "16-bit" : "32-bit floating-point";
}

Image::Image(int width, int height, int channels, PixelDepth depth)
    : width_(width), height_(height), channels_(channels), depth_(depth) {
  if (width <= 0 || height <= 0 || channels < 1 || channels > 4)
    throw InputError("image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                     std::to_string(channels) + " channels: sizes must be positive, and channels 1 to 4");
  bytes_.resize(pixel_count() * static_cast<std::size_t>(channels) * byte_count(depth));
}

void Image::copy_from(std::span<const std::byte> bytes) {
  if (bytes.size() != bytes_.size())
    throw InputError("image of " + std::to_string(width_) + " x " + std::to_string(height_) + " pixels: there are " +
                     std::to_string(bytes.size()) + " bytes for its " + std::to_string(bytes_.size()));
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
}

double Image::at(int x, int y, int channel) const {
  assert(x >= 0 && x < width_ && y >= 0 && y < height_ && channel >= 0 && channel < channels_);
  const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  const std::size_t index = pixel * static_cast<std::size_t>(channels_) + static_cast<std::size_t>(channel);
  if (depth_ == PixelDepth::kUint8) return values<std::uint8_t>()[index];
  return depth_ == PixelDepth::kUint16 ? values<std::uint16_t>()[index] : values<float>()[index];
}

namespace {

using namespace std::string_view_literals;

/// How files of a format begin, and which images it holds.
struct Format {
  std::vector<std::string> extensions;
  std::vector<std::string_view> signatures;
  bool grey, colour, alpha;
  std::vector<PixelDepth> depths;
  Image (*decode)(std::string_view bytes, std::int64_t max_pixels);
  std::string (*encode)(const Image& image);

  bool holds_depth(PixelDepth depth) const { return std::find(depths.begin(), depths.end(), depth) != depths.end(); }
  bool holds_channels(const Image& image) const {
    return image.has_alpha() ? alpha : (image.channels() == 1 ? grey : colour);
  }
  bool holds(const Image& image) const { return holds_depth(image.depth()) && holds_channels(image); }
  bool begins(std::string_view bytes) const {
    return std::any_of(signatures.begin(), signatures.end(), [&](auto start) { return bytes.starts_with(start); });
  }
};

const std::vector<Format>& formats() {
  using namespace images;
  using enum PixelDepth;
  static const std::vector<Format> kFormats{
      {{".png"}, {"\x89PNG"sv}, true, true, true, {kUint8, kUint16}, decode_png, encode_png},
      {{".tif", ".tiff"},
       {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv},
       true,
       true,
       true,
       {kUint8, kUint16, kFloat32},
       decode_tiff,
       encode_tiff},
      {{".jpg", ".jpeg"}, {"\xFF\xD8\xFF"sv}, true, true, false, {kUint8}, decode_jpeg, encode_jpeg},
      {{".bmp"}, {"BM"sv}, true, true, false, {kUint8}, decode_bmp, encode_bmp},
      {{".pgm"}, {"P1"sv, "P2"sv, "P4"sv, "P5"sv}, true, false, false, {kUint8, kUint16}, decode_pnm, encode_pnm},
      {{".ppm"}, {"P3"sv, "P6"sv}, false, true, false, {kUint8, kUint16}, decode_pnm, encode_pnm}};
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

std::string encoded(const std::filesystem::path& path, const Image& image) {
  if (image.empty()) throw InputError(failure_of(path) + "there is no image");
  const Format& format = find_format(path);
  if (!format.holds(image)) fail_to_hold(path, format, image);
  std::string bytes = format.encode(image.channels() == 2 ? images::with_colours(image) : image);
  if (bytes.empty())
    throw InputError(failure_of(path) + extension_of(path) + " does not take " + std::to_string(image.width()) + " x " +
                     std::to_string(image.height()) + " pixels");
  return bytes;
}

}  // namespace

void fail_as_damaged() { throw InputError("the image is damaged or cut off"); }

void check_pixel_count(std::int64_t width, std::int64_t height, std::int64_t max_pixels, const std::string& what) {
  if (width <= max_pixels / std::max<std::int64_t>(height, 1)) return;
  throw InputError(what + " has " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels, more than `max_pixels = " + std::to_string(max_pixels) + "` allows");
}

void check_size(std::int64_t width, std::int64_t height, std::int64_t max_pixels) {
  constexpr std::int64_t kLongest = 1LL << 20, kMost = 1LL << 30;
  if (width < 1 || height < 1) fail_as_damaged();
  check_pixel_count(width, height, max_pixels, "the image");
  if (width > kLongest || height > kLongest || width * height > kMost)
    throw InputError("the image has more than 2^20 pixels on a side, or more than 2^30");
}

Image new_image(std::int64_t width, std::int64_t height, int channels, PixelDepth depth, std::int64_t max_pixels) {
  check_size(width, height, max_pixels);
  return {static_cast<int>(width), static_cast<int>(height), channels, depth};
}

Image decode_image(std::string_view bytes, std::int64_t max_pixels) try {
  for (const Format& format : formats())
    if (format.begins(bytes)) return format.decode(bytes, max_pixels);
  throw InputError("it is not an image; it must be a png, jpg, tif, bmp, pgm or ppm");
} catch (const std::bad_alloc&) {
  throw InputError("the image does not fit into memory");
}

Image read_image(const std::filesystem::path& path, std::int64_t max_pixels) {
  const std::string bytes = read_file(path);
  if (bytes.empty()) throw InputError(path.string() + " is empty");
  try {
    return decode_image(bytes, max_pixels);
  } catch (const InputError& error) {
    throw InputError("cannot read '" + path.string() + "': " + error.what());
  }
}

void check_image_extension(const std::filesystem::path& path) { find_format(path); }

std::string encode_image(const Image& image, const std::string& extension) {
  return encoded("image" + extension, image);
}

void write_image(const std::filesystem::path& path, const Image& image) {
  write_file_atomically(path, encoded(path, image));
}

}  // namespace pulson::images
