// The verb `warp`: what it writes and reports.

#include "warp_program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "core/text.hpp"
#include "image_examples.hpp"
#include "pulson/fields/grid_fields.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::Ge;
using testing::HasSubstr;
using testing::Le;
using testing::Not;

TEST_F(WarpProgram, WritesAllThatIsAskedForOfAFoldingMap) {
  register_discs();
  const ProgramRun done =
      warp(discs(), std::string(kFrame) +
                        "-o w.png --json w.json --field f.mha --jacobian j.png --log-jacobian l.tif --multiplicity "
                        "m.mha --folds folds.png --holes holes.png --grid g.png --side-by-side s.png");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("method     push: the map folds"), HasSubstr("y up (flipped)"),
                              HasSubstr("colours    j.png: blue 0, white 1, red 2, yellow below 0\nseconds")));
  const nlohmann::json recorded = read_json("w.json");
  EXPECT_THAT(recorded["folded_fraction"].get<double>(), AllOf(Ge(0.1), Le(0.4)));
  EXPECT_LT(recorded["min_jacobian"], -1);
  EXPECT_GE(recorded["max_multiplicity"], 3);
  EXPECT_GT(recorded["uncovered_fraction"], 0);
  EXPECT_LE(recorded["landmark_error_max"], 1e-8);
  EXPECT_LE(recorded["map_error"], 0.05);
  EXPECT_GT(recorded["seconds"], 0);
  const images::Image warped = images::read_image("w.png");
  EXPECT_EQ(warped.channels(), 3);
  const images::Image source = images::read_image(discs());
  // Disc centres, which are landmarks, have changed places.
  const std::vector<double> left = pixel(source, 150, 180), right = pixel(source, 450, 180);
  ASSERT_NE(left, right);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(warped.at(450, 180, c), left[static_cast<std::size_t>(c)], 20);
    EXPECT_NEAR(warped.at(150, 180, c), right[static_cast<std::size_t>(c)], 20);
  }
  const fields::GridField counts = fields::read_grid_field("m.mha");
  EXPECT_EQ(*std::max_element(counts.values.begin(), counts.values.end()), recorded["max_multiplicity"].get<float>());
  EXPECT_THAT(fields::read_grid_field("f.mha").sizes, ElementsAre(600, 360));
  const images::Image folds = images::read_image("folds.png");
  const auto mask = folds.values<std::uint8_t>();
  const double folded =
      static_cast<double>(std::count(mask.begin(), mask.end(), 255)) / static_cast<double>(mask.size());
  EXPECT_DOUBLE_EQ(folded, recorded["folded_fraction"]);
  EXPECT_EQ(images::read_image("l.tif").type(), images::PixelType::kFloat32);
  for (const char* picture : {"holes.png", "g.png"}) EXPECT_EQ(images::read_image(picture).width(), 600) << picture;
  for (const char* drawing : {"j.png", "s.png"}) EXPECT_GT(images::read_image(drawing).width(), 1200) << drawing;
}

// A fold has no logarithm: it is yellow, not white as where areas stay.
TEST_F(WarpProgram, MarksFoldsInTheLogarithmOfTheJacobian) {
  register_discs();
  const ProgramRun done = warp(discs(), std::string(kFrame) + "-o w.png --log-jacobian l.svg");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("colours    l.svg: blue -2, white 0, red 2, yellow folds\n"));
  EXPECT_THAT(text::read_text_file("l.svg"), AllOf(HasSubstr(">folds<"), HasSubstr("≤ −2"), HasSubstr("≥ 2")));
}

TEST_F(WarpProgram, DrawsWithCaptionsAndColourBars) {
  register_squares("none --align none");
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  const ProgramRun done =
      warp("grey.png",
           "-o w.png --like grey.png --side-by-side s.svg --numbers --overlay o.svg --jacobian j.svg "
           "--displacement d.tif --log-jacobian l.png --width 50 --dpi 254");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string both = text::read_text_file("s.svg"), overlay = text::read_text_file("o.svg");
  EXPECT_THAT(both, AllOf(HasSubstr("a → b"), HasSubstr("grey.png"), HasSubstr("Warped to the target"),
                          HasSubstr("landmarks of the target"), HasSubstr(">4</")));
  EXPECT_THAT(overlay, AllOf(HasSubstr("Checkerboard of both"), HasSubstr("Half of each"), HasSubstr("Difference")));
  EXPECT_THAT(text::read_text_file("j.svg"), AllOf(HasSubstr("Jacobian"), HasSubstr("≥ 2"), Not(HasSubstr("below 0"))));
  EXPECT_EQ(images::read_image("l.png").width(), 500);
  const nlohmann::json end = read_json("out/registration.json")["result"][3];
  const double far = std::hypot(end[0].get<double>() - 4, end[1].get<double>() - 12);
  EXPECT_NEAR(images::read_image("d.tif").at(4, 12, 0), far, 0.05);
  for (const auto& file : std::filesystem::directory_iterator("."))
    EXPECT_THAT(file.path().string(), Not(HasSubstr(".part-")));
}

TEST_F(WarpProgram, ReportsOnImagesAndPoints) {
  register_squares();
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  ProgramRun done = warp("grey.png", "-o w.png --like grey.png --report page.html");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  std::string page = contents("page.html");
  EXPECT_THAT(page, AllOf(HasSubstr("<h1>grey.png → w.png</h1>"), HasSubstr("\"mesh\":["), HasSubstr("class=\"over\""),
                          HasSubstr("smallest Jacobian"), HasSubstr("--report page.html</code>")));
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  done = warp("a.csv", "-o moved.csv --report page.html --inverse");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  page = contents("page.html");
  EXPECT_THAT(page, AllOf(HasSubstr("x, warped"), HasSubstr("target to source"), HasSubstr("<canvas")));
  done = warp("a.csv", "-o moved.csv --report no/page.html");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, HasSubstr("there is no folder 'no'"));
}

// A picture beside the result that fails is a warning: the result and its numbers are there.
TEST_F(WarpProgram, WritesItsResultAndNumbersBeforeAllElse) {
  register_squares();
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  std::filesystem::create_directory("bin");
  write("bin/ffmpeg", "#!/bin/sh\nexit 1\n");
  std::filesystem::permissions("bin/ffmpeg", std::filesystem::perms::owner_all);
  const std::string path = std::filesystem::absolute("bin").string();
  const auto warp_with = [&](const std::string& options) {
    const ProgramRun done =
        run(words("warp out/registration.json grey.png -o w.png --json w.json --size 17x17 " + options),
            {.search_path = path});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(images::read_image("w.png").width(), 17);
    EXPECT_EQ(read_json("w.json")["method"], "pull");
    EXPECT_THAT(done.out, HasSubstr("method     pull"));
    std::filesystem::remove("w.png");
    std::filesystem::remove("w.json");
    return done.err;
  };
  const std::string failed = warp_with("--animate a.mp4 --jacobian j.tif");
  EXPECT_THAT(failed, testing::StartsWith("warning: a.mp4 was not written: ffmpeg "));
  EXPECT_EQ(count_lines(failed), 1U) << failed;
  EXPECT_TRUE(std::filesystem::exists("j.tif"));
  EXPECT_FALSE(std::filesystem::exists("a.mp4"));
  std::filesystem::remove("bin/ffmpeg");
  EXPECT_THAT(warp_with("--animate a.gif"), HasSubstr("warning: a.gif was not written: animations need ffmpeg"));
}

TEST_F(WarpProgram, PullsWhereTheMapHasAnInverseAndBackAgain) {
  register_squares();
  std::vector<float> values;
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 17; ++x) values.push_back(static_cast<float>(100 + 5 * x - 3 * y));
  write_image("ramp.tif", images::Image(17, 17, 1, std::span<const float>(values)));
  ProgramRun done = warp("ramp.tif", "-o there.tif --size 17x17 --border replicate --json -");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  nlohmann::json recorded = nlohmann::json::parse(done.out);
  EXPECT_EQ(recorded["method"], "pull");
  EXPECT_EQ(recorded["folded_fraction"], 0);
  EXPECT_GT(recorded["min_jacobian"], 0);
  // The landmark (4, 12) is now at (3, 13), and (12, 12) at (13, 12).
  EXPECT_NEAR(images::read_image("there.tif").at(3, 13, 0), 100 + 5 * 4 - 3 * 12, 0.2);
  EXPECT_NEAR(images::read_image("there.tif").at(13, 12, 0), 100 + 5 * 12 - 3 * 12, 0.2);
  done = warp("there.tif", "-o back.tif --size 17x17 --border replicate --inverse -q --json w.json");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.out, "");
  EXPECT_EQ(read_json("w.json")["inverse"], true);
  const images::Image back = images::read_image("back.tif");
  for (int y = 5; y < 12; ++y)
    for (int x = 5; x < 12; ++x) EXPECT_NEAR(back.at(x, y, 0), 100 + 5 * x - 3 * y, 0.3);
  // Pushed, it is the same picture.
  done = warp("ramp.tif", "-o pushed.tif --size 17x17 --method push --border constant -q");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const images::Image pulled = images::read_image("there.tif"), pushed = images::read_image("pushed.tif");
  for (int y = 4; y < 13; ++y)
    for (int x = 4; x < 13; ++x) EXPECT_NEAR(pushed.at(x, y, 0), pulled.at(x, y, 0), 0.5);
}

TEST_F(WarpProgram, CarriesLandmarksOntoTheResultAndBack) {
  register_squares();
  write("more.csv", "label,x,y\np,4,12\nq,NA,NA\nr,12,4\n");
  ASSERT_EQ(warp("more.csv", "-o moved.csv --json w.json").exit_code, 0);
  const Points moved = formats::read_landmarks("moved.csv").points;
  const nlohmann::json record = read_json("out/registration.json");
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(moved(axis, 0), record["result"][3][axis], 1e-9);
    EXPECT_NEAR(moved(axis, 2), record["result"][1][axis], 1e-9);
    EXPECT_TRUE(std::isnan(moved(axis, 1)));
  }
  EXPECT_EQ(read_json("w.json")["method"], "points");
  ASSERT_EQ(warp("moved.csv", "-o back.csv --inverse").exit_code, 0);
  const Points back = formats::read_landmarks("back.csv").points;
  EXPECT_LE((back.col(0) - Eigen::Vector2d(4, 12)).norm(), 1e-9);
}

// The corners of the source go where the registration says, as landmarks of any shape, along curves and in any format.
TEST_F(WarpProgram, CarriesAllPointsOfAFile) {
  register_squares();
  write("more.tps",
        "LM=1\n4 12\nCURVES=1\nPOINTS=2\n4 4\n12 4\nIMAGE=a.png\nID=one\nSCALE=0.5\n"
        "LM=2\n12 12\n4 4\nIMAGE=b.png\nID=two\n");
  ASSERT_EQ(warp("more.tps", "--no-flip-y -o moved.tps").exit_code, 0);
  const formats::LandmarkFile moved = formats::read_landmark_file("moved.tps");
  const nlohmann::json record = read_json("out/registration.json");
  const auto expect_corner = [&](const auto& point, int corner) {
    for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(point[axis], record["result"][corner][axis], 1e-9);
  };
  ASSERT_EQ(moved.shapes.size(), 2U);
  const Landmarks &one = moved.shapes[0], &two = moved.shapes[1];
  EXPECT_EQ(one.name + two.name, "onetwo");
  EXPECT_EQ(one.image + two.image, "") << "they lie on another image now";
  EXPECT_FALSE(one.scale);
  expect_corner(one.points.col(0), 3);
  ASSERT_EQ(one.curves.size(), 1U);
  expect_corner(one.curves[0].col(0), 0);
  expect_corner(one.curves[0].col(1), 1);
  expect_corner(two.points.col(0), 2);
  expect_corner(two.points.col(1), 0);
  const ProgramRun lossy = warp("more.tps", "--no-flip-y -o moved.pts");
  EXPECT_EQ(lossy.exit_code, 2) << "pts holds one shape";
  const ProgramRun one_shape = warp("more.tps#1", "--no-flip-y -o moved.pts");
  EXPECT_EQ(one_shape.exit_code, 0) << one_shape.err;
  EXPECT_THAT(one_shape.err, HasSubstr("note: ")) << "what pts does not hold";
}

TEST_F(WarpProgram, FlipsYForTpsFiles) {
  write("two.tps", "LM=4\n4 4\n12 4\n12 12\n4 12\nID=a\nLM=4\n4 3\n13 5\n13 12\n3 13\nID=b\n");
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  ASSERT_EQ(run(words("register two.tps#1 two.tps#2 -o out --no-picture -q")).exit_code, 0);
  ASSERT_EQ(warp("grey.png", "-o w.png -q --json w.json").exit_code, 0);
  EXPECT_EQ(read_json("w.json")["flip_y"], true);
  EXPECT_EQ(read_json("w.json")["target_flip_y"], true);
  ASSERT_EQ(warp("grey.png", "-o w.png -q --json w.json --no-flip-y").exit_code, 0);
  EXPECT_EQ(read_json("w.json")["flip_y"], false);
  register_squares();
  ASSERT_EQ(warp("grey.png", "-o w.png -q --json w.json").exit_code, 0);
  EXPECT_EQ(read_json("w.json")["flip_y"], false);
}

// A mirror of the whole plane is no fold.
TEST_F(WarpProgram, MirrorsByTheAlignment) {
  write("a.csv", "x,y\n4,4\n12,4\n12,12\n4,8\n");
  write("b.csv", "x,y\n12,4\n4,4\n4,12\n12,8\n");
  ASSERT_EQ(run(words("register a.csv b.csv -o out --align rigid --reflect --no-picture -q")).exit_code, 0);
  const images::Image image = uneven_image(17, 17, 3, images::PixelType::kUint8);
  write_image("a.png", image);
  for (const std::string method : {"pull", "push"}) {
    const ProgramRun done = warp("a.png", "-o w.png -q --json w.json --folds f.png --method " + method);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    const nlohmann::json recorded = read_json("w.json");
    EXPECT_EQ(recorded["method"], method);
    EXPECT_EQ(recorded["folded_fraction"], 0);
    EXPECT_NEAR(recorded["min_jacobian"], 1, 1e-6);
    EXPECT_EQ(recorded["max_multiplicity"], 1);
    EXPECT_THAT(images::read_image("f.png").values<std::uint8_t>(), Each(0));
    for (int x = 1; x < 16; ++x) EXPECT_EQ(pixel(images::read_image("w.png"), x, 5)[0], pixel(image, 16 - x, 5)[0]);
  }
  ASSERT_EQ(warp("a.csv", "-o moved.csv -q --json w.json").exit_code, 0);
  EXPECT_EQ(read_json("w.json")["folded_fraction"], 0);
  EXPECT_NEAR(read_json("w.json")["min_jacobian"], 1, 1e-6);
}

// Formats without alpha show what is not covered, and what was transparent, in white.
TEST_F(WarpProgram, PutsTheResultOnWhiteWhereTheFormatHasNoAlpha) {
  register_squares();
  const images::Image clear(40, 40, 4, images::PixelType::kUint8), red = [] {
    images::Image image(40, 40, 3, images::PixelType::kUint8);
    for (std::size_t i = 0; i < image.pixel_count(); ++i) image.values<std::uint8_t>()[3 * i] = 200;
    return image;
  }();
  write_image("clear.png", clear);
  write_image("red.png", red);
  for (const char* method : {"pull", "push"})
    for (const char* name : {"w.jpg", "W.JPG"}) {
      const std::string options = std::string("--method ") + method + " -q --size 60x60 -o " + name;
      ProgramRun done = warp("clear.png", options);
      ASSERT_EQ(done.exit_code, 0) << done.err;
      EXPECT_THAT(images::read_image(name).values<std::uint8_t>(), Each(Ge(250))) << name;
      done = warp("red.png", options);
      ASSERT_EQ(done.exit_code, 0) << done.err;
      EXPECT_GE(images::read_image(name).at(55, 55, 1), 250) << name;
      EXPECT_LE(images::read_image(name).at(20, 20, 1), 5) << name;
    }
  ASSERT_EQ(warp("red.png", "-q --size 60x60 --border transparent -o W.PNG").exit_code, 0);
  EXPECT_EQ(pixel(images::read_image("W.PNG"), 55, 55).back(), 0);
}

// What came in goes out: the same channels and depth, without an alpha channel that the image does not have.
TEST_F(WarpProgram, KeepsTheKindOfAnImage) {
  register_squares();
  for (const std::string method : {"pull", "push"})
    for (const images::PixelType depth : {images::PixelType::kUint8, images::PixelType::kUint16})
      for (const int channels : {1, 3, 4}) {
        SCOPED_TRACE(method + " " + describe(depth) + " " + std::to_string(channels));
        write_image("in.png", uneven_image(17, 17, channels, depth));
        ASSERT_EQ(warp("in.png", "-q --size 30x20 -o out.png --method " + method).exit_code, 0);
        const images::Image result = images::read_image("out.png");
        EXPECT_EQ(result.type(), depth);
        EXPECT_EQ(result.channels(), channels);
        EXPECT_EQ(pixel(result, 28, 18).back(), channels == 4 ? 0 : images::full_value(depth)) << "beyond the image";
      }
  fields::GridField grid{{17, 17}, {1, 1}, {0, 0}, 1, std::vector<float>(17 * 17, 100)};
  for (const fields::GridType type :
       {fields::GridType::kUint8, fields::GridType::kInt16, fields::GridType::kUint16, fields::GridType::kFloat32}) {
    grid.type = type;
    write_grid_field("in.mha", grid);
    for (const std::string name : {"out.mha", "out.nrrd"}) {
      ASSERT_EQ(warp("in.mha", "-q --size 30x20 -o " + name).exit_code, 0);
      const fields::GridField result = fields::read_grid_field(name);
      EXPECT_EQ(result.type, type) << name;
      EXPECT_EQ(result.values.back(), 0) << name;
      EXPECT_EQ(*std::max_element(result.values.begin(), result.values.end()), 100) << name;
    }
  }
}

TEST_F(WarpProgram, KeepsLabels) {
  register_discs();
  images::Image labels(600, 360, 1, images::PixelType::kUint8);
  constexpr std::array<std::uint8_t, 3> kLabels = {0, 5, 200};
  for (std::size_t i = 0; i < labels.pixel_count(); ++i)
    labels.values<std::uint8_t>()[i] = kLabels[(i % 600 / 23 + i / 600 / 17) % 3];
  write_image("labels.png", labels);
  const std::string options = std::string(kFrame) + "-q -o l.png --interpolation ";
  const auto values = [&](const std::string& more) {
    EXPECT_EQ(warp("labels.png", options + more).exit_code, 0);
    const images::Image result = images::read_image("l.png");
    EXPECT_EQ(result.channels(), 1);
    const auto pixels = result.values<std::uint8_t>();
    return std::set<int>(pixels.begin(), pixels.end());
  };
  EXPECT_THAT(values("label"), ElementsAre(0, 5, 200));
  EXPECT_THAT(values("label --border constant --background 7"), ElementsAre(0, 5, 7, 200));
  EXPECT_GT(values("nearest").size(), 4U) << "samples are averaged, and the fill is white";
  EXPECT_EQ(warp("labels.png", options + "label --samples 3").exit_code, 2);
}

// A grid's numbers have no white, and its own spacing and origin are kept.
TEST_F(WarpProgram, PutsNothingAroundGridsOfNumbers) {
  write("a.csv", "x,y\n10,20\n14,20\n14,24\n");
  const ProgramRun done = run(words("register a.csv a.csv -o out --no-picture -q"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  fields::GridField grid{{6, 4}, {2, 2}, {10, 20}, 1, std::vector<float>(24, 700)};
  grid.values[0] = -300;
  write_grid_field("ct.mha", grid);
  for (const std::string method : {"pull", "push"}) {
    const ProgramRun warped = warp("ct.mha", "-o w.mha --size 8x4 --method " + method);
    ASSERT_EQ(warped.exit_code, 0) << warped.err;
    const fields::GridField result = fields::read_grid_field("w.mha");
    EXPECT_EQ(result.spacing, grid.spacing);
    EXPECT_EQ(result.origin, grid.origin);
    EXPECT_THAT(std::vector(result.values.begin(), result.values.begin() + 8),
                ElementsAre(-300, 700, 700, 700, 700, 700, 0, 0));
  }
}

// The fields of noise are the map's, and samples of a map that never folds have no folds.
TEST_F(WarpProgram, FoldsNothingByNoiseWhoseDisplacementIsAField) {
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  for (const std::string noise : {"p-sd:beta=1", "kunita:beta=1,width=5"}) {
    register_squares(noise);
    for (const std::string how : {"--method pull", "--method push", "--samples 3 --fold-probability p.tif"}) {
      const ProgramRun done = warp("grey.png", "-o w.png -q --json w.json --folds f.png " + how);
      ASSERT_EQ(done.exit_code, 0) << done.err;
      const nlohmann::json recorded = read_json("w.json");
      EXPECT_EQ(recorded["folded_fraction"], 0) << noise << how;
      EXPECT_GT(recorded["min_jacobian"], 0) << noise << how;
      EXPECT_EQ(recorded["max_multiplicity"], 1) << noise << how;
      EXPECT_THAT(images::read_image("f.png").values<std::uint8_t>(), Each(0));
    }
    EXPECT_THAT(images::read_image("p.tif").values<float>(), Each(0));
    std::filesystem::remove_all("out");
  }
}

TEST_F(WarpProgram, SamplesTellMeanDeviationAndProbabilityOfFolds) {
  register_squares("ch-sd:beta=1");
  write_image("grey.png", uneven_image(17, 17, 1, images::PixelType::kUint8));
  const std::string options =
      "-o w.png --border transparent --samples 5 --deviation d.tif --fold-probability p.tif -q --threads ";
  ASSERT_EQ(warp("grey.png", options + "1").exit_code, 0);
  const auto files = all_files();
  const ProgramRun done = warp("grey.png", options + "3 --json w.json");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(changed_since(files), ElementsAre("./w.json"));
  EXPECT_EQ(read_json("w.json")["samples"], 5);
  EXPECT_EQ(read_json("w.json")["reason"], "mean over 5 samples");
  EXPECT_EQ(images::read_image("w.png").channels(), 2);
  const images::Image deviation = images::read_image("d.tif"), probability = images::read_image("p.tif");
  EXPECT_THAT(deviation.values<float>(), Each(Ge(0)));
  EXPECT_GT(*std::max_element(deviation.values<float>().begin(), deviation.values<float>().end()), 1);
  for (const float value : probability.values<float>()) EXPECT_NEAR(std::remainder(value, 0.2), 0, 1e-6);
}

}  // namespace
}  // namespace pulson
