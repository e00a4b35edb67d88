#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/fields/grid_fields.hpp"
#include "pulson/images/image.hpp"
#include "pulson/images/image_warp.hpp"

namespace pulson {

/// A picture and, if its file says so, the positions of its pixels and the type of its numbers.
struct Picture {
  images::Image image;
  std::optional<Frame> frame;
  std::optional<fields::GridType> type;  ///< of grids, which have more types than an Image
};

/// In lower case, with its dot.
std::string extension_of(const std::filesystem::path& path);

/// Whether the extension is that of a grid of numbers: mha, nrrd.
bool is_grid_file(const std::filesystem::path& path);
/// Whether it is that of a picture or grid.
bool is_picture_file(const std::filesystem::path& path);

/// Whether the format holds an alpha channel: png, tif.
bool keeps_alpha(const std::filesystem::path& path);

/// @throws InputError, before the picture is decoded where it has more than max_pixels
Picture read_picture(const std::filesystem::path& path, std::int64_t max_pixels);

/// "3 of 4 landmarks lie outside a.png: …", for they show that units, origin or y are not those of the image; none
/// where all lie on it. @param pixels of the landmarks
std::optional<std::string> landmarks_outside(const Points& pixels, const images::Image& image,
                                             const std::filesystem::path& path);

/// Whether a picture can be written there, as far as can be checked. @throws InputError if not
void check_picture_file(const std::filesystem::path& path);

/// 8 bits for pixels that are floating-point numbers, from the lowest to the highest; others as they are.
images::Image for_show(const images::Image& image);

/// For a drawing.
draw::Raster raster_of(const images::Image& image);
/// For a page, on white.
html::EncodedPicture jpeg_of(const images::Image& image);

/// Formats without alpha take the picture on white. Grids take one channel, in numbers of `type`, else of the image's
/// depth; floating-point pixels that a format cannot hold are scaled from their range to 8 bits.
void write_picture(const std::filesystem::path& path, const images::Image& image, const Frame& frame,
                   std::optional<fields::GridType> type = std::nullopt);

/// Whether numbers of pixels are written there as such, and not as colours: tif, mha, nrrd.
bool holds_numbers(const std::filesystem::path& path);

/// White where the mask is.
void write_mask(const std::filesystem::path& path, const std::vector<bool>& mask, int width, int height);

/// Displacements in landmark units, two numbers a pixel.
void write_displacements(const std::filesystem::path& path, std::vector<float> values, int width, int height,
                         const Frame& frame);

}  // namespace pulson
