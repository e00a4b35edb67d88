// Images that claim to be larger than is allowed, and files without an end: refused before memory is taken.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zlib.h>

#include "image_examples.hpp"
#include "pulson/images/image.hpp"
#include "temporary_folder.hpp"

namespace pulson::images {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string big_endian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 255U);
  return bytes;
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  compress2(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
            Z_BEST_COMPRESSION);
  result.resize(size);
  return result;
}

std::string chunk(const std::string& name, const std::string& data) {
  const std::string named = name + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + named + big_endian(static_cast<std::uint32_t>(sum));
}

// Grey of 8 bits. @param more chunks before the pixels
std::string png_of(std::uint32_t width, std::uint32_t height, const std::string& pixels, const std::string& more = "") {
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", big_endian(width) + big_endian(height) + std::string("\x08\0\0\0\0", 5)) +
         more + chunk("IDAT", deflated(pixels)) + chunk("IEND", "");
}

std::string little_endian(std::uint32_t number, int width) {
  std::string bytes;
  for (int i = 0; i < width; ++i) bytes += static_cast<char>(number >> 8 * i & 255U);
  return bytes;
}

// Grey of 8 bits, its entries tag and value.
std::string tif_of(const std::vector<std::array<std::uint32_t, 2>>& entries) {
  std::string bytes = std::string("II*\0\x08\0\0\0", 8) + little_endian(static_cast<std::uint32_t>(entries.size()), 2);
  for (const auto& [tag, value] : entries)
    bytes += little_endian(tag, 2) + little_endian(4, 2) + little_endian(1, 4) + little_endian(value, 4);
  return bytes + little_endian(0, 4) + "pixels";
}

// The most memory that this process ever had, MB.
long memory_peak() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

class ImageLimits : public InTemporaryFolder {
 protected:
  static std::string error_of_reading(const std::string& bytes, std::int64_t max_pixels = kMaxPixels) {
    write("image", bytes);
    return error_of([&] { read_image("image", max_pixels); });
  }

  static void expect_too_large(const std::string& bytes, const std::string& size) {
    const long before = memory_peak();
    EXPECT_EQ(error_of_reading(bytes),
              "cannot read 'image': the image has " + size + " pixels, more than `max_pixels = 200000000` allows");
    EXPECT_LE(memory_peak() - before, 20) << "a hundredth of what these pixels take";
  }
};

TEST_F(ImageLimits, AreCheckedByTheHeaderOfEveryFormat) {
  expect_too_large(png_of(1'000'000, 1000, "nothing"), "1000000 x 1000");
  expect_too_large("P5\n20000 20000\n255\nabc", "20000 x 20000");
  expect_too_large("P3\n20000 20000\n255\n1 2 3", "20000 x 20000");
  expect_too_large("P4\n20000 20000\nabc", "20000 x 20000");
  std::string bmp = "BM" + std::string(8, '\0') + little_endian(54, 4) + little_endian(40, 4) +
                    little_endian(30'000, 4) + little_endian(30'000, 4) + little_endian(1, 2) + little_endian(24, 2) +
                    std::string(24, '\0');
  expect_too_large(bmp, "30000 x 30000");
  expect_too_large(tif_of({{256, 60'000}, {257, 60'000}, {258, 8}, {262, 1}, {273, 8}, {278, 60'000}, {279, 6}}),
                   "60000 x 60000");
  write_image("a.jpg", uneven_image(8, 8, 3, PixelType::kUint8));
  std::string jpg = contents("a.jpg");
  const std::size_t frame = jpg.find(std::string("\xFF\xC0", 2));
  ASSERT_NE(frame, std::string::npos);
  jpg.replace(frame + 5, 4, big_endian(65'000U << 16U | 65'000U));
  expect_too_large(jpg, "65000 x 65000");
}

TEST_F(ImageLimits, AreAsGiven) {
  write_image("a.png", uneven_image(8, 5, 3, PixelType::kUint8));
  EXPECT_EQ(read_image("a.png", 40).pixel_count(), 40U);
  EXPECT_EQ(error_of([] { read_image("a.png", 39); }),
            "cannot read 'a.png': the image has 8 x 5 pixels, more than `max_pixels = 39` allows");
  EXPECT_THAT(error_of([] { decode_image(contents("a.png"), 39); }), StartsWith("the image has 8 x 5 pixels"));
  EXPECT_EQ(decode_image(contents("a.png")), read_image("a.png"));
}

// What a file claims of its tiles, strips and texts is not believed either.
TEST_F(ImageLimits, AreThoseOfPartsOfAFile) {
  const long before = memory_peak();
  constexpr std::uint32_t kHuge = 0x40000000;
  EXPECT_THAT(error_of_reading(
                  tif_of({{256, 16}, {257, 16}, {258, 8}, {262, 1}, {322, kHuge}, {323, kHuge}, {324, 8}, {325, 6}})),
              StartsWith("cannot read 'image': the image "));
  EXPECT_EQ(error_of_reading(
                tif_of({{256, 16}, {257, 16}, {258, 8}, {262, 1}, {273, 8}, {278, 0xFFFFFFFF}, {279, 0xFFFFFFFF}})),
            "cannot read 'image': the image is damaged or cut off");
  const std::string bomb = chunk("zTXt", std::string("a\0\0", 3) + deflated(std::string(7'000'000, 'a')));
  std::string bombs;
  for (int i = 0; i < 100; ++i) bombs += bomb;
  write("image", png_of(2, 1, std::string("\0\x01\x02", 3), bombs));
  EXPECT_EQ(read_image("image"), image_u8(2, 1, 1, {1, 2}));
  EXPECT_LE(memory_peak() - before, 100) << "the texts take 700";
}

TEST_F(ImageLimits, FilesWithoutAnEndAreRefused) {
  ASSERT_EQ(mkfifo("pipe.png", 0600), 0);
  for (const std::string name : {"/dev/zero", "/dev/random", "pipe.png"})
    EXPECT_THAT(error_of([&] { read_image(name); }), StartsWith("cannot read '" + name + "': it is "));
}

}  // namespace
}  // namespace pulson::images
