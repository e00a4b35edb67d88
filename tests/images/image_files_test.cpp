// Images read from files and written to them.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "image_examples.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/images/image.hpp"
#include "pulson/images/pages.hpp"
#include "temporary_folder.hpp"

namespace pulson::images {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class ImageFiles : public InTemporaryFolder {
 protected:
  static std::string read_error(const std::string& name) {
    return error_of([&] { read_image(name); });
  }
  static std::string write_error(const std::string& name, const Image& image) {
    std::string message = error_of([&] { write_image(name, image); });
    EXPECT_EQ(count_entries(), 0u) << name;
    return message;
  }
  static Image rewritten(const std::string& name, const Image& image) {
    write_image(name, image);
    return read_image(name);
  }
};

// ---- round trips

TEST_F(ImageFiles, PngAndTifBringBackEveryKind) {
  for_every_kind(7, 5, [](const Image& image) {
    EXPECT_EQ(rewritten("a.tif", image), image) << name_of(image);
    if (image.type() == PixelType::kUint8 || image.type() == PixelType::kUint16) {
      EXPECT_EQ(rewritten("a.PNG", image), image) << name_of(image);
    }
  });
}

TEST_F(ImageFiles, JpgIsNearTheOriginal) {
  const Image grey = image_u8(2, 1, 1, {100, 110});
  const Image read = rewritten("a.jpeg", grey);
  EXPECT_EQ(read.channels(), 1);
  EXPECT_NEAR(read.at(0, 0, 0), 100, 4);
  const Image red = rewritten("b.jpg", image_u8(1, 1, 3, {200, 60, 20}));
  EXPECT_NEAR(red.at(0, 0, 0), 200, 8);
  EXPECT_NEAR(red.at(0, 0, 2), 20, 8);
}

TEST_F(ImageFiles, ChannelsAreInTheOrderRedGreenBlue) {
  write("a.ppm", "P6\n2 1\n255\n\x01\x02\x03\x04\x05\x06");
  EXPECT_EQ(read_image("a.ppm"), image_u8(2, 1, 3, {1, 2, 3, 4, 5, 6}));
}

TEST_F(ImageFiles, ContentsTellTheFormatNotTheName) {
  const Image image = uneven_image(3, 4, 3, PixelType::kUint16);
  write_image("a.png", image);
  std::filesystem::rename("a.png", "a.of.nothing");
  EXPECT_EQ(read_image("a.of.nothing"), image);
}

// ---- what a file says beside its pixels

/// A jpg of orientation 6, "turn by a quarter to the right".
std::string with_orientation(const std::string& jpg) {
  using namespace std::string_literals;
  const std::string tiff = "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"s;
  std::string segment = "Exif\0\0"s;
  segment += tiff;
  return jpg.substr(0, 2) + "\xFF\xE1\0"s + static_cast<char>(segment.size() + 2) + segment + jpg.substr(2);
}

TEST_F(ImageFiles, OrientationOfAJpgIsKept) {
  write_image("a.jpg", uneven_image(24, 8, 3, PixelType::kUint8));
  const Image plain = read_image("a.jpg");
  write("b.jpg", with_orientation(contents("a.jpg")));
  EXPECT_EQ(read_image("b.jpg"), plain);
  const PictureFile file = read_pages("b.jpg");
  EXPECT_EQ(file.pages.front().about.orientation, 6);
  write_pages("c.jpg", file.pages);
  EXPECT_EQ(read_pages("c.jpg").pages.front().about.orientation, 6);
  const Page turned = oriented(file.pages.front());
  EXPECT_EQ(turned.image.width(), 8);
  EXPECT_EQ(turned.image.at(7, 0, 0), plain.at(0, 0, 0)) << "turned by a quarter to the right";
  write_pages("d.jpg", {&turned, 1});
  EXPECT_EQ(read_pages("d.jpg").pages.front().about.orientation, 1);
}

/// A tif of 2×1 pixels of `samples` channels, little-endian, in one strip or, with planar 2, one for each channel.
std::string tif(int bits, int samples, const std::string& pixels, int photometric, int extra_samples, int planar = 1) {
  std::string entries;
  int count = 0;
  const auto put = [](std::string& text, unsigned value, int width) {
    for (int i = 0; i < width; ++i) text += static_cast<char>(value >> (8 * i) & 255U);
  };
  const auto add = [&](unsigned tag, unsigned value) {
    put(entries, tag, 2), put(entries, 3, 2), put(entries, 1, 4), put(entries, value, 4);
    ++count;
  };
  const auto bits_at = static_cast<unsigned>(8 + pixels.size());
  add(256, 2), add(257, 1);
  put(entries, 258, 2), put(entries, 3, 2), put(entries, static_cast<unsigned>(samples), 4);
  put(entries, samples > 2 ? bits_at : static_cast<unsigned>(bits) * (samples == 2 ? 0x10001U : 1U), 4), ++count;
  const auto strips = static_cast<unsigned>(planar == 2 ? samples : 1);
  const unsigned strip_size = static_cast<unsigned>(pixels.size()) / strips;
  const auto add_strips = [&](unsigned tag, unsigned value, unsigned at) {
    put(entries, tag, 2), put(entries, 4, 2), put(entries, strips, 4), put(entries, strips > 1 ? at : value, 4),
        ++count;
  };
  add(259, 1), add(262, static_cast<unsigned>(photometric)), add_strips(273, 8, bits_at + 8);
  add(277, static_cast<unsigned>(samples)), add(278, 1);
  add_strips(279, strip_size, bits_at + 8 + 4 * strips), add(284, static_cast<unsigned>(planar));
  if (extra_samples >= 0) add(338, static_cast<unsigned>(extra_samples));
  std::string file("II*\0", 4);
  put(file, bits_at + 8 + 8 * strips, 4);
  file += pixels;
  for (int i = 0; i < 4; ++i) put(file, static_cast<unsigned>(bits), 2);
  for (unsigned i = 0; i < strips; ++i) put(file, 8 + i * strip_size, 4);
  for (unsigned i = 0; i < strips; ++i) put(file, strip_size, 4);
  put(file, static_cast<unsigned>(count), 2);
  return file + entries + std::string(4, '\0');
}

TEST_F(ImageFiles, AlphaOfATifIsStraight) {
  const std::string straight = "\xC8\x64\x32\x80\x0A\x14\x1E\xFF", multiplied = "\x64\x32\x19\x80\x0A\x14\x1E\xFF";
  write("straight.tif", tif(8, 4, straight, 2, 2));
  write("multiplied.tif", tif(8, 4, multiplied, 2, 1));
  write("unsaid.tif", tif(8, 4, straight, 2, -1));
  for (const char* name : {"straight.tif", "multiplied.tif", "unsaid.tif"}) {
    const Image image = read_image(name);
    for (int c = 0; c < 4; ++c) {
      EXPECT_NEAR(image.at(0, 0, c), (std::vector{200, 100, 50, 128}[static_cast<std::size_t>(c)]), 1) << name << c;
      EXPECT_EQ(image.at(1, 0, c), (std::vector{10, 20, 30, 255}[static_cast<std::size_t>(c)])) << name << c;
    }
  }
}

TEST_F(ImageFiles, TifsOfOtherLayoutsAreRead) {
  write("alpha.tif", tif(8, 2, "abcd", 1, 2));
  EXPECT_EQ(read_image("alpha.tif"), image_u8(2, 1, 2, {'a', 'b', 'c', 'd'}));
  write("planes.tif", tif(16, 3, "abcdefghijkl", 2, -1, 2));
  EXPECT_EQ(read_image("planes.tif").at(1, 0, 0), 'd' * 256 + 'c');
  EXPECT_EQ(read_image("planes.tif").at(0, 0, 2), 'j' * 256 + 'i');
  write("white.tif", tif(16, 1, "abcd", 0, -1));
  EXPECT_EQ(read_image("white.tif").at(1, 0, 0), 65535 - ('d' * 256 + 'c'));
  write("grey.tif", tif(16, 1, "abcd", 1, -1));
  EXPECT_EQ(read_image("grey.tif").at(1, 0, 0), 'd' * 256 + 'c');
  write("twelve.tif", tif(12, 1, "\xAB\xCD\xEF", 1, -1));
  EXPECT_EQ(read_image("twelve.tif").at(0, 0, 0), std::round(0xABC * 65535.0 / 0xFFF)) << "white stays white";
  EXPECT_EQ(read_pages("twelve.tif").pages.front().image.at(1, 0, 0), 0xDEF);
}

TEST_F(ImageFiles, AChannelThatIsNotSaidToBeAlphaIsNone) {
  write("two.tif", tif(8, 2, "abcd", 1, -1));
  const Page page = read_pages("two.tif").pages.front();
  EXPECT_EQ(page.image.channels(), 2);
  EXPECT_FALSE(page.image.has_alpha());
  EXPECT_EQ(read_image("two.tif"), image_u8(2, 1, 1, {'a', 'c'})) << "the first is shown";
}

TEST_F(ImageFiles, OrientationOfATifIsKeptAndTurnsWhereAsked) {
  // The tag of planes is made one of orientation.
  const std::string upright = tif(8, 1, "ab", 1, -1);
  const std::size_t at = upright.find(std::string("\x1C\x01\x03\0", 4));
  ASSERT_NE(at, std::string::npos);
  const auto turned = [&](char orientation) {
    std::string file = upright;
    file.replace(at, 2, "\x12\x01");
    file[at + 8] = orientation;
    write("turned.tif", file);
    const Page page = read_pages("turned.tif").pages.front();
    EXPECT_EQ(page.about.orientation, orientation);
    EXPECT_EQ(page.image, image_u8(2, 1, 1, {'a', 'b'}));
    EXPECT_EQ(oriented(page).about.orientation, 1);
    return oriented(page).image;
  };
  const Image same = image_u8(2, 1, 1, {'a', 'b'}), mirrored = image_u8(2, 1, 1, {'b', 'a'});
  const Image down = image_u8(1, 2, 1, {'a', 'b'}), up = image_u8(1, 2, 1, {'b', 'a'});
  const std::vector<Image> expected{same, mirrored, mirrored, same, down, down, up, up};
  for (int i = 1; i <= 8; ++i) EXPECT_EQ(turned(static_cast<char>(i)), expected[static_cast<std::size_t>(i - 1)]) << i;
}

// ---- formats read by our own code

TEST_F(ImageFiles, PnmIsReadInEveryForm) {
  write("a", "P1 # c\n3 1 1 01");
  EXPECT_EQ(read_image("a"), image_u8(3, 1, 1, {0, 255, 0}));
  write("a", "P4\n3 2\n\xA0\x40");
  EXPECT_EQ(read_image("a"), image_u8(3, 2, 1, {0, 255, 0, 255, 0, 255}));
  write("a", "P2\n# a comment\n2 1 # another\n100\n50\r\n100\n");
  EXPECT_EQ(read_image("a"), image_u8(2, 1, 1, {128, 255}));
  write("a", "P3\n1 1\n255\n1 2 3");
  EXPECT_EQ(read_image("a"), image_u8(1, 1, 3, {1, 2, 3}));
  write("a", "P5 1 1 1023\n\x03\xFF");
  EXPECT_EQ(read_image("a").at(0, 0, 0), 65535);
  EXPECT_EQ(read_pages("a").pages.front().image.at(0, 0, 0), 1023);
  write("a", "P2\n3 1\n100\n0 50 100\n");
  const PictureFile scaled = read_pages("a");
  EXPECT_EQ(scaled.pages.front().image, image_u8(3, 1, 1, {0, 128, 255}));
  EXPECT_THAT(scaled.notes, testing::ElementsAre(HasSubstr("the highest value is 100; numbers are scaled")));
  for (const char* text :
       {"P2\n2 1\n0\n1 1", "P2\n2 1\n70000\n1 1", "P2\n2 1\n255\n1", "P5\n2 0\n255\n", "P5\n2 x\n255\n"}) {
    write("a", text);
    EXPECT_THAT(read_error("a"), HasSubstr("damaged or cut off")) << text;
  }
}

/// A bmp of 3×2 pixels with a palette of 16 colours, of which 1 is red, 2 green, the others black.
std::string bmp(int bits, int compression, const std::string& pixels) {
  using namespace std::string_literals;
  const auto number = [](int value, int width) {
    std::string bytes;
    for (int i = 0; i < width; ++i)
      bytes += static_cast<char>(static_cast<unsigned>(value) >> (8U * static_cast<unsigned>(i)) & 255U);
    return bytes;
  };
  std::string palette(64, '\0');
  palette[4 + 2] = palette[8 + 1] = '\xFF';
  return "BM"s + std::string(8, '\0') + number(14 + 40 + 64, 4) + number(40, 4) + number(3, 4) + number(2, 4) +
         number(1, 2) + number(bits, 2) + number(compression, 4) + std::string(12, '\0') + number(16, 4) +
         number(0, 4) + palette + pixels;
}

TEST_F(ImageFiles, BmpIsReadInEveryForm) {
  using namespace std::string_literals;
  const Image expected = image_u8(3, 2, 3, {255, 0, 0, 0, 255, 0, 0, 0, 0, 0, 255, 0, 0, 255, 0, 0, 255, 0});
  const std::vector<std::string> files{
      bmp(4, 0, "\x22\x20\0\0\x12\0\0\0"s), bmp(8, 0, "\x02\x02\x02\0\x01\x02\0\0"s),
      bmp(8, 1, "\x03\x02\0\0\0\x03\x01\x02\0\0\0\x01"s), bmp(4, 2, "\x03\x22\0\0\x02\x12\0\x01"s),
      bmp(4, 2, "\x03\x22\0\x02\0\x01\0\x01"s)};  // the last moves on to row 1, and ends
  for (std::size_t i = 0; i < 4; ++i) {
    write("a", files[i]);
    EXPECT_EQ(read_image("a"), expected) << i;
  }
  write("a", files[4]);
  EXPECT_EQ(read_image("a").at(0, 0, 0), 0);
  EXPECT_EQ(read_image("a").at(0, 1, 1), 255);
  write("a", bmp(16, 0, std::string("\x00\x7C\xE0\x03\x1F\x00\0\0", 8) + std::string(8, '\0')));
  // 16 bits have no palette: the pixels begin where the header says all the same.
  EXPECT_EQ(read_image("a"), image_u8(3, 2, 3, {0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255}));
  for (const std::string& file :
       {bmp(7, 0, "abcdefgh"), bmp(4, 1, "abcdefgh"), bmp(8, 9, "abcdefgh"), bmp(8, 0, "abc")}) {
    write("a", file);
    EXPECT_THAT(read_error("a"), HasSubstr("damaged or cut off"));
  }
}

// A changed file gives an image, or one line of error; with the sanitizers this is a test of every reader.
TEST_F(ImageFiles, ChangedBytesDoNoHarm) {
  std::vector<std::string> files{bmp(4, 2, std::string("\x03\x22\0\0\x02\x12\0\x01", 8)), "P2\n3 2\n100\n1 2 3 4 5 6\n",
                                 "P6\n2 1\n255\nabcdef", tif(12, 3, "abcdefghi", 2, -1)};
  const Image image = uneven_image(5, 4, 3, PixelType::kUint8);
  for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
    write_image(name, image);
    files.push_back(contents(name));
  }
  for (const std::string& file : files)
    for (std::size_t i = 2; i < std::min<std::size_t>(file.size(), 400); ++i)
      for (const unsigned change : {1U, 128U, 255U}) {
        std::string changed = file;
        changed[i] = static_cast<char>(static_cast<unsigned char>(changed[i]) ^ change);
        write("changed", changed);
        EXPECT_THAT(read_error("changed"), testing::AnyOf("no error", StartsWith("cannot read 'changed': ")));
      }
}

// The same of what files say beside their pixels: pages, palettes, tags, EXIF.
TEST_F(ImageFiles, ChangedBytesOfPagesAndTheirTagsDoNoHarm) {
  Page page{uneven_image(5, 4, 1, PixelType::kUint8)};
  page.about.resolution = {300, 300, Resolution::Unit::kInch};
  page.about.profile = "a profile of colours";
  page.about.orientation = 3;
  std::vector<std::string> files{encode_pages({&page, 1}, ".jpg")};
  for (std::uint16_t i = 0; i < 256; ++i) page.about.palette.push_back({i, 257, 0, 0xFFFF});
  files.push_back(encode_pages({&page, 1}, ".png"));
  page.about.description = "ImageJ=1.54f\nimages=2\n";
  page.about.tiff_tags = {{50838, 4, std::string(8, '\1')}, {50839, 1, "IJIJ"}};
  files.push_back(encode_pages(std::vector{page, page}, ".tif"));
  for (const std::string& file : files)
    for (std::size_t i = 2; i < file.size(); ++i)
      for (const unsigned change : {1U, 128U, 255U}) {
        std::string changed = file;
        changed[i] = static_cast<char>(static_cast<unsigned char>(changed[i]) ^ change);
        try {
          for (const Page& read : decode_pages(changed, 1000).pages) {
            EXPECT_LE(read.image.pixel_count(), 1000U);
            shown(read);
            encode_pages({&read, 1}, ".tif");
          }
        } catch (const InputError&) {  // one line
        }
      }
}

// ---- files that are no images

TEST_F(ImageFiles, WhatCannotBeReadIsNamed) {
  EXPECT_EQ(read_error("none.png"), "cannot read 'none.png': No such file or directory");
  std::filesystem::create_directory("folder");
  EXPECT_EQ(read_error("folder"), "cannot read 'folder': it is a folder; a file is needed");
  write("empty.png", "");
  EXPECT_THAT(read_error("empty.png"), HasSubstr("empty.png is empty"));
  write("text.png", "no image\n");
  EXPECT_EQ(read_error("text.png"),
            "cannot read 'text.png': it is not an image; it must be a png, jpg, tif, bmp, pgm or ppm");
  write("large.pgm", "P5\n2000000 1\n255\nabc");
  EXPECT_EQ(read_error("large.pgm"),
            "cannot read 'large.pgm': the image has more than 2^20 pixels on a side, or more than 2^30");
  write("large2.pgm", "P5\n40000 40000\n255\nabc");
  EXPECT_THAT(error_of([] { read_image("large2.pgm", 2'000'000'000); }), HasSubstr("more than 2^30"));
}

TEST_F(ImageFiles, AFileCutAnywhereIsRefused) {
  const Image image = uneven_image(32, 32, 3, PixelType::kUint8);
  write_image("a.png", image);
  write_image("a.jpg", image);
  write_image("a.tif", image);
  write("a.bmp", bmp(8, 0, std::string("\x02\x02\x02\0\x01\x02\0\0", 8)));
  write("a.ppm", "P6\n32 1\n255\n" + std::string(96, 'a'));
  for (const std::string name : {"a.png", "a.jpg", "a.tif", "a.bmp", "a.ppm"}) {
    const std::string whole = contents(name);
    for (const double share : {0.05, 0.3, 0.5, 0.9, 0.99}) {
      write(name, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
      EXPECT_EQ(read_error(name), "cannot read '" + name + "': the image is damaged or cut off") << share;
    }
  }
}

// Another thread of the host looks at where its stderr leads all the while.
TEST_F(ImageFiles, StderrStaysWhereTheHostHasIt) {
  const auto leads_to = [] {
    struct stat facts {};
    fstat(STDERR_FILENO, &facts);
    return std::pair(facts.st_dev, facts.st_ino);
  };
  write("text.png", "hello");
  const Image image = uneven_image(400, 400, 3, PixelType::kUint8);
  const auto before = leads_to();
  std::atomic<bool> done = false;
  std::atomic<int> moved = 0;
  std::thread host([&] {
    while (!done) moved += leads_to() == before ? 0 : 1;
  });
  for (int i = 0; i < 20; ++i) {
    read_error("text.png");
    rewritten("a.png", image);
  }
  done = true;
  host.join();
  EXPECT_EQ(moved, 0);
}

TEST_F(ImageFiles, AJpgMayBeFollowedByOtherBytes) {
  write_image("a.jpg", image_u8(2, 1, 1, {100, 110}));
  write("b.jpg", contents("a.jpg") + "more");
  EXPECT_EQ(read_image("b.jpg"), read_image("a.jpg"));
}

TEST_F(ImageFiles, PixelsOfOtherTypesAreRefused) {
  write("a.tif", tif(24, 1, std::string(16, '\0'), 1, -1));
  EXPECT_THAT(read_error("a.tif"),
              StartsWith("cannot read 'a.tif': it is a tif of 24-bit whole numbers, which are not read"));
}

// ---- what cannot be written

TEST_F(ImageFiles, FormatsThatHoldTheImageAreNamed) {
  const auto image = [](int channels, PixelType depth) { return uneven_image(3, 2, channels, depth); };
  using enum PixelType;
  EXPECT_EQ(write_error("a.jpg", image(3, kUint16)),
            "cannot write 'a.jpg': .jpg does not hold 16-bit pixels; what does for this image: .png, .tif");
  EXPECT_EQ(write_error("a.JPEG", image(4, kUint8)),
            "cannot write 'a.JPEG': .jpeg does not hold an alpha channel; what does for this image: .png, .tif");
  EXPECT_EQ(write_error("a.png", image(1, kFloat32)),
            "cannot write 'a.png': .png does not hold 32-bit floating-point pixels; what does for this image: .tif");
}

TEST_F(ImageFiles, ExtensionsAndPlacesThatCannotBeWritten) {
  const Image image = uneven_image(3, 2, 1, PixelType::kUint8);
  EXPECT_EQ(write_error("a.gif", image),
            "cannot write 'a.gif': no image format that is written has the extension '.gif'; valid: .png, .tif, .tiff, "
            ".jpg, .jpeg");
  for (const char* name : {"a.bmp", "a.pgm", "a.ppm"})
    EXPECT_THAT(write_error(name, image), HasSubstr("no image format that is written has the extension"));
  EXPECT_THAT(write_error("a", image), HasSubstr("it has no extension; valid: .png"));
  EXPECT_THAT(error_of([] { check_image_extension("a.webp"); }), HasSubstr("'.webp'"));
  EXPECT_EQ(error_of([] { check_image_extension("a.tiff"); }), "no error");
  EXPECT_EQ(write_error("no/a.png", image), "cannot write 'no/a.png': there is no folder 'no'");
  EXPECT_EQ(write_error("a.jpg", uneven_image(65501, 1, 1, PixelType::kUint8)),
            "cannot write 'a.jpg': .jpg does not take 65501 x 1 pixels");
}

}  // namespace
}  // namespace pulson::images
