// By libjpeg, which leaves a function on errors by longjmp here: those that call setjmp have no objects with
// destructors.

#include <csetjmp>
#include <cstddef>
#include <cstdio>  // jpeglib.h needs it
#include <cstdlib>

#include <jerror.h>
#include <jpeglib.h>

#include "codecs.hpp"

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

bool read_header(JpegReader& reader, std::string_view bytes) {
  if (setjmp(reader.errors.place) != 0) return false;
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

bool write_all(JpegWriter& writer, const Image& image) {
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
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* place = const_cast<unsigned char*>(row(image, static_cast<int>(jpeg.next_scanline)));  // it reads them alone
    jpeg_write_scanlines(&jpeg, &place, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

/// As Adobe's programs write it: 255 is no ink.
Image from_cmyk(const Image& inks) {
  Image image(inks.width(), inks.height(), 3, PixelDepth::kUint8);
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

Image decode_jpeg(std::string_view bytes, std::int64_t max_pixels) {
  JpegReader reader;
  if (!read_header(reader, bytes)) fail_as_damaged();
  const int components = reader.jpeg.num_components;
  Image image = new_image(reader.jpeg.image_width, reader.jpeg.image_height,
                          components == 4 ? 4 : (components == 1 ? 1 : 3), PixelDepth::kUint8, max_pixels);
  if (!read_pixels(reader, image)) fail_as_damaged();
  return components == 4 ? from_cmyk(image) : image;
}

std::string encode_jpeg(const Image& image) {
  JpegWriter writer;
  if (!write_all(writer, image)) return "";
  return {reinterpret_cast<const char*>(writer.bytes), writer.size};
}

}  // namespace pulson::images
