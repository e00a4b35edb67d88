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
#include "pulson/images/pages.hpp"

namespace pulson {

/// A picture and, if its file says so, the positions of its pixels.
struct Picture {
  images::Image image;  ///< the first page for show, which has its size
  std::optional<Frame> frame;
  std::vector<images::Page> pages;  ///< the numbers of the file, which are warped

  /// How the stored pixels are to be displayed, as EXIF and TIFF number it.
  int orientation() const { return pages.front().about.orientation; }
};

/// The pixels of all pages.
std::vector<const images::Image*> pages_of(const Picture& picture);

/// The picture as displayed: all pages turned, orientation 1.
Picture oriented(const Picture& stored);

/// In lower case, with its dot.
std::string extension_of(const std::filesystem::path& path);

/// Whether the extension is that of a grid of numbers: mha, nrrd.
bool is_grid_file(const std::filesystem::path& path);
/// Whether it is that of a picture or grid, or of a picture of another kind, which reading names.
bool is_picture_file(const std::filesystem::path& path);

/// Whether the format holds an alpha channel: png, tif.
bool keeps_alpha(const std::filesystem::path& path);

/// Notes on what is not taken as it is are printed. @throws InputError, before the picture is decoded where it has more
/// than max_pixels
Picture read_picture(const std::filesystem::path& path, std::int64_t max_pixels);

/// Whether a picture can be written there, as far as can be checked. @throws InputError if not
void check_picture_file(const std::filesystem::path& path);

/// Whether its numbers name something, so that they have no means: a palette's, and those that are said to be labels.
bool has_labels(const Picture& picture, images::Interpolation interpolation);

/// Before a warp: whether what it makes of the picture can be written there. @throws InputError where pages are not of
/// one kind, or the format cannot hold them; it names those that can
void check_result_picture(const std::filesystem::path& path, const Picture& picture,
                          images::Interpolation interpolation);

/// 8 bits for pixels that are measurements, signed, floating-point or of 32 bits and more, from the lowest to the
/// highest; others as they are.
images::Image for_show(const images::Image& image);

/// For a drawing.
draw::Raster raster_of(const images::Image& image);
/// For a page, on white.
html::EncodedPicture jpeg_of(const images::Image& image);

/// The pages of the picture with other pixels.
std::vector<images::Page> pages_with(const Picture& picture, std::vector<images::Image> images);

/// Numbers as they are, with what the format holds beside them. Formats without alpha take the picture on white, which
/// a note says. @throws InputError where the format cannot hold them
void write_picture(const std::filesystem::path& path, std::vector<images::Page> pages, const Frame& frame);
void write_picture(const std::filesystem::path& path, const images::Image& image, const Frame& frame);

/// Whether numbers of pixels are written there as such, and not as colours: tif, mha, nrrd.
bool holds_numbers(const std::filesystem::path& path);

/// White where the mask is.
void write_mask(const std::filesystem::path& path, const std::vector<bool>& mask, int width, int height);

/// Displacements in landmark units, two numbers a pixel.
void write_displacements(const std::filesystem::path& path, std::vector<float> values, int width, int height,
                         const Frame& frame);

}  // namespace pulson
