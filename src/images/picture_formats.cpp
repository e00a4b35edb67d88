// The formats of picture files: how they are recognised, and what each can hold.

#include <algorithm>
#include <new>
#include <string_view>

#include "channels.hpp"
#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "core/text.hpp"
#include "images/codecs/codecs.hpp"
#include "images/other_kinds.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/images/pages.hpp"

namespace pulson::images {
namespace {

using namespace std::string_view_literals;

/// Which pictures a format holds.
struct Capacity {
  bool alpha;
  bool any;               ///< all types and numbers of channels, and many pages
  bool wide;              ///< 16 bits
  std::vector<int> bits;  ///< of grey and of palettes
  bool palette, transparent_palette;
};

/// How files of a format begin, what it holds, and how it is read and written. The last two are of formats that are
/// written.
struct Format {
  std::vector<std::string> extensions;
  std::vector<std::string_view> signatures;
  PictureFile (*decode)(std::string_view bytes, std::int64_t max_pixels);
  std::string (*encode)(std::span<const Page> pages) = nullptr;
  Capacity capacity{};

  bool begins(std::string_view bytes) const {
    return std::any_of(signatures.begin(), signatures.end(), [&](auto start) { return bytes.starts_with(start); });
  }
};

const std::vector<Format>& formats() {
  static const std::vector<Format> kFormats{
      {{".png"}, {"\x89PNG"sv}, decode_png, encode_png, {true, false, true, {1, 2, 4, 8, 16}, true, true}},
      {{".tif", ".tiff"},
       {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv},
       decode_tiff,
       encode_tiff,
       {true, true, true, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}, true, false}},
      {{".jpg", ".jpeg"}, {"\xFF\xD8\xFF"sv}, decode_jpeg, encode_jpeg, {false, false, false, {8}, false, false}},
      {{".bmp"}, {"BM"sv}, decode_bmp},
      {{".pgm", ".ppm"}, {"P1"sv, "P2"sv, "P3"sv, "P4"sv, "P5"sv, "P6"sv}, decode_pnm}};
  return kFormats;
}

std::string range_of(const PixelFormat& format) {
  const int bits = bits_of(format);
  return bits > 0 ? std::to_string(bits) + "-bit pixels"
                  : "numbers from 0 to " + std::to_string(static_cast<int>(format.full));
}

/// What a format does not hold of the numbers' type and highest value; empty: it does.
std::string refused_type(const Capacity& capacity, const Page& page) {
  const PixelFormat& format = page.image.format();
  const bool is_byte = format.type == PixelType::kUint8;
  const bool is_plain = is_byte || format.type == PixelType::kUint16;
  if (!is_plain) return capacity.any ? "" : describe(format.type) + " pixels";
  if (!is_byte && !capacity.wide) return range_of(format);
  const int bits = bits_of(format);
  const bool is_known = std::find(capacity.bits.begin(), capacity.bits.end(), bits) != capacity.bits.end();
  const bool may_have_fewer = capacity.any || format.channels == 1;
  return is_known && (may_have_fewer || format.full == full_value(format.type)) ? "" : range_of(format);
}

std::string refused_palette(const Capacity& capacity, const Page& page) {
  const auto& palette = page.about.palette;
  if (!capacity.palette) return "a palette";
  if (page.image.type() != PixelType::kUint8 && !capacity.any) return "a palette of so many colours";
  const auto is_transparent = [](const auto& colour) { return colour[3] != 0xFFFF; };
  const bool has_transparent = std::any_of(palette.begin(), palette.end(), is_transparent);
  return has_transparent && !capacity.transparent_palette ? "a palette with transparent colours" : "";
}

/// What a format does not hold of the channels; empty: it does.
std::string refused_channels(const Capacity& capacity, const Page& page) {
  const PixelFormat& format = page.image.format();
  if (capacity.any) return "";
  if (page.about.is_cmyk) return "inks (CMYK)";
  const std::size_t more = page.about.extra_samples.size() - (format.has_alpha() && !page.about.extra_samples.empty());
  if (more > 0 || (format.colours() != 1 && format.colours() != 3))
    return std::to_string(format.channels) + " channels" + (format.has_alpha() ? "" : " without alpha");
  if (format.alpha == Alpha::kAssociated) return "colours multiplied by alpha";
  if (format.has_alpha() && !capacity.alpha) return "an alpha channel";
  return "";
}

std::string refused_of(const Capacity& capacity, std::span<const Page> pages) {
  if (pages.size() > 1 && !capacity.any) return text::counted(pages.size(), "page");
  for (const Page& page : pages) {
    std::string refused = refused_type(capacity, page);
    if (refused.empty() && page.about.has_palette()) refused = refused_palette(capacity, page);
    if (refused.empty()) refused = refused_channels(capacity, page);
    if (!refused.empty()) return refused;
  }
  return "";
}

std::string extension_of(const std::filesystem::path& path) { return text::to_lower(path.extension().string()); }

std::string failure_of(const std::filesystem::path& path) { return "cannot write '" + path.string() + "': "; }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// That is written.
const Format& find_format(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  std::vector<std::string> known;
  for (const Format& format : formats())
    for (const std::string& name : format.extensions) {
      if (format.encode == nullptr) continue;
      if (name == extension) return format;
      known.push_back(name);
    }
  const std::string found = extension.empty() ? "it has no extension"
                                              : "no image format that is written has the extension '" + extension + "'";
  throw InputError(failure_of(path) + found + "; valid: " + joined(known));
}

const Format& fitting_format(const std::filesystem::path& path, std::span<const Page> pages) {
  if (pages.empty() || pages.front().image.empty()) throw InputError(failure_of(path) + "there is no image");
  const Format& format = find_format(path);
  const std::string refused = refused_of(format.capacity, pages);
  if (refused.empty()) return format;
  std::vector<std::string> fit;
  for (const Format& other : formats())
    if (other.encode != nullptr && refused_of(other.capacity, pages).empty()) fit.push_back(other.extensions.front());
  throw InputError(failure_of(path) + extension_of(path) + " does not hold " + refused +
                   "; what does for this image: " + (fit.empty() ? "none" : joined(fit)));
}

std::string encoded(const std::filesystem::path& path, std::span<const Page> pages) {
  const Format& format = fitting_format(path, pages);
  // Only tif says that 0 is white; the same picture says it in other numbers.
  const bool is_turned = pages.front().about.white_is_zero && !format.capacity.any;
  Page turned;
  if (is_turned) turned = with_black_as_zero(pages.front());
  std::string bytes = format.encode(is_turned ? std::span<const Page>(&turned, 1) : pages);
  const Image& image = pages.front().image;
  if (bytes.empty())
    throw InputError(failure_of(path) + extension_of(path) + " does not take " + std::to_string(image.width()) + " x " +
                     std::to_string(image.height()) + " pixels");
  return bytes;
}

}  // namespace

void fail_as_damaged() { throw InputError("the image is damaged or cut off"); }

int bits_of(const PixelFormat& format) {
  const int most = static_cast<int>(8 * byte_count(format.type));
  for (int bits = most > 8 ? 9 : 1; bits <= std::min(most, 16); ++bits)
    if (format.full == (1 << bits) - 1) return bits;
  return 0;
}

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

Image new_image(std::int64_t width, std::int64_t height, const PixelFormat& format, std::int64_t max_pixels) {
  check_size(width, height, max_pixels);
  constexpr std::int64_t kMostBytes = 16;  // four floating-point numbers of 32 bits
  const auto size = format.channels * static_cast<std::int64_t>(byte_count(format.type));
  if (size > kMostBytes && width * height > max_pixels / size * kMostBytes)
    throw InputError("the image has " + std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                     std::to_string(size) +
                     " bytes, more than 16 for each of `max_pixels = " + std::to_string(max_pixels) + "`");
  return {static_cast<int>(width), static_cast<int>(height), format};
}

PictureFile decode_pages(std::string_view bytes, std::int64_t max_pixels) try {
  for (const Format& format : formats())
    if (format.begins(bytes)) return format.decode(bytes, max_pixels);
  const std::string kind = other_kind(bytes);
  if (!kind.empty()) throw InputError("it is " + kind);
  throw InputError("it is not an image; it must be a png, jpg, tif, bmp, pgm or ppm");
} catch (const std::bad_alloc&) {
  throw InputError("the image does not fit into memory");
}

PictureFile read_pages(const std::filesystem::path& path, std::int64_t max_pixels) {
  const std::string bytes = read_file(path);
  if (bytes.empty()) throw InputError(path.string() + " is empty");
  try {
    return decode_pages(bytes, max_pixels);
  } catch (const InputError& error) {
    throw InputError("cannot read '" + path.string() + "': " + error.what());
  }
}

Image decode_image(std::string_view bytes, std::int64_t max_pixels) {
  return shown(decode_pages(bytes, max_pixels).pages.front());
}

Image read_image(const std::filesystem::path& path, std::int64_t max_pixels) {
  return shown(read_pages(path, max_pixels).pages.front());
}

void check_image_extension(const std::filesystem::path& path) { find_format(path); }

void check_pages(const std::filesystem::path& path, std::span<const Page> pages) { fitting_format(path, pages); }

std::string encode_pages(std::span<const Page> pages, const std::string& extension) {
  return encoded("image" + extension, pages);
}

void write_pages(const std::filesystem::path& path, std::span<const Page> pages) {
  write_file_atomically(path, encoded(path, pages));
}

std::string encode_image(const Image& image, const std::string& extension) {
  const Page page{image};
  return encode_pages({&page, 1}, extension);
}

void write_image(const std::filesystem::path& path, const Image& image) {
  const Page page{image};
  write_pages(path, {&page, 1});
}

}  // namespace pulson::images
