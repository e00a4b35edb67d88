#include "page_pictures.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "pulson/core/errors.hpp"
#include "warp/picture_files.hpp"

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

bool is_plain_name(const std::string& name) {
  return !name.empty() && name.size() < 200 && name[0] != '.' && name.find('/') == std::string::npos &&
         name.find('\\') == std::string::npos && name.find('\0') == std::string::npos;
}

}  // namespace

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
