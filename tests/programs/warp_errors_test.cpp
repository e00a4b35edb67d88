// The verb `warp`: what it refuses.

#include <string>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "image_examples.hpp"
#include "pulson/images/image.hpp"
#include "warp_program.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// Exit code 2, one line that says what is wrong, and nothing written.
class WarpRefuses : public WarpProgram {
 protected:
  static void expect_refused(const Arguments& arguments, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = run(joined({"warp"}, arguments));
    EXPECT_EQ(refused.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_EQ(refused.out, "");
    EXPECT_EQ(count_lines(refused.err), 1U) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_THAT(changed_since(before), IsEmpty()) << testing::PrintToString(arguments);
  }
};

TEST_F(WarpRefuses, WrongFilesAndOptions) {
  register_squares();
  write("word.png", "hello");
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  write_image("colour.png", uneven_image(17, 17, 3, images::PixelType::kUint8));
  std::filesystem::create_directory("folder");
  const std::string registration = "out/registration.json";
  const auto refuse = [&](const std::string& line, const std::string& message) {
    expect_refused(joined({registration}, words(line)), message);
  };
  expect_refused(words("missing.json grey.png -o w.png"), "cannot read 'missing.json': No such file or directory");
  expect_refused(words("grey.png grey.png -o w.png"), "grey.png is an image; the registration comes first");
  refuse("missing.png -o w.png", "cannot read 'missing.png'");
  refuse("word.png -o w.png", "it is not an image");
  refuse("grey.png -o w.xyz", "no image format that is written has the extension '.xyz'");
  refuse("grey.png -o w", "it has no extension");
  refuse("grey.png -o folder", "it is a folder");
  refuse("grey.png -o no/w.png", "there is no folder 'no'");
  refuse("grey.png -o w.png --json no/w.json", "there is no folder 'no'");
  refuse("grey.png -o w.png --grid no/g.png", "there is no folder 'no'");
  refuse("grey.png -o w.png --like missing.png", "cannot read 'missing.png'");
  for (const char* size : {"12", "0x5", "12x", "axb", "-3x4"})
    refuse(std::string("grey.png -o w.png --size=") + size, "--size is '" + std::string(size) + "'");
  refuse("grey.png -o w.png --over top", "valid: least-stretched, average, first, label-order");
  refuse("grey.png -o w.png --method puhs", "valid: auto, pull, push");
  refuse("grey.png -o w.png --labels plate", "valid: metric, thin-plate");
  refuse("grey.png -o w.png --border none", "unknown border 'none'; valid: auto, constant, replicate");
  for (const char* background : {"1,2", "256", "-1", "nan", "1,2,300", "1;2;3", "1,2,3,4"})

    refuse(std::string("grey.png -o w.png --background=") + background,
           std::string("--background is '") + background + "'");
  refuse("grey.png -o w.png --interpolation label --samples 3", "which labels do not have");
  refuse("grey.png -o w.png --interpolation best", "interpolation");
  refuse("grey.png -o w.png --origin 1", "--origin is '1'");
  refuse("grey.png -o w.png --pixel-size 0", "--pixel-size is 0");
  refuse("grey.png -o w.png --tolerance -1", "--tolerance is -1");
  refuse("grey.png -o w.png --max-pixels 0", "--max-pixels is 0");
  refuse("grey.png -o w.png --method push --supersampling 9", "supersampling 9");
  refuse("grey.png -o w.png --method push --background 1,2", "--background is '1,2'");
  refuse("grey.png -o w.png --samples 3", "--samples needs noise");
  refuse("grey.png -o w.png --deviation d.tif", "need --samples");
  refuse("grey.png -o w.png --inverse --method push", "cannot be combined with --method push");
  refuse("grey.png -o w.png --field f.png", "written as .mha or .nrrd");
  refuse("grey.png -o w.png --folds f.mha", "drawings and masks are written as .png or .tif");
  refuse("grey.png -o w.png --grid g.jpg", "drawings and masks are written as .png or .tif");
  refuse("grey.png -o w.png --jacobian j.jpg",
         "numbers are written as .png, .svg, .pdf (colours), .tif, .mha or .nrrd");
  refuse("grey.png -o w.png --side-by-side s.tif", "s.tif: it is drawn as .png, .svg or .pdf");
  refuse("grey.png -o w.png --overlay o.png",
         "--overlay shows the result over the target's image; give that with --like");
  refuse("grey.png -o w.png --side-by-side s.png --dpi 0", "--dpi");
  refuse("grey.png -o w.png --animate a.xyz", "a");
  refuse("colour.png -o w.pgm", "no image format that is written has the extension '.pgm'");
  refuse("a.csv -o w.png", "the extension 'png' is not of a landmark format that can be written");
  refuse("a.csv -o w.csv --grid g.png", "--grid is for images");
  refuse("a.csv -o w.csv --samples 2", "--samples is for images");
}

// Refused before they are decoded or made.
TEST_F(WarpRefuses, MorePixelsThanAllowed) {
  register_squares();
  const std::string registration = "out/registration.json", too_many = " pixels, more than --max-pixels ";
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  write_image("small.png", uneven_image(8, 8, 1, images::PixelType::kUint8));
  write("large.pgm", "P5\n40000 30000\n255\nabc");
  write("large.mha",
        "NDims = 2\nDimSize = 40000 30000\nElementType = MET_UCHAR\nBinaryData = True\nElementDataFile = LOCAL\n");
  const auto refuse = [&](const std::string& line, const std::string& message) {
    expect_refused(joined({registration}, words(line)), message);
  };
  refuse("large.pgm -o w.png", "40000 x 30000" + too_many + "200000000 allows");
  refuse("large.mha -o w.png", "40000 x 30000 points, more than --max-pixels 200000000 allows");
  refuse("grey.png -o w.png --like large.pgm", "40000 x 30000" + too_many + "200000000 allows");
  refuse("grey.png -o w.png --size 40000x30000", "the result has 40000 x 30000" + too_many + "200000000 allows");
  refuse("grey.png -o w.png --max-pixels 288", "17 x 17" + too_many + "288 allows");
  refuse("small.png -o w.png --max-pixels 288 --size 17x17 --pixel-size 2",
         "the result has 17 x 17" + too_many + "288 allows");
}

TEST_F(WarpRefuses, FilesWithoutAnEnd) {
  register_squares();
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  ASSERT_EQ(::mkfifo("pipe.png", 0600), 0);
  std::filesystem::create_symlink("/dev/zero", "zero.png");
  std::filesystem::create_symlink("/dev/zero", "zero.mha");
  for (const std::string name : {"pipe.png", "zero.png", "zero.mha"}) {
    expect_refused({"out/registration.json", name, "-o", "w.png"}, "cannot read '" + name + "': it is ");
    expect_refused({"out/registration.json", "grey.png", "-o", "w.png", "--like", name},
                   "cannot read '" + name + "': it is ");
  }
}

// The libraries for images have lines of their own to print about such files.
TEST_F(WarpRefuses, ImagesThatAreCutOffInOneLine) {
  register_squares();
  for (const std::string name : {"a.png", "a.jpg", "a.tif"}) {
    write_image(name, uneven_image(32, 32, 3, images::PixelType::kUint8));
    const std::string whole = contents(name);
    for (const double share : {0.3, 0.9}) {
      write(name, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
      expect_refused({"out/registration.json", name, "-o", "w.png"},
                     "cannot read '" + name + "': the image is damaged or cut off");
    }
  }
}

TEST_F(WarpRefuses, WhatAFoldingMapCannotTell) {
  register_squares("ch-sd:beta=1");
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  write_image("colour.png", uneven_image(17, 17, 3, images::PixelType::kUint8));
  const auto refuse = [&](const std::string& line, const std::string& message) {
    expect_refused(joined({"out/registration.json"}, words(line)), message);
  };
  refuse("grey.png -o w.png --method pull", "--method pull needs a map that has an inverse");
  refuse("a.csv -o w.csv --inverse", "the map has no inverse");
  for (const char* option : {"--jacobian", "--log-jacobian", "--folds", "--grid", "--side-by-side"})
    refuse("grey.png -o w.png --inverse " + std::string(option) + " x.png",
           std::string(option) + " with --inverse needs a map that has an inverse");
  refuse("grey.png -o w.png --samples 2 --field f.mha", "they cannot be combined with --samples");
  refuse("colour.png -o w.pgm --samples 2 --deviation d.png", "has the extension '.pgm'");
}

// Between landmarks the steps backwards have no root of their own where κ > 1: there is no picture that shows half a
// map.
TEST_F(WarpRefuses, ToPullByStepsThatAreTooLong) {
  write("a.csv", "x,y\n0,0\n0,5\n");
  write("b.csv", "x,y\n2.4,0\n0,5\n");
  ASSERT_EQ(
      run(words(
              "register a.csv b.csv -o out --align none --lambda 1 --sigma 0.01 --kernel gaussian:alpha=0.5 --steps 4 "
              "--integrator variational "
              "--no-picture -q"))
          .exit_code,
      0);
  write_image("grey.png", uneven_image(120, 160, 1, images::PixelType::kUint8));
  expect_refused(words("out/registration.json grey.png -o w.png --pixel-size 0.05 --origin -2,-1.5 --method pull"),
                 "the time steps are too long for an inverse");
}

TEST_F(WarpRefuses, ImagesInThreeDimensions) {
  write("a.csv", "x,y,z\n0,0,0\n1,0,1\n0,1,2\n3,1,1\n");
  write("b.csv", "x,y,z\n0,0,0\n1.1,0,1\n0,1.1,2\n3,1.1,1\n");
  ASSERT_EQ(run(words("register a.csv b.csv -o out --no-picture -q")).exit_code, 0);
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  expect_refused(words("out/registration.json grey.png -o w.png"), "the landmarks are in 3D");
  write("flat.csv", "x,y\n0,0\n1,1\n");
  expect_refused(words("out/registration.json flat.csv -o w.csv"), "flat.csv is in 2D, the registration in 3D");
}

}  // namespace
}  // namespace pulson
