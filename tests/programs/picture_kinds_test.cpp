// What `pulson warp` makes of pictures of all kinds: their numbers, pages, and what files say beside them.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "image_examples.hpp"
#include "pulson/fields/grid_fields.hpp"
#include "pulson/images/pages.hpp"
#include "shell_commands.hpp"
#include "warp_program.hpp"

namespace pulson {
namespace {

using images::Alpha;
using images::Page;
using images::PixelType;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class PictureKinds : public WarpProgram {
 protected:
  void SetUp() override {
    WarpProgram::SetUp();
    write("pts.csv", "x,y\n2,2\n12,2\n12,10\n2,9\n");
    const ProgramRun done = run(words("register pts.csv pts.csv -o out --no-picture -q"));
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  static void expect_warped(const std::string& image, const std::string& options) {
    const ProgramRun done = warp(image, options);
    ASSERT_EQ(done.exit_code, 0) << image << ' ' << options << ": " << done.err;
  }

  static void expect_refused(const std::string& image, const std::string& options, const std::string& message) {
    const ProgramRun done = warp(image, options);
    EXPECT_EQ(done.exit_code, 2) << image << ' ' << options;
    EXPECT_THAT(done.err, HasSubstr(message));
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
  }

  // The identity of this picture, under every interpolation, pulled and pushed.
  static void expect_identity(const std::string& file, const std::vector<Page>& pages) {
    write_pages(file, pages);
    const std::vector<Page> before = images::read_pages(file).pages;
    const std::string out = "w" + std::filesystem::path(file).extension().string();
    for (const std::string interpolation : {"nearest", "linear", "cubic", "lanczos", "label"})
      for (const std::string method : {"pull", "push"}) {
        SCOPED_TRACE(file + " " + interpolation + " " + method);
        expect_warped(file, "-q -o " + out + " --method " + method + " --interpolation " + interpolation);
        EXPECT_EQ(images::read_pages(out).pages, before);
      }
  }
};

std::vector<Page> pages_of_type(PixelType type, std::size_t count, int channels = 1) {
  std::vector<Page> pages;
  for (std::size_t i = 0; i < count; ++i) {
    pages.push_back({uneven_image(15, 11, channels, type)});
    pages.back().image.bytes()[i] ^= std::byte{0x21};
  }
  return pages;
}

TEST_F(PictureKinds, IdentityGivesATifOfAnyTypeBack) {
  for (const PixelType type : kNumberTypes) expect_identity("a.tif", pages_of_type(type, 1));
}

// As ImageJ and OME write them.
TEST_F(PictureKinds, IdentityKeepsPagesAndWhatTheySay) {
  std::vector<Page> pages = pages_of_type(PixelType::kUint16, 6);
  pages[0].about.description = "ImageJ=1.54f\nimages=6\nslices=3\nframes=2\nhyperstack=true\nunit=micron\n";
  for (Page& page : pages) page.about.resolution = {15.5, 15.5, images::Resolution::Unit::kNone};
  pages[0].about.tiff_tags = {{50838, 4, std::string("\x0c\0\0\0\x04\0\0\0", 8)}, {50839, 1, "IJIJ and more"}};
  for (Page& page : pages) page.about.compression = 5;  // LZW
  expect_identity("stack.tif", pages);
  EXPECT_EQ(images::read_pages("w.tif").pages, pages);
  for (Page& page : pages) page.about.compression = 1;  // none
  expect_identity("plain.tif", pages);
  EXPECT_EQ(images::read_pages("w.tif").pages, pages);

  pages = pages_of_type(PixelType::kFloat32, 2);
  pages[0].about.description = "<?xml version=\"1.0\"?><OME><Image><Pixels SizeX=\"15\" SizeY=\"11\"/></Image></OME>";
  for (Page& page : pages) page.about.compression = 8;  // zlib
  expect_identity("o.ome.tif", pages);
  EXPECT_EQ(images::read_pages("w.tif").pages, pages);

  pages = pages_of_type(PixelType::kInt16, 1, 5);
  pages[0].about.has_planes = true;
  pages[0].about.extra_samples = {0, 0, 0, 0};
  pages[0].about.compression = 1;
  expect_identity("planes.tif", pages);
  EXPECT_EQ(images::read_pages("w.tif").pages, pages);

  pages = pages_of_type(PixelType::kFloat32, 2);
  pages[0].about.description = "<?xml version=\"1.0\"?><OME><Image><Pixels SizeX=\"15\" SizeY=\"11\"/></Image></OME>";
  write_pages("o.ome.tif", pages);
  expect_warped("o.ome.tif", "-q -o w.ome.tif --size 20x11");
  EXPECT_THAT(images::read_pages("w.ome.tif").pages[0].about.description, HasSubstr("SizeX=\"20\" SizeY=\"11\""));
}

TEST_F(PictureKinds, IdentityKeepsChannelsThatAreNoColours) {
  for (const std::vector<std::uint16_t>& extra :
       {std::vector<std::uint16_t>{0}, {0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0}}) {
    const auto channels = static_cast<int>(extra.size()) + 1;
    images::Image image(15, 11, {channels, PixelType::kUint8, Alpha::kNone, 255});
    for (std::size_t i = 0; i < image.bytes().size(); ++i) image.bytes()[i] = static_cast<std::byte>(i * 37 % 251);
    expect_identity("c.tif", {{image, {.extra_samples = extra}}});
  }
}

TEST_F(PictureKinds, IdentityKeepsPalettesAndFewBits) {
  images::Image numbers(15, 11, {1, PixelType::kUint8, Alpha::kNone, 15});
  for (std::size_t i = 0; i < numbers.bytes().size(); ++i) numbers.bytes()[i] = static_cast<std::byte>(i * 7 % 16);
  images::PageMetadata about;
  for (int i = 0; i < 16; ++i)
    about.palette.push_back(
        {static_cast<std::uint16_t>(257 * i * 16), 0, static_cast<std::uint16_t>(65535 - 257 * i), 0xFFFF});
  for (const std::string file : {"p.png", "p.tif"}) {
    expect_identity(file, {{numbers, about}});
    expect_identity("grey" + file, {{numbers}});
  }
  EXPECT_THAT(warp("p.png", "-o w.png").err, HasSubstr("note: p.png has a palette, whose numbers have no means"));
  expect_refused("p.png", "-o w.jpg", ".jpg changes numbers, and those of labels have to stay");
  expect_refused("p.png", "-o w.ppm", "no image format that is written has the extension");
  expect_refused("p.png", "-o w.mha", ".mha does not hold a palette");
}

TEST_F(PictureKinds, IdentityKeepsResolutionTextsAndProfiles) {
  Page page{uneven_image(15, 11, 3, PixelType::kUint8)};
  page.about.resolution = {300, 150, images::Resolution::Unit::kInch};
  page.about.profile = "no profile, but bytes";
  page.about.description = "skull, \xC2\xB5m";
  page.about.orientation = 6;
  expect_identity("r.tif", {page});
  EXPECT_EQ(images::read_pages("w.tif").pages[0].about.resolution, page.about.resolution);
  images::write_pages("r.jpg", {&page, 1});
  expect_warped("r.jpg", "-q -o w.jpg");
  const images::PageMetadata kept = images::read_pages("w.jpg").pages[0].about;
  EXPECT_EQ(kept.resolution, page.about.resolution);
  EXPECT_EQ(kept.profile, page.about.profile);
  EXPECT_EQ(kept.description, page.about.description);
  EXPECT_EQ(kept.orientation, 6);

  page.about.resolution = {118.11, 59.06, images::Resolution::Unit::kCentimetre};
  expect_identity("r.png", {page});
  EXPECT_EQ(images::read_pages("w.png").pages[0].about.resolution, page.about.resolution);
  EXPECT_EQ(images::read_pages("w.png").pages[0].about.profile, page.about.profile);
  EXPECT_EQ(images::read_pages("w.png").pages[0].about.orientation, 6);
}

TEST_F(PictureKinds, IdentityGivesAGridOfAnyTypeBack) {
  for (const PixelType type : kNumberTypes)
    for (const int channels : {1, 3}) {
      const images::Image image = uneven_image(15, 11, channels, type);
      fields::Grid grid{{15, 11}, {1, 1}, {0, 0}, channels, {}, type};
      grid.bytes.assign(image.bytes().begin(), image.bytes().end());
      grid.lines = {{"Comment", "labels of the atlas"}};
      for (const std::string in : {"g.mha", "g.nrrd"})
        for (const std::string out : {"w.mha", "w.nrrd"})
          for (const std::string options : {"linear --method push", "lanczos"}) {
            write_grid(in, grid);
            expect_warped(in, "-q -o " + out + " --interpolation " + options);
            const fields::Grid back = fields::read_grid(out);
            EXPECT_EQ(back.bytes, grid.bytes) << describe(type) << ' ' << out << ' ' << options;
            EXPECT_EQ(back.type, type);
            EXPECT_EQ(back.components, channels);
            EXPECT_EQ(back.lines, grid.lines);
          }
    }
}

TEST_F(PictureKinds, LabelsBeyondWhatFloatsHoldStay) {
  fields::Grid grid{{15, 11}, {1, 1}, {0, 0}, 1, {}, PixelType::kUint32};
  images::Image image(15, 11, 1, PixelType::kUint32);
  const std::vector<std::uint32_t> labels{0, 997, 312782546, 614454277};
  for (std::size_t i = 0; i < 165; ++i) image.values<std::uint32_t>()[i] = labels[i / 3 % 4];
  grid.bytes.assign(image.bytes().begin(), image.bytes().end());
  write_grid("allen.mha", grid);
  write("b.csv", "x,y\n2,3\n12,2\n13,10\n2,9\n");
  ASSERT_EQ(run(words("register pts.csv b.csv -o out --no-picture -q")).exit_code, 0);
  for (const std::string method : {"pull", "push"}) {
    expect_warped("allen.mha", "-q -o w.tif --interpolation label --method " + method);
    const images::Image warped = images::read_image("w.tif");
    for (const std::uint32_t value : warped.values<std::uint32_t>()) EXPECT_THAT(labels, testing::Contains(value));
  }
  expect_refused("allen.mha", "-o w.png",
                 ".png does not hold 32-bit pixels; what does for this image: .tif, .mha, .nrrd");
  expect_refused("allen.mha", "-o w.jpg --interpolation label", ".jpg changes numbers");
}

TEST_F(PictureKinds, WhatAFormatCannotHoldIsRefusedBeforeTheWork) {
  write_pages("f.tif", pages_of_type(PixelType::kFloat32, 1));
  expect_refused("f.tif", "-o w.png",
                 ".png does not hold 32-bit floating-point pixels; what does for this image: .tif");
  write_pages("s.tif", pages_of_type(PixelType::kInt16, 1));
  expect_refused("s.tif", "-o w.png", ".png does not hold signed 16-bit pixels");
  write_pages("z.tif", pages_of_type(PixelType::kUint8, 3));
  expect_refused("z.tif", "-o w.png", ".png does not hold 3 pages; what does for this image: .tif");
  expect_refused("z.tif", "-o w.mha", ".mha does not hold 3 pages");
  write_pages("d.tif", pages_of_type(PixelType::kUint16, 1, 3));
  expect_refused("d.tif", "-o w.jpg", ".jpg does not hold 16-bit pixels");
  std::vector<Page> mixed = pages_of_type(PixelType::kUint8, 2);
  mixed[1].image = uneven_image(7, 11, 1, PixelType::kUint8);
  write_pages("m.tif", mixed);
  expect_refused("m.tif", "-o w.tif", "page 1 of the picture has 15 x 11 pixels and page 2 has 7 x 11");
  mixed[1].image = uneven_image(15, 11, 3, PixelType::kUint8);
  write_pages("m.tif", mixed);
  expect_refused("m.tif", "-o w.tif", "pages 1 and 2 of the picture differ in the type or the channels");
  expect_refused("z.tif", "-o w.tif --max-pixels 400", "more than --max-pixels 400 allows");
}

TEST_F(PictureKinds, OtherKindsOfPicturesAreNamed) {
  const std::vector<std::array<std::string, 2>> kinds{
      {std::string("RIFF\x10\0\0\0WEBPVP8 ", 16), "a webp picture"},
      {"GIF89a....", "a gif picture"},
      {std::string("\0\0\0\x0CjP  \r\n", 10), "a JPEG 2000 picture"},
      {std::string("\0\0\0\x18"
                   "ftypheic",
                   12),
       "a heic picture"},
      {std::string("\0\0\0\x18"
                   "ftypavif",
                   12),
       "an avif picture"},
      {std::string(128, '\0') + "DICM", "a DICOM file"},
      {"<?xml version=\"1.0\"?>\n<svg width=\"3\"/>", "a drawing (svg)"},
      {"%PDF-1.7\n", "a pdf"},
      {std::string(344, '\0') + std::string("n+1\0", 4), "a NIfTI volume"},
      {"\x1F\x8B\x08 ....", "compressed by gzip"},
      {"PK\x03\x04....", "a zip archive"},
      {"8BPS....", "a Photoshop file"}};
  for (const auto& [bytes, name] : kinds) {
    write("x.png", bytes);
    expect_refused("x.png", "-o w.png", "cannot read 'x.png': it is " + name);
  }
  for (const std::string file : {"x.webp", "x.gif", "x.heic", "x.nii.gz", "x.svg"}) {
    write(file, kinds[1][0]);
    expect_refused(file, "-o w.png",
                   "cannot read '" + file + "': it is a gif picture, which is not read; save it as png");
  }
}

// The fill of a palette is one of its numbers.
TEST_F(PictureKinds, APaletteIsFilledByItsColours) {
  images::Image numbers(15, 11, {1, PixelType::kUint8, Alpha::kNone, 255});
  const Page page{numbers, {.palette = {{0, 0, 0, 0xFFFF}, {0xFFFF, 0, 0, 0xFFFF}, {0xFFFF, 0xFFFF, 0xFFFF, 0}}}};
  images::write_pages("p.png", {&page, 1});
  const auto corner = [&](const std::string& options) {
    expect_warped("p.png", "-q -o w.png --size 20x20 " + options);
    return images::read_pages("w.png").pages[0].image.at(19, 19, 0);
  };
  EXPECT_EQ(corner(""), 2) << "the transparent one";
  EXPECT_EQ(corner("--background 255,10,0"), 1);
  EXPECT_EQ(corner("--background 0"), 0);
}

}  // namespace
}  // namespace pulson
