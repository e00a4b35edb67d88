#include "page_pictures.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "images/codecs/exif.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

constexpr double kMostShownPixels = 16e6;  // pixels, which browsers of small machines bear

// Means of squares of k×k pixels, in 8 bits.
images::Image reduced_picture(const images::Image& image, int k) {
  images::Image small((image.width() + k - 1) / k, (image.height() + k - 1) / k, image.channels(),
                      images::PixelType::kUint8);
  const auto out = small.values<std::uint8_t>();
  const double scale = 255 / image.full();
  std::size_t at = 0;
  for (int y = 0; y < small.height(); ++y)
    for (int x = 0; x < small.width(); ++x)
      for (int c = 0; c < image.channels(); ++c) {
        double sum = 0;
        int count = 0;
        for (int v = y * k; v < std::min((y + 1) * k, image.height()); ++v)
          for (int u = x * k; u < std::min((x + 1) * k, image.width()); ++u) sum += image.at(u, v, c), ++count;
        out[at++] = static_cast<std::uint8_t>(std::lround(std::clamp(scale * sum / count, 0.0, 255.0)));
      }
  return small;
}

std::string type_of(const std::string& bytes) {
  if (bytes.starts_with("\x89PNG")) return "image/png";
  if (bytes.starts_with("\xFF\xD8\xFF")) return "image/jpeg";
  return {};
}

/// Size and orientation of a jpg, by its segments up to the first of a frame (ITU T.81, B.1.1 and B.2.2); none where
/// this is no jpg, or an unusual one.
std::optional<images::Page> outline_of_jpeg(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const auto byte = [&] { return file.get(); };
  const auto word = [&] {
    const int high = byte(), low = byte();
    return high << 8 | low;
  };
  if (word() != 0xFFD8) return std::nullopt;
  images::Page page;
  while (file) {
    if (byte() != 0xFF) return std::nullopt;
    int marker = byte();
    while (marker == 0xFF) marker = byte();
    const int length = word() - 2;
    if (!file || length < 0) return std::nullopt;
    const bool is_frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame) {
      static_cast<void>(byte());  // bits of a sample
      const int height = word(), width = word();
      if (!file || width < 1 || height < 1) return std::nullopt;
      page.image = images::Image(width, height, 1, images::PixelType::kUint8);
      return page;
    }
    std::string data(static_cast<std::size_t>(length), '\0');
    if (marker == 0xE1) {
      file.read(data.data(), length);
      constexpr std::string_view kExif("Exif\0\0", 6);
      if (data.starts_with(kExif))
        page.about.orientation = images::exif_orientation(std::string_view(data).substr(kExif.size()));
    } else {
      file.seekg(length, std::ios::cur);
    }
  }
  return std::nullopt;
}

bool is_plain_name(const std::string& name) {
  return !name.empty() && name.size() < 200 && name[0] != '.' && name.find('/') == std::string::npos &&
         name.find('\\') == std::string::npos && name.find('\0') == std::string::npos;
}

}  // namespace

Picture outlined_picture(const std::string& path, std::int64_t max_pixels) {
  std::optional<images::Page> page = outline_of_jpeg(path);
  if (!page || static_cast<std::int64_t>(page->image.pixel_count()) > max_pixels) return read_picture(path, max_pixels);
  Picture picture;
  picture.image = page->image;
  picture.pages.push_back(std::move(*page));
  return picture;
}

ShownPicture shown_picture(const std::string& path, std::int64_t max_pixels) {
  const Picture stored = read_picture(path, max_pixels);
  const auto pixels = static_cast<double>(stored.image.pixel_count());
  if (stored.orientation() == 1 && pixels <= kMostShownPixels) {
    std::string bytes = read_file(path);
    if (const std::string type = type_of(bytes); !type.empty()) return {type, std::move(bytes)};
  }
  const Picture upright = stored.orientation() == 1 ? stored : oriented(stored);
  const images::Image image = for_show(upright.image);
  const int k = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kMostShownPixels))));
  return {"image/jpeg", jpeg_of(k > 1 ? reduced_picture(image, k) : image).bytes};
}

std::string keep_picture(const std::string& folder, const std::string& name, const std::string& bytes,
                         std::int64_t max_pixels) {
  if (!is_plain_name(name)) throw InputError("the name of the picture is no plain file name");
  try {
    images::decode_pages(bytes, max_pixels);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", name, error.what()));
  }
  const std::filesystem::path path = std::filesystem::path(folder) / name;
  if (is_file(path)) {
    if (read_file(path) == bytes) return name;
    throw InputError(fmt::format("{} is the name of another file beside the session; rename the picture", name));
  }
  write_file_atomically(path, bytes);
  return name;
}

}  // namespace pulson
