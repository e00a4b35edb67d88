#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/images/image.hpp"

namespace pulson::images {

/// Pixels per unit of length; without a unit, only the ratio of the two says something.
struct Resolution {
  enum class Unit : std::uint8_t { kNone, kInch, kCentimetre };
  double x = 0;
  double y = 0;
  Unit unit = Unit::kInch;
  friend bool operator==(const Resolution&, const Resolution&) = default;
};

/// A TIFF tag of which this library knows nothing, but that it copies: its numbers as they are in memory.
struct TiffTag {
  std::uint32_t tag = 0;
  int type = 0;  ///< as TIFF numbers them
  std::string bytes;
  friend bool operator==(const TiffTag&, const TiffTag&) = default;
};

/// What a file says beside its pixels.
struct PageMetadata {
  /// Of pictures whose numbers name colours: red, green, blue and opacity of each, 0 to 65535.
  std::vector<std::array<std::uint16_t, 4>> palette = {};
  int compression = 0;         ///< of tif, mha and nrrd, as TIFF numbers it; 0: the file does not say
  bool has_planes = false;     ///< of tif: one channel after the other
  bool white_is_zero = false;  ///< of grey ones in tif
  bool is_cmyk = false;        ///< the channels are inks, the highest value all of one
  std::optional<Resolution> resolution = std::nullopt;
  int orientation = 1;           ///< 1 to 8, as EXIF and TIFF number them: how the stored pixels are to be displayed
  std::string description = {};  ///< TIFF's ImageDescription, which ImageJ and OME write into, or a comment in jpg
  std::string profile = {};      ///< of ICC, which says what the colours are
  std::string exif = {};         ///< a TIFF file without a picture, of a jpg
  std::vector<std::uint16_t> extra_samples = {};  ///< TIFF's kinds of the channels beside the colours
  std::vector<TiffTag> tiff_tags = {};
  std::string png_chunks = {};                               ///< texts and colours of a png, as they are in the file
  std::vector<std::pair<int, std::string>> jpeg_segments{};  ///< of other programs: XMP, IPTC
  std::vector<std::pair<std::string, std::string>> lines{};  ///< keys and values of the header of mha or nrrd
  std::string kind = {};                                     ///< of the channels, as nrrd names them
  friend bool operator==(const PageMetadata&, const PageMetadata&) = default;

  bool has_palette() const { return !palette.empty(); }
};

/// One picture of a file, with the numbers that are stored: indices where there is a palette, not turned.
struct Page {
  Image image;
  PageMetadata about = {};
  friend bool operator==(const Page&, const Page&) = default;
};

struct PictureFile {
  std::vector<Page> pages;
  std::vector<std::string> notes = {};  ///< on what was not taken from the file as it is
};

/// All pages of a file of format png, jpg, tif, bmp, pgm or ppm, recognised by its contents, not its name, as they are
/// stored. Only colours that tif has in other ways (YCbCr, CIELab) are converted, and numbers of pgm and ppm whose
/// highest value is not 2^bits − 1 scaled, which notes say; smaller copies of a page are left out with a note. Files of
/// more pixels in all pages than `max_pixels` are refused by what their headers say, before they are decoded; so are
/// those whose numbers take more than 16 bytes for each of these.
/// @throws InputError if the file is missing, no regular file, not a picture, truncated, or larger than 2^20 pixels on
/// a side, 2^30 or `max_pixels` in all; files of known other kinds are named
PictureFile read_pages(const std::filesystem::path& path, std::int64_t max_pixels = kMaxPixels);
PictureFile decode_pages(std::string_view bytes, std::int64_t max_pixels = kMaxPixels);

/// Writes pictures in the format of the extension: .png (8 or 16 bits and fewer, palette, alpha), .tif or .tiff (all
/// types, channels and pages), .jpg or .jpeg (8 bits, quality 95), with what the format can say beside the pixels. The
/// file holds all or what it held before. @throws InputError for another extension, for pages that the format cannot
/// hold (names those that can), or if the file cannot be written
void write_pages(const std::filesystem::path& path, std::span<const Page> pages);
std::string encode_pages(std::span<const Page> pages, const std::string& extension);

/// Whether pages of this kind can be written there: @throws InputError as write_pages if not. Looks at no pixels.
void check_pages(const std::filesystem::path& path, std::span<const Page> pages);

/// The picture in grey or in red, green and blue, with straight alpha, as a program displays it but not turned: with
/// the colours of its palette, its highest value at that of its type, and the first of channels that are no colours.
Image shown(const Page& page);

/// The page as displayed, so that its orientation is 1.
Page oriented(const Page& stored);

}  // namespace pulson::images
