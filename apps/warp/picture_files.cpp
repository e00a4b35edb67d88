#include "picture_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "images/compose.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

namespace {

bool holds_floats(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".tif" || extension == ".tiff";
}

fields::GridType grid_type_of(images::PixelType depth) {
  if (depth == images::PixelType::kUint8) return fields::GridType::kUint8;
  return depth == images::PixelType::kUint16 ? fields::GridType::kUint16 : fields::GridType::kFloat32;
}

/// Of the numbers' own depth where Image has it.
images::Image image_of(const fields::GridField& grid) {
  const int width = grid.sizes[0], height = grid.sizes[1];
  const std::span<const float> values = grid.values;
  if (grid.type == fields::GridType::kUint8)
    return {width, height, 1, std::span<const std::uint8_t>(std::vector<std::uint8_t>(values.begin(), values.end()))};
  if (grid.type == fields::GridType::kUint16)
    return {width, height, 1, std::span<const std::uint16_t>(std::vector<std::uint16_t>(values.begin(), values.end()))};
  return {width, height, 1, values};
}

fields::GridField grid_of(std::vector<float> values, int components, int width, int height, const Frame& frame) {
  // With y up the rows go downwards all the same: their direction is negative.
  fields::GridField grid{{width, height},
                         {frame.unit_per_pixel[0], frame.unit_per_pixel[1]},
                         {frame.origin[0], frame.origin[1]},
                         components,
                         std::move(values)};
  if (!frame.y_down) {
    grid.origin[1] += frame.unit_per_pixel[1] * frame.height;
    grid.direction = Eigen::Vector2d(1, -1).asDiagonal();
  }
  return grid;
}

Frame frame_of(const std::filesystem::path& path, const fields::GridField& grid) {
  if (grid.direction.size() > 0 && !grid.direction.isIdentity(1e-9))
    throw InputError(path.string() + ": its axes are turned; only images along the axes are read");
  return {{grid.origin[0], grid.origin[1]}, {grid.spacing[0], grid.spacing[1]}};
}

template <class Value>
void blend_on_white(const images::Image& image, images::Image& result) {
  const auto channels = static_cast<std::size_t>(image.channels());
  const double full = full_value(image.type());
  const auto from = image.values<Value>();
  const auto to = result.values<Value>();
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    for (std::size_t c = 0; c + 1 < channels; ++c) {
      const double opacity = static_cast<double>(from[(i + 1) * channels - 1]) / full;
      const double value = opacity * static_cast<double>(from[i * channels + c]) + (1 - opacity) * full;
      to[i * (channels - 1) + c] = static_cast<Value>(std::is_floating_point_v<Value> ? value : std::round(value));
    }
}

images::Image on_white(const images::Image& image) {
  images::Image result(image.width(), image.height(), image.channels() - 1, image.type());
  if (image.type() == images::PixelType::kUint8) blend_on_white<std::uint8_t>(image, result);
  if (image.type() == images::PixelType::kUint16) blend_on_white<std::uint16_t>(image, result);
  if (image.type() == images::PixelType::kFloat32) blend_on_white<float>(image, result);
  return result;
}

}  // namespace

bool is_grid_file(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".mha" || extension == ".nrrd";
}

bool is_picture_file(const std::filesystem::path& path) {
  static constexpr std::array kExtensions = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm"};
  return is_grid_file(path) ||
         std::find(kExtensions.begin(), kExtensions.end(), extension_of(path)) != kExtensions.end();
}

bool holds_numbers(const std::filesystem::path& path) { return is_grid_file(path) || holds_floats(path); }

bool keeps_alpha(const std::filesystem::path& path) { return extension_of(path) == ".png" || holds_floats(path); }

Picture read_picture(const std::filesystem::path& path, std::int64_t max_pixels) {
  if (!is_grid_file(path)) return {images::read_image(path, max_pixels), std::nullopt, std::nullopt};
  const fields::GridField grid = fields::read_grid_field(path, static_cast<std::uint64_t>(max_pixels));
  if (grid.sizes.size() != 2 || grid.components != 1)
    throw InputError(path.string() + ": an image of the plane with one number for each pixel is needed");
  return {image_of(grid), frame_of(path, grid), grid.type};
}

std::optional<std::string> landmarks_outside(const Points& pixels, const images::Image& image,
                                             const std::filesystem::path& path) {
  Eigen::Index outside = 0;
  for (const auto pixel : pixels.colwise())
    outside += (pixel.array() < -1).any() || pixel[0] > image.width() || pixel[1] > image.height();
  if (outside == 0) return std::nullopt;
  return fmt::format(
      "{} of {} landmarks lie outside {}: check that it is the right image, and see --pixel-size, "
      "--origin and --flip-y",
      outside, pixels.cols(), path.string());
}

void check_picture_file(const std::filesystem::path& path) {
  check_output_file(path);
  if (!is_grid_file(path)) images::check_image_extension(path);
}

images::Image for_show(const images::Image& image) {
  if (image.type() != images::PixelType::kFloat32) return image;
  const auto values = image.values<float>();
  const auto channels = static_cast<std::size_t>(image.channels());
  const auto is_alpha = [&](std::size_t i) { return image.has_alpha() && i % channels == channels - 1; };
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (is_alpha(i) || !std::isfinite(values[i])) continue;
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  std::vector<std::uint8_t> bytes;
  bytes.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float part = is_alpha(i) ? values[i] : high > low ? (values[i] - low) / (high - low) : 0;
    bytes.push_back(
        static_cast<std::uint8_t>(std::isfinite(part) ? std::lround(255 * std::clamp(part, 0.0F, 1.0F)) : 0));
  }
  return {image.width(), image.height(), image.channels(), std::span<const std::uint8_t>(bytes)};
}

draw::Raster raster_of(const images::Image& image) {
  const images::Image shown = to_rgba8(for_show(image));
  const auto values = shown.values<std::uint8_t>();
  return {shown.width(), shown.height(), {values.begin(), values.end()}};
}

html::EncodedPicture jpeg_of(const images::Image& image) {
  return {html::MediaType::kJpeg, encode_image(on_white(to_rgba8(for_show(image))), ".jpg")};
}

void write_picture(const std::filesystem::path& path, const images::Image& image, const Frame& frame,
                   std::optional<fields::GridType> type) {
  if (is_grid_file(path)) {
    if (image.channels() > 2) throw InputError(path.string() + ": only grey images are written as .mha or .nrrd");
    std::vector<float> values(image.pixel_count());
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>(image.at(static_cast<int>(i % static_cast<std::size_t>(image.width())),
                                              static_cast<int>(i / static_cast<std::size_t>(image.width())), 0));
    fields::GridField grid = grid_of(std::move(values), 1, image.width(), image.height(), frame);
    grid.type = type.value_or(grid_type_of(image.type()));
    write_grid_field(path, grid);
  } else {
    const bool is_whole = image.type() != images::PixelType::kFloat32 || holds_floats(path);
    const images::Image scaled = is_whole ? images::Image() : for_show(image);
    const images::Image& shown = is_whole ? image : scaled;
    if (keeps_alpha(path) || !image.has_alpha())
      write_image(path, shown);
    else
      write_image(path, on_white(shown));
  }
}

void write_mask(const std::filesystem::path& path, const std::vector<bool>& mask, int width, int height) {
  std::vector<std::uint8_t> bytes(mask.size());
  std::transform(mask.begin(), mask.end(), bytes.begin(), [](bool is_in) { return is_in ? 255 : 0; });
  write_image(path, images::Image(width, height, 1, std::span<const std::uint8_t>(bytes)));
}

void write_displacements(const std::filesystem::path& path, std::vector<float> values, int width, int height,
                         const Frame& frame) {
  write_grid_field(path, grid_of(std::move(values), 2, width, height, frame));
}

}  // namespace pulson
