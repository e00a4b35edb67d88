#include "picture_files.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "images/compose.hpp"
#include "images/rounding.hpp"
#include "pulson/core/errors.hpp"
#include "shell/messages.hpp"

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

// As TIFF numbers them.
constexpr int kNotCompressed = 1, kDeflate = 8;

images::Page page_of(fields::Grid grid) {
  images::Page page;
  page.image = images::Image(grid.sizes[0], grid.sizes[1],
                             {grid.components, grid.type, images::Alpha::kNone, images::full_value(grid.type)});
  std::copy(grid.bytes.begin(), grid.bytes.end(), page.image.bytes().begin());
  page.about.lines = std::move(grid.lines);
  page.about.compression = grid.is_compressed ? kDeflate : kNotCompressed;
  page.about.kind = std::move(grid.kind);
  return page;
}

/// With y up the rows go downwards all the same: their direction is negative.
template <class AnyGrid>
void place(AnyGrid& grid, const Frame& frame) {
  grid.spacing = {frame.unit_per_pixel[0], frame.unit_per_pixel[1]};
  grid.origin = {frame.origin[0], frame.origin[1]};
  if (frame.y_down) return;
  grid.origin[1] += frame.unit_per_pixel[1] * frame.height;
  grid.direction = Eigen::Vector2d(1, -1).asDiagonal();
}

void write_as_grid(const std::filesystem::path& path, std::vector<images::Page> pages, const Frame& frame) {
  if (pages.size() > 1 || pages.front().about.has_palette())
    throw InputError(fmt::format("cannot write '{}': {} does not hold {}; what does for this image: .tif",
                                 path.string(), extension_of(path),
                                 pages.size() > 1 ? fmt::format("{} pages", pages.size()) : "a palette"));
  images::Page& page = pages.front();
  fields::Grid grid;
  grid.sizes = {page.image.width(), page.image.height()};
  grid.components = page.image.channels();
  grid.type = page.image.type();
  grid.bytes.assign(page.image.bytes().begin(), page.image.bytes().end());
  grid.lines = std::move(page.about.lines);
  grid.is_compressed = page.about.compression != kNotCompressed;
  grid.kind = std::move(page.about.kind);
  place(grid, frame);
  write_grid(path, grid);
}

Frame frame_of(const std::filesystem::path& path, const fields::Grid& grid) {
  if (grid.direction.size() > 0 && !grid.direction.isIdentity(1e-9))
    throw InputError(path.string() + ": its axes are turned; only images along the axes are read");
  Frame frame{{grid.origin[0], grid.origin[1]}, {grid.spacing[0], grid.spacing[1]}};
  frame.says_units = true;
  return frame;
}

images::Image on_white(const images::Image& image) {
  images::PixelFormat format = image.format();
  --format.channels;
  format.alpha = images::Alpha::kNone;
  images::Image result(image.width(), image.height(), format);
  with_number_type(image.type(), [&]<class Value>() {
    const auto channels = static_cast<std::size_t>(image.channels());
    const auto from = image.values<Value>();
    const auto to = result.values<Value>();
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
      for (std::size_t c = 0; c + 1 < channels; ++c) {
        const double opacity = static_cast<double>(from[(i + 1) * channels - 1]) / format.full;
        const double value = opacity * static_cast<double>(from[i * channels + c]) + (1 - opacity) * format.full;
        to[i * (channels - 1) + c] = images::rounded<Value>(value, format.full);
      }
  });
  return result;
}

/// Whether an alpha channel is to be put on white.
bool needs_white(const std::filesystem::path& path, const images::Page& page) {
  return !is_grid_file(path) && !keeps_alpha(path) && page.image.format().alpha == images::Alpha::kStraight;
}

/// The kind of pages that are written, without their pixels.
std::vector<images::Page> kinds_of(const std::filesystem::path& path, const Picture& picture) {
  std::vector<images::Page> kinds;
  for (const images::Page& page : picture.pages) {
    images::PixelFormat format = page.image.format();
    if (needs_white(path, page)) {
      --format.channels;
      format.alpha = images::Alpha::kNone;
    }
    kinds.push_back({images::Image(1, 1, format), page.about});
  }
  return kinds;
}

void check_alike(const Picture& picture) {
  const images::Image& first = picture.pages.front().image;
  for (std::size_t i = 1; i < picture.pages.size(); ++i) {
    const images::Image& page = picture.pages[i].image;
    if (page.width() != first.width() || page.height() != first.height())
      throw InputError(
          fmt::format("page 1 of the picture has {} x {} pixels and page {} has {} x {}: one map cannot "
                      "warp both; save pages of one size in a file",
                      first.width(), first.height(), i + 1, page.width(), page.height()));
    if (page.format() != first.format() ||
        picture.pages[i].about.has_palette() != picture.pages.front().about.has_palette())
      throw InputError(
          fmt::format("pages 1 and {} of the picture differ in the type or the channels of their pixels; "
                      "save pages of one kind in a file",
                      i + 1));
    if (picture.pages[i].about.orientation != picture.orientation())
      throw InputError(fmt::format("pages 1 and {} of the picture say other orientations; save them alike", i + 1));
  }
}

/// OME's description says how large the pages are.
std::string with_size(std::string text, const std::string& name, int before, int after) {
  const std::string old = fmt::format(" {}=\"{}\"", name, before), now = fmt::format(" {}=\"{}\"", name, after);
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + now.size()))
    text.replace(at, old.size(), now);
  return text;
}

}  // namespace

bool is_grid_file(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".mha" || extension == ".nrrd";
}

bool is_picture_file(const std::filesystem::path& path) {
  static constexpr std::string_view kExtensions[] = {
      ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm",
      // of other kinds
      ".webp", ".gif", ".jp2", ".j2k", ".jxl", ".heic", ".heif", ".avif", ".svg", ".pdf", ".psd", ".xcf", ".dcm",
      ".nii", ".pbm", ".pam", ".pfm", ".exr", ".hdr", ".ico", ".cr2", ".cr3", ".nef", ".arw", ".dng", ".raf", ".orf",
      ".rw2", ".czi", ".lif", ".nd2", ".oib", ".ims", ".svs", ".ndpi", ".fits", ".mp4", ".mov"};
  const std::string extension = extension_of(path);
  const bool is_packed_volume = extension == ".gz" && extension_of(path.stem()) == ".nii";
  return is_grid_file(path) || is_packed_volume ||
         std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

bool holds_numbers(const std::filesystem::path& path) { return is_grid_file(path) || holds_floats(path); }

bool keeps_alpha(const std::filesystem::path& path) { return extension_of(path) == ".png" || holds_floats(path); }

Picture read_picture(const std::filesystem::path& path, std::int64_t max_pixels) {
  Picture picture;
  if (is_grid_file(path)) {
    fields::Grid grid = fields::read_grid(path, static_cast<std::uint64_t>(max_pixels));
    if (grid.sizes.size() != 2) throw InputError(path.string() + ": it is a volume; an image of the plane is needed");
    picture.frame = frame_of(path, grid);
    picture.pages.push_back(page_of(std::move(grid)));
  } else {
    images::PictureFile file = images::read_pages(path, max_pixels);
    picture.pages = std::move(file.pages);
    for (const std::string& note : file.notes) print_note(fmt::format("{}: {}", path.string(), note));
  }
  picture.image = shown(picture.pages.front());
  return picture;
}

std::vector<const images::Image*> pages_of(const Picture& picture) {
  std::vector<const images::Image*> pages;
  for (const images::Page& page : picture.pages) pages.push_back(&page.image);
  return pages;
}

Picture oriented(const Picture& stored) {
  Picture picture{{}, stored.frame, {}};
  for (const images::Page& page : stored.pages) picture.pages.push_back(images::oriented(page));
  picture.image = shown(picture.pages.front());
  return picture;
}

void check_picture_file(const std::filesystem::path& path) {
  check_output_file(path);
  if (!is_grid_file(path)) images::check_image_extension(path);
}

bool has_labels(const Picture& picture, images::Interpolation interpolation) {
  return interpolation == images::Interpolation::kLabel || picture.pages.front().about.has_palette();
}

void check_result_picture(const std::filesystem::path& path, const Picture& picture,
                          images::Interpolation interpolation) {
  check_alike(picture);
  const std::string extension = extension_of(path);
  if (has_labels(picture, interpolation) && (extension == ".jpg" || extension == ".jpeg"))
    throw InputError(
        fmt::format("cannot write '{}': {} changes numbers, and those of labels have to stay; .png, .tif, "
                    ".mha and .nrrd keep them",
                    path.string(), extension));
  const bool fits_grid = picture.pages.size() == 1 && !picture.pages.front().about.has_palette();
  if (is_grid_file(path) && fits_grid) return;
  try {
    if (is_grid_file(path)) return write_as_grid(path, kinds_of(path, picture), {});
    check_pages(path, kinds_of(path, picture));
  } catch (const InputError& error) {
    throw InputError(error.what() + std::string(fits_grid ? ", .mha, .nrrd" : ""));
  }
}

images::Image for_show(const images::Image& image) {
  if (image.type() == images::PixelType::kUint8 || image.type() == images::PixelType::kUint16) return image;
  images::Image result(image.width(), image.height(), image.channels(), images::PixelType::kUint8);
  with_number_type(image.type(), [&]<class Value>() {
    const auto values = image.values<Value>();
    const auto channels = static_cast<std::size_t>(image.channels());
    const auto is_alpha = [&](std::size_t i) { return image.has_alpha() && i % channels == channels - 1; };
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto value = static_cast<double>(values[i]);
      if (is_alpha(i) || !std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    const auto bytes = result.values<std::uint8_t>();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto value = static_cast<double>(values[i]);
      const double part = is_alpha(i) ? value / image.full() : high > low ? (value - low) / (high - low) : 0;
      bytes[i] = images::rounded<std::uint8_t>(std::isfinite(part) ? 255 * std::clamp(part, 0.0, 1.0) : 0.0, 255);
    }
  });
  return result;
}

draw::Raster raster_of(const images::Image& image) {
  const images::Image shown = to_rgba8(for_show(image));
  const auto values = shown.values<std::uint8_t>();
  return {shown.width(), shown.height(), {values.begin(), values.end()}};
}

html::EncodedPicture jpeg_of(const images::Image& image) {
  return {html::MediaType::kJpeg, encode_image(on_white(to_rgba8(for_show(image))), ".jpg")};
}

std::vector<images::Page> pages_with(const Picture& picture, std::vector<images::Image> images) {
  std::vector<images::Page> pages;
  for (std::size_t i = 0; i < images.size(); ++i) {
    images::Page page{std::move(images[i]), picture.pages[i].about};
    std::string& text = page.about.description;
    if (text.find("<OME") != std::string::npos) {
      text = with_size(std::move(text), "SizeX", picture.image.width(), page.image.width());
      text = with_size(std::move(text), "SizeY", picture.image.height(), page.image.height());
    }
    pages.push_back(std::move(page));
  }
  return pages;
}

void write_picture(const std::filesystem::path& path, std::vector<images::Page> pages, const Frame& frame) {
  if (is_grid_file(path)) return write_as_grid(path, std::move(pages), frame);
  bool is_put = false;
  for (images::Page& page : pages) {
    if (!needs_white(path, page)) continue;
    page.image = on_white(page.image);
    is_put = true;
  }
  if (is_put) print_note(fmt::format("{} holds no alpha channel: what is transparent is on white", path.string()));
  write_pages(path, pages);
}

void write_picture(const std::filesystem::path& path, const images::Image& image, const Frame& frame) {
  write_picture(path, std::vector{images::Page{image}}, frame);
}

void write_mask(const std::filesystem::path& path, const std::vector<bool>& mask, int width, int height) {
  std::vector<std::uint8_t> bytes(mask.size());
  std::transform(mask.begin(), mask.end(), bytes.begin(), [](bool is_in) { return is_in ? 255 : 0; });
  write_image(path, images::Image(width, height, 1, std::span<const std::uint8_t>(bytes)));
}

void write_displacements(const std::filesystem::path& path, std::vector<float> values, int width, int height,
                         const Frame& frame) {
  fields::GridField grid;
  grid.sizes = {width, height};
  grid.components = 2;
  grid.values = std::move(values);
  place(grid, frame);
  write_grid_field(path, grid);
}

}  // namespace pulson
