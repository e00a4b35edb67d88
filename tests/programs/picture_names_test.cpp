// Pictures whose files and names hold any character: nothing of them is interpreted, and no other program runs.

#include <string>

#include <gmock/gmock.h>

#include "image_examples.hpp"
#include "pulson/images/image.hpp"
#include "warp_program.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

// What a shell, gnuplot, ffmpeg or a file system might take for something else; X is what they would make.
const std::vector<std::string> kHostileNames = {
    "<touch X;#", "|touch X", "`touch X`", "$(touch X)", "it''s", "it's \"q\"", "a;touch X", "~root",   "%d %s",
    "-o",         "a\nb",     "\xFF\xFE",  "[1]*?",      "a\\b",  "file:touch", "pipe:1",    "日本 🐟", "&lt;"};

class PictureNames : public WarpProgram {
 protected:
  static void expect_untouched() {
    for (const char* const folder : {".", "folder"})
      EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(folder) / "X"));
  }
  static void expect_pictures(const std::string& stem) {
    EXPECT_THAT(contents(stem + ".png"), StartsWith("\x89PNG")) << stem;
    EXPECT_THAT(contents(stem + ".svg"), HasSubstr("</svg>")) << stem;
    EXPECT_THAT(contents(stem + ".pdf"), StartsWith("%PDF-")) << stem;
  }
};

TEST_F(PictureNames, FoldersOfResults) {
  write("a.csv", "x,y\n4,4\n12,4\n12,12\n4,12\n");
  write("b.csv", "x,y\n4,3\n13,5\n13,12\n3,13\n");
  for (const std::string& name : kHostileNames) {
    const ProgramRun done = run({"register", "a.csv", "b.csv", "--out=" + name, "--pictures", "png,svg,pdf", "-q"});
    EXPECT_EQ(done.exit_code, 0) << name << done.err;
    expect_pictures(name + "/registration");
  }
  expect_untouched();
}

TEST_F(PictureNames, FilesOfCaptionedImages) {
  register_squares();
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  for (const std::string& name : kHostileNames) {
    std::filesystem::create_directory(name);
    for (const std::string extension : {".png", ".svg", ".pdf"}) {
      const ProgramRun done = run({"warp", "out/registration.json", "grey.png", "-o", "w.png", "-q",
                                   "--side-by-side=" + name + "/s" + extension, "--log-jacobian=" + name + extension});
      EXPECT_EQ(done.exit_code, 0) << name << done.err;
    }
    expect_pictures(name + "/s");
    expect_pictures(name);
  }
  expect_untouched();
}

// Specimens, landmarks and groups that are named so, in every picture of a cohort.
TEST_F(PictureNames, NamesInTheData) {
  const std::string hostile = "wolf' \"<b>&\x01\x1B[31m\xFF\xE2\x80\xAE 🐟 שלום `touch X` $(touch X)";
  std::string tps;
  for (int i = 0; i < 4; ++i)
    tps += "LM=4\n" + std::to_string(i) + " 0\n10 " + std::to_string(i) + "\n10 10\n0 1" + std::to_string(i) +
           "\nID=" + hostile + std::to_string(i) + std::string(i == 0 ? 10000 : 0, 'w') + "\n";
  write("shapes.tps", tps);
  const ProgramRun pair = run(words("register shapes.tps#1 shapes.tps#2 -o pair --pictures png,svg,pdf -q"));
  EXPECT_EQ(pair.exit_code, 0) << pair.err;
  expect_pictures("pair/registration");
  const ProgramRun mean = run(words("atlas shapes.tps -o mean --pictures png,svg,pdf -q"));
  EXPECT_THAT(mean.exit_code, testing::AnyOf(0, 3)) << mean.err;
  for (const std::string stem : {"template", "modes", "scores"}) expect_pictures("mean/" + stem);
  expect_untouched();
}

// The picture and its numbers are there, whatever becomes of the animation.
TEST_F(PictureNames, AnAnimationThatFailsIsAWarning) {
  register_squares();
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  std::filesystem::create_directory("bin");
  write("bin/ffmpeg", "#!/bin/sh\necho 'no such codec' >&2\nexit 1\n");
  std::filesystem::permissions("bin/ffmpeg", std::filesystem::perms::owner_all);
  const std::string failing = (std::filesystem::current_path() / "bin").string() + ":/usr/bin:/bin";
  for (const auto& [path, why] : {std::pair(failing, "ffmpeg failed: no such codec"),
                                  std::pair(std::string("/nowhere"), "animations need ffmpeg")}) {
    std::filesystem::remove("w.png");
    const ProgramRun done = run(words("warp out/registration.json grey.png -o w.png --animate a.gif --json w.json -q"),
                                {.search_path = path});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.err, HasSubstr(std::string("warning: a.gif was not written: ") + why));
    EXPECT_THAT(contents("w.png"), StartsWith("\x89PNG"));
    EXPECT_TRUE(std::filesystem::exists("w.json"));
    EXPECT_FALSE(std::filesystem::exists("a.gif"));
  }
}

// No program is looked for where there is no animation.
TEST_F(PictureNames, PicturesNeedNoOtherProgram) {
  write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
  const ProgramRun done = run(words("register a.csv a.csv -o out -q"), {.search_path = "/nowhere"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_THAT(names_in("out"), ElementsAre("registration.json", "registration.png", "registration.svg", "report.html",
                                           "residuals.csv", "trajectory.csv"));
}

}  // namespace
}  // namespace pulson
