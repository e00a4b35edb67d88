// By libjpeg, which leaves a function on errors by longjmp here: those that call setjmp have no objects with
// destructors.

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstddef>
#include <cstdio>  // jpeglib.h needs it
#include <cstdlib>
#include <optional>

#include <jerror.h>
#include <jpeglib.h>

#include "codecs.hpp"
#include "exif.hpp"

namespace pulson::images {
namespace {

struct JpegErrors {
  jpeg_error_mgr manager;  ///< first: libjpeg knows this part alone
  std::jmp_buf place;
};

[[noreturn]] void leave(j_common_ptr jpeg) { std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->place, 1); }

/// The one warning that is an error to us: where a file ends too early, libjpeg makes up the rest.
void heed_end_of_file(j_common_ptr jpeg, int level) {
  if (level < 0 && jpeg->err->msg_code == JWRN_JPEG_EOF) leave(jpeg);
}

/// A progressive file may repeat scans of a few bytes, each of which takes as long as the whole image. Real files have
/// about ten; libjpeg-turbo's own tools are run with this limit on files that nobody vouches for.
constexpr int kMostScans = 500;

void heed_scans(j_common_ptr jpeg) {
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > kMostScans) leave(jpeg);
}

jpeg_error_mgr* set_up(JpegErrors& errors) {
  jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.emit_message = heed_end_of_file;
  return &errors.manager;
}

struct JpegReader {
  jpeg_decompress_struct jpeg{};
  JpegErrors errors{};
  jpeg_progress_mgr progress{};
  JpegReader() {
    jpeg.err = set_up(errors);
    jpeg_create_decompress(&jpeg);
    progress.progress_monitor = heed_scans;
    jpeg.progress = &progress;
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
};

struct JpegWriter {
  jpeg_compress_struct jpeg{};
  JpegErrors errors{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  JpegWriter() {
    jpeg.err = set_up(errors);
    jpeg_create_compress(&jpeg);
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&jpeg);
    std::free(bytes);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;
};

constexpr int kApplication = JPEG_APP0;
constexpr unsigned kLongestSegment = 0xFFFF;

bool read_header(JpegReader& reader, std::string_view bytes) {
  if (setjmp(reader.errors.place) != 0) return false;
  jpeg_save_markers(&reader.jpeg, JPEG_COM, kLongestSegment);
  for (const int i : {1, 2, 13}) jpeg_save_markers(&reader.jpeg, kApplication + i, kLongestSegment);
  jpeg_mem_src(&reader.jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&reader.jpeg, TRUE);
  const int components = reader.jpeg.num_components;
  if (components == 4)
    reader.jpeg.out_color_space = JCS_CMYK;
  else
    reader.jpeg.out_color_space = components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  return true;
}

bool read_pixels(JpegReader& reader, Image& image) {
  if (setjmp(reader.errors.place) != 0) return false;
  jpeg_start_decompress(&reader.jpeg);
  while (reader.jpeg.output_scanline < reader.jpeg.output_height) {
    unsigned char* place = row(image, static_cast<int>(reader.jpeg.output_scanline));
    jpeg_read_scanlines(&reader.jpeg, &place, 1);
  }
  jpeg_finish_decompress(&reader.jpeg);
  return true;
}

constexpr std::string_view kExif("Exif\0\0", 6), kProfile("ICC_PROFILE\0", 12), kPreviews("MPF\0", 4);

std::optional<Resolution> resolution_of(const jpeg_decompress_struct& jpeg) {
  if (jpeg.saw_JFIF_marker == FALSE || jpeg.X_density == 0 || jpeg.Y_density == 0) return std::nullopt;
  using enum Resolution::Unit;
  if (jpeg.density_unit == 0 && jpeg.X_density == jpeg.Y_density) return std::nullopt;  // it says nothing
  return Resolution{static_cast<double>(jpeg.X_density), static_cast<double>(jpeg.Y_density),
                    jpeg.density_unit == 1 ? kInch : (jpeg.density_unit == 2 ? kCentimetre : kNone)};
}

/// Parts of the profile are in the order of the file, as every program writes them.
void read_metadata(const jpeg_decompress_struct& jpeg, PageMetadata& about) {
  constexpr std::size_t kPartNumbers = 2;
  about.resolution = resolution_of(jpeg);
  for (const jpeg_marker_struct* marker = jpeg.marker_list; marker != nullptr; marker = marker->next) {
    const std::string_view data(reinterpret_cast<const char*>(marker->data), marker->data_length);
    if (marker->marker == JPEG_COM)
      about.description += data;
    else if (data.starts_with(kExif))
      about.exif = data.substr(kExif.size());
    else if (data.starts_with(kProfile))
      about.profile += data.substr(std::min(data.size(), kProfile.size() + kPartNumbers));
    else if (!data.starts_with(kPreviews))
      about.jpeg_segments.emplace_back(static_cast<int>(marker->marker), data);
  }
  about.orientation = exif_orientation(about.exif);
}

void write_segment(jpeg_compress_struct& jpeg, int marker, const char* data, std::size_t size) {
  if (size > 0 && size <= kLongestSegment - 2)
    jpeg_write_marker(&jpeg, marker, reinterpret_cast<const JOCTET*>(data), static_cast<unsigned>(size));
}

void set_density(jpeg_compress_struct& jpeg, const std::optional<Resolution>& resolution) {
  constexpr double kHighest = 0xFFFF;
  if (!resolution || !(resolution->x >= 1 && resolution->x <= kHighest) ||
      !(resolution->y >= 1 && resolution->y <= kHighest))
    return;
  using enum Resolution::Unit;
  jpeg.density_unit = resolution->unit == kInch ? 1 : (resolution->unit == kCentimetre ? 2 : 0);
  jpeg.X_density = static_cast<UINT16>(std::lround(resolution->x));
  jpeg.Y_density = static_cast<UINT16>(std::lround(resolution->y));
}

/// `exif` with its head.
bool write_all(JpegWriter& writer, const Image& image, const PageMetadata& about, const std::string& exif) {
  constexpr int kQuality = 95;
  if (setjmp(writer.errors.place) != 0) return false;
  jpeg_compress_struct& jpeg = writer.jpeg;
  jpeg_mem_dest(&jpeg, &writer.bytes, &writer.size);
  jpeg.image_width = static_cast<JDIMENSION>(image.width());
  jpeg.image_height = static_cast<JDIMENSION>(image.height());
  jpeg.input_components = image.channels();
  jpeg.in_color_space = image.channels() == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, kQuality, TRUE);
  set_density(jpeg, about.resolution);
  jpeg_start_compress(&jpeg, TRUE);
  write_segment(jpeg, kApplication + 1, exif.data(), exif.size());
  for (const auto& [marker, data] : about.jpeg_segments) write_segment(jpeg, marker, data.data(), data.size());
  if (!about.profile.empty())
    jpeg_write_icc_profile(&jpeg, reinterpret_cast<const JOCTET*>(about.profile.data()),
                           static_cast<unsigned>(about.profile.size()));
  write_segment(jpeg, JPEG_COM, about.description.data(), about.description.size());
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* place = const_cast<unsigned char*>(row(image, static_cast<int>(jpeg.next_scanline)));  // it reads them alone
    jpeg_write_scanlines(&jpeg, &place, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

/// As Adobe's programs write it: 255 is no ink.
Image from_cmyk(const Image& inks) {
  Image image(inks.width(), inks.height(), 3, PixelType::kUint8);
  const auto from = inks.values<std::uint8_t>();
  const auto to = image.values<std::uint8_t>();
  for (std::size_t i = 0; i < image.pixel_count(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const int black = from[4 * i + 3];
      to[3 * i + c] = static_cast<std::uint8_t>(black - (((255 - from[4 * i + c]) * black) >> 8));
    }
  return image;
}

}  // namespace

PictureFile decode_jpeg(std::string_view bytes, std::int64_t max_pixels) {
  JpegReader reader;
  if (!read_header(reader, bytes)) fail_as_damaged();
  const int components = reader.jpeg.num_components, channels = components == 4 ? 4 : (components == 1 ? 1 : 3);
  PictureFile file;
  Page& page = file.pages.emplace_back();
  page.image = new_image(reader.jpeg.image_width, reader.jpeg.image_height, {.channels = channels}, max_pixels);
  read_metadata(reader.jpeg, page.about);  // libjpeg forgets it with the last row
  if (!read_pixels(reader, page.image)) fail_as_damaged();
  if (components == 4) {
    page.image = from_cmyk(page.image);
    page.about.profile.clear();  // it is of inks
    file.notes.emplace_back("its inks (CMYK) were converted to red, green and blue");
  }
  return file;
}

std::string encode_jpeg(std::span<const Page> pages) {
  const PageMetadata& about = pages.front().about;
  std::string exif = exif_of(about.exif, about.orientation);
  if (!exif.empty()) exif.insert(0, kExif);
  JpegWriter writer;
  if (!write_all(writer, pages.front().image, about, exif)) return "";
  return {reinterpret_cast<const char*>(writer.bytes), writer.size};
}

}  // namespace pulson::images
