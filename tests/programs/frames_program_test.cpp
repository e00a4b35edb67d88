// How coordinates lie on pictures: what files say of it, in every verb.

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"
#include "pulson/images/pages.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class FramesProgram : public Program {
 protected:
  static constexpr int kWide = 90, kHigh = 60;

  // A black frame, its upper left quarter white.
  static images::Image photo(int width = kWide, int height = kHigh) {
    images::Image image(width, height, 1, images::PixelType::kUint8);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        image.values<std::uint8_t>()[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                     static_cast<std::size_t>(x)] = 2 * x < width && 2 * y < height ? 255 : 0;
    return image;
  }

  static std::string tps(const std::vector<std::array<double, 2>>& rows, double unit, const std::string& more) {
    std::string text = "LM=" + std::to_string(rows.size()) + "\n";
    for (const auto& [x, y] : rows) text += std::to_string(unit * x) + " " + std::to_string(unit * (kHigh - y)) + "\n";
    return text + more;
  }

  void SetUp() override {
    Program::SetUp();
    write_image("photo.png", photo());
    write("a.csv", "x,y\n10,8\n80,10\n75,50\n12,52\n40,30\n");
    write("b.csv", "x,y\n12,9\n78,8\n77,52\n10,50\n43,32\n");
    write("a.tps", tps(kFirst, 1, "IMAGE=other.png\nSCALE=0.05\nID=a\n"));
    write("b.tps", tps(kSecond, 1, "IMAGE=other.png\nSCALE=0.05\nID=b\n"));
  }

  static ProgramRun done(const std::string& line) {
    ProgramRun result = run(words(line));
    EXPECT_EQ(result.exit_code, 0) << line << '\n' << result.err;
    return result;
  }

  static void expect_refused(const std::string& line, const std::string& words_of_error) {
    const ProgramRun result = run(words(line));
    EXPECT_EQ(result.exit_code, 2) << line << '\n' << result.out;
    EXPECT_THAT(result.err, HasSubstr(words_of_error)) << line;
    const std::size_t last = result.err.rfind('\n', result.err.size() - 2);  // before it notes on the files
    EXPECT_THAT(result.err.substr(last + 1), HasSubstr("pulson: ")) << result.err;
  }

  static void expect_same_picture(const std::string& one, const std::string& other) {
    EXPECT_EQ(contents(one), contents(other)) << one << " and " << other;
  }

  static const std::vector<std::array<double, 2>> kFirst, kSecond;
};

const std::vector<std::array<double, 2>> FramesProgram::kFirst = {{10, 8}, {80, 10}, {75, 50}, {12, 52}, {40, 30}};
const std::vector<std::array<double, 2>> FramesProgram::kSecond = {{12, 9}, {78, 8}, {77, 52}, {10, 50}, {43, 32}};

// The same landmarks, counted up, scaled, in csv made of them, and counted down.
TEST_F(FramesProgram, OfOneShapeGiveOnePictureHoweverItIsWritten) {
  done("register a.csv b.csv -o rows --no-picture -q");
  done("warp rows photo.png -o rows.png --size 90x60 -q");
  done("register a.tps b.tps -o up --no-picture -q");
  done("warp up photo.png -o up.png --size 90x60 -q");
  expect_same_picture("rows.png", "up.png");
  done("register a.tps b.tps -o scaled --scale apply --no-picture -q");
  done("warp scaled photo.png -o scaled.png --size 90x60 -q");
  expect_same_picture("rows.png", "scaled.png");
  for (const std::string name : {"a", "b"}) {
    done("convert " + name + ".tps up_" + name + ".csv -q");
    done("convert " + name + ".tps up_" + name + ".json -q");
    done("convert " + name + ".tps scaled_" + name + ".csv --scale apply -q");
  }
  for (const std::string from : {"up_?.csv", "up_?.json", "scaled_?.csv"}) {
    const auto named = [&](char letter) { return std::string(from).replace(from.find('?'), 1, 1, letter); };
    done("register " + named('a') + " " + named('b') + " -o again --no-picture -q");
    done("warp again photo.png -o again.png --size 90x60 -q");
    expect_same_picture("rows.png", "again.png");
  }
}

TEST_F(FramesProgram, AreSaidInTheFirstLineOfTables) {
  EXPECT_THAT(done("convert a.tps a_up.csv").err, HasSubstr("first line says how its points lie"));
  EXPECT_THAT(contents("a_up.csv"), HasSubstr("# frame: y=up\nx,y\n"));
  done("convert a.csv again.csv -q");
  EXPECT_EQ(contents("again.csv").find('#'), std::string::npos) << "which is as in rows of a picture";
  write("full.csv", "# frame: y=up unit=0.5 origin=1,2 size=90x60 orientation=displayed\nx,y\n1,2\n3,5\n");
  done("convert full.csv full.json -q");
  const auto frame = read_json("full.json")["shapes"][0]["frame"];
  EXPECT_EQ(frame["unit_per_pixel"], 0.5);
  EXPECT_EQ(frame["y_down"], false);
  EXPECT_EQ(frame["orientation"], "displayed");
  EXPECT_EQ(frame["width"], 90);
  EXPECT_EQ(frame["height"], 60);
  done("convert full.json full_again.csv -q");
  EXPECT_EQ(contents("full_again.csv"), contents("full.csv"));
  for (const std::string wrong :
       {"y=sideways", "size=90", "unit=-1", "size=1.5x3", "up", "unit=two", "origin=1,", "w=3"}) {
    write("wrong.csv", "# frame: " + wrong + "\nx,y\n1,2\n3,5\n");
    expect_refused("info wrong.csv", "wrong.csv:1: '" + wrong + "' is no part of a frame");
  }
}

TEST_F(FramesProgram, AreInRecords) {
  done("register a.tps b.tps -o up --scale apply --no-picture -q");
  const auto record = read_json("up/registration.json");
  EXPECT_EQ(record["frame"]["unit_per_pixel"], 0.05);
  EXPECT_EQ(record["frame"]["y_down"], false);
  EXPECT_EQ(record["target_shape"]["frame"]["y_down"], false);
  done("register a.csv b.csv -o rows --image photo.png --no-picture -q");
  EXPECT_EQ(read_json("rows/registration.json")["frame"]["width"], kWide);
  EXPECT_EQ(read_json("rows/registration.json")["frame"]["height"], kHigh);
  EXPECT_EQ(read_json("rows/registration.json")["frame"]["y_down"], true);
}

TEST_F(FramesProgram, ThatCountYInTwoDirectionsAreConvertedByTheHeightOrRefused) {
  for (const std::string line : {"register a.tps b.csv -o out", "atlas a.tps b.csv b.csv -o out",
                                 "compare a.tps b.csv -o out --noise none", "register a.csv b.tps -o out"})
    expect_refused(line, "and the height of the picture of ");
  write("other.csv", "# frame: y=up\nx,y\n10,52\n80,50\n75,10\n12,8\n40,30\n");
  expect_refused("register other.csv b.csv -o out", "--flip-y (up) or --no-flip-y (down) says it for all files");
  done("register other.csv b.csv -o out --flip-y --no-picture -q");
  // The picture that the tps names is there now.
  write_image("other.png", photo());
  done("register a.csv b.csv -o rows --no-picture -q");
  const ProgramRun mixed = done("register a.tps b.csv -o mixed --no-picture");
  EXPECT_THAT(mixed.err, HasSubstr("converted by the height of its picture, 60 pixels"));
  for (const std::string record : {"rows", "mixed"}) done("warp " + record + " photo.png -o " + record + ".png -q");
  expect_same_picture("rows.png", "mixed.png");
}

TEST_F(FramesProgram, OfPointsAreTheirOwnAfterTheWarp) {
  done("register a.csv b.csv -o rows --image photo.png --no-picture -q");
  const ProgramRun moved = done("warp rows a.tps -o moved.tps");
  EXPECT_THAT(moved.err, HasSubstr("converted by the height of its picture, 60 pixels"));
  const Landmarks shape = formats::read_landmarks("moved.tps");
  for (int i = 0; i < 5; ++i) {
    const auto& [x, y] = kSecond[static_cast<std::size_t>(i)];
    EXPECT_NEAR(shape.points(0, i), x, 0.2);
    EXPECT_NEAR(shape.points(1, i), kHigh - y, 0.2);
  }
  done("register a.csv b.csv -o unknown --no-picture -q");
  expect_refused("warp unknown a.tps -o moved.tps", "and the height of the picture of a.tps is not known");
  done("warp unknown a.tps --no-flip-y -o rows_of_tps.csv -q");
  write("scaled.csv", "# frame: y=up unit=0.05\nx,y\n0.5,2.6\n4,2.5\n");
  done("register a.tps b.tps -o scaled --scale apply --no-picture -q");
  done("warp scaled scaled.csv -o in_units.csv -q");
  EXPECT_NEAR(formats::read_landmarks("in_units.csv").points(0, 1), 0.05 * 78, 0.02);
}

TEST_F(FramesProgram, OfConvertedFilesAreThoseOfTheFormat) {
  write("face.json",
        R"({"version": "5", "shapes": [{"label": "a", "points": [[1, 2]], "shape_type": "point"}],
            "imagePath": "none.jpg", "imageData": null})");
  expect_refused("convert face.json face.tps", "tps counts y upwards, face.json in the other direction");
  done("convert face.json face.tps --flip-y 60 -q");
  EXPECT_THAT(contents("face.tps"), HasSubstr("1 58\n"));
  EXPECT_THAT(done("convert a.csv a_again.tps").err, HasSubstr("does not say how it counts"));
  write("up.csv", "# frame: y=up size=90x60\nx,y\n1,2\n");
  EXPECT_THAT(done("convert up.csv up.pts").err, HasSubstr("converted by the height of the picture, 60 pixels"));
  EXPECT_THAT(contents("up.pts"), HasSubstr("1 58\n"));
  expect_refused("convert a.tps a.csv -o both.csv", "and the height of the picture of a.csv is not known");
}

// Points in pixels through a registration in centimetres, and back.
TEST_F(FramesProgram, OfPointsInOtherUnitsAreConverted) {
  write_image("other.png", photo());
  done("register a.tps b.tps -o scaled --scale apply --no-picture -q");
  write("points.json",
        R"({"version": "5", "shapes": [{"label": "a", "points": [[80, 10]], "shape_type": "point"}],
            "imagePath": "other.png", "imageData": null, "imageWidth": 90, "imageHeight": 60})");
  EXPECT_THAT(done("warp scaled points.json -o moved.csv").err, HasSubstr("converted"));
  const Landmarks moved = formats::read_landmarks("moved.csv");
  EXPECT_NEAR(moved.points(0, 0), 78, 0.2);
  EXPECT_NEAR(moved.points(1, 0), 8, 0.2);
  done("warp scaled a.tps -o moved.tps -q");
  EXPECT_NEAR(formats::read_landmarks("moved.tps").points(0, 1), 78, 0.2);
  done("register a.tps b.tps -o pixels --no-picture -q");
  write("cm.csv", "# frame: y=up unit=0.05\nx,y\n4,2.5\n");
  done("warp pixels cm.csv -o cm_moved.csv -q");
  EXPECT_NEAR(formats::read_landmarks("cm_moved.csv").points(0, 0), 0.05 * 78, 0.01);
  // What an option said of the picture is no unit of the landmarks' file.
  done("register a.csv b.csv -o option --image photo.png --pixel-size 1 --no-picture -q");
  done("warp option a.csv -o again.csv -q");
  EXPECT_NEAR(formats::read_landmarks("again.csv").points(0, 1), 78, 0.2);
}

TEST_F(FramesProgram, OfMovedPointsAreOfTheTargetsPicture) {
  write("s.csv", "# frame: y=down size=90x60\nx,y\n10,8\n80,10\n75,50\n12,52\n40,30\n");
  write("t.csv", "# frame: y=down size=180x120\nx,y\n20,16\n160,20\n150,100\n24,104\n80,60\n");
  done("register s.csv t.csv -o out --no-picture -q");
  done("warp out s.csv -o m.csv -q");
  EXPECT_THAT(contents("m.csv"), HasSubstr("# frame: y=down size=180x120\n"));
  done("warp out m.csv --inverse -o back.csv -q");
  EXPECT_THAT(contents("back.csv"), HasSubstr("# frame: y=down size=90x60\n"));
  write("up.csv", "# frame: y=up size=90x60\nx,y\n10,52\n");
  done("warp out up.csv -o up_moved.csv -q");
  EXPECT_THAT(contents("up_moved.csv"), HasSubstr("# frame: y=up size=180x120\n"));
  EXPECT_NEAR(formats::read_landmarks("up_moved.csv").points(1, 0), 120 - 16, 0.5);
  write("turned.csv", "# frame: y=down size=60x90\nx,y\n10,52\n");
  expect_refused("warp out turned.csv -o m.csv", "the one is turned against the other");
}

TEST_F(FramesProgram, OfJoinedFilesAreOfOneDirection) {
  write("s.csv", "# frame: y=down size=90x60\nx,y\n10,8\n80,10\n");
  write("u.csv", "# frame: y=up size=90x60\nx,y\n10,52\n80,50\n");
  done("convert s.csv u.csv -o both.npy -q");
  const formats::LandmarkFile both = formats::read_landmark_file("both.npy");
  ASSERT_EQ(both.shapes.size(), 2U);
  EXPECT_LE((both.shapes[0].points - both.shapes[1].points).norm(), 1e-12);
  expect_refused("convert a.csv b.tps -o mixed.tps", "and the height of the picture of a.csv is not known");
}

// ---- the canvas

TEST_F(FramesProgram, OfTheResultHoldTheTargetAndTheWarpedImage) {
  struct Case {
    std::string name, target;
    int width, height;
    std::array<int, 2> first;
  };
  const std::vector<Case> cases = {
      {"same", "10,8\n80,10\n75,50\n12,52\n40,30\n", kWide, kHigh, {0, 0}},
      {"twice", "20.5,16.5\n160.5,20.5\n150.5,100.5\n24.5,104.5\n80.5,60.5\n", 2 * kWide, 2 * kHigh, {0, 0}},
      {"elsewhere", "-490,-492\n-420,-490\n-425,-450\n-488,-448\n-460,-470\n", kWide, kHigh, {-500, -500}},
      {"beside", "20,-12\n90,-10\n85,30\n22,32\n50,10\n", kWide + 10, kHigh + 20, {0, -20}},
  };
  for (const Case& each : cases) {
    write("t.csv", "x,y\n" + each.target);
    done("register a.csv t.csv -o out --no-picture -q");
    done("warp out photo.png -o w.png --json w.json -q");
    const images::Image result = images::read_image("w.png");
    EXPECT_EQ(result.width(), each.width) << each.name;
    EXPECT_EQ(result.height(), each.height) << each.name;
    EXPECT_EQ(read_json("w.json")["first_pixel"], nlohmann::json(each.first)) << each.name;
    done("warp out w.png --inverse -o back.png --size 90x60 --target-origin 0,0 --origin " +
         std::to_string(each.first[0]) + "," + std::to_string(each.first[1]) + " -q");
  }
}

TEST_F(FramesProgram, WhoseResultMissesTheTargetAreRefused) {
  write("t.csv", "x,y\n-490,-492\n-420,-490\n-425,-450\n-488,-448\n-460,-470\n");
  done("register a.csv t.csv -o out --no-picture -q");
  expect_refused("warp out photo.png -o w.png --size 90x60", "none of the landmarks of t.csv lies on the result");
  expect_refused("warp out photo.png -o w.png --like photo.png", "5 of 5 landmarks of t.csv lie outside photo.png");
  EXPECT_FALSE(std::filesystem::exists("w.png"));
  done("warp out photo.png -o w.png --size 90x60 --target-origin=-500,-500 -q");
  write("far.csv", "x,y\n490,492\n420,490\n425,450\n488,448\n460,470\n");
  done("register a.csv far.csv -o out --no-picture -q");
  expect_refused("warp out photo.png -o w.png --size 5000x5000 --max-pixels 1000000", "--max-pixels");
}

TEST_F(FramesProgram, WithLandmarksOutsideThePictureNameTheLikeliestOption) {
  done("register a.csv b.csv -o out --no-picture -q");
  write_image("small.png", photo(20, 40));
  expect_refused("warp out small.png -o w.png", "as in --pixel-size 4");
  write("low.csv", "x,y\n10,-8\n80,-10\n75,-50\n12,-52\n40,-30\n");
  done("register low.csv low.csv -o low --no-picture -q");
  expect_refused("warp low photo.png -o w.png", "5 of 5 landmarks of low.csv lie outside photo.png");
  write("cm.csv", "x,y\n0.10,0.08\n0.80,0.10\n0.75,0.50\n0.12,0.52\n0.40,0.30\n");
  done("register cm.csv cm.csv -o cm --no-picture -q");
  expect_refused("warp cm photo.png -o w.png", "--pixel-size says how many units");
  done("warp cm photo.png --pixel-size 0.01 -o w.png -q");
  write("edge.csv", "x,y\n10,8\n80,10\n75,50\n12,52\n-5,30\n");
  done("register edge.csv edge.csv -o edge --no-picture -q");
  expect_refused("warp edge photo.png -o w.png", "where they are meant to, --pixel-size 1 says so");
  EXPECT_THAT(done("warp edge photo.png -o w.png --pixel-size 1").err, HasSubstr("warning: 1 of 5 landmarks"));
}

TEST_F(FramesProgram, OfCopiesOfAnotherSizeAreFoundByTheSize) {
  const std::string points =
      R"({"label": "a", "points": [[%, 80]], "shape_type": "point"}, {"label": "b", "points": [[800, 100]], "shape_type": "point"},
         {"label": "c", "points": [[750, 500]], "shape_type": "point"}, {"label": "d", "points": [[400, 300]], "shape_type": "point"})";
  const auto labelme = [&](const std::string& x, int width, int height) {
    std::string text = points;
    text.replace(text.find('%'), 1, x);
    return R"({"version": "5", "shapes": [)" + text +
           R"(], "imagePath": "none.jpg", "imageData": null, "imageWidth": )" + std::to_string(width) +
           ", \"imageHeight\": " + std::to_string(height) + "}";
  };
  write("a.json", labelme("100", 10 * kWide, 10 * kHigh));
  write("b.json", labelme("130", 10 * kWide, 10 * kHigh));
  done("register a.json b.json -o out --no-picture -q");
  const ProgramRun copy = done("warp out photo.png -o copy.png --like photo.png --json w.json");
  EXPECT_THAT(copy.err, HasSubstr("it is taken for a copy of another size, 10 pixels to one"));
  EXPECT_EQ(read_json("w.json")["pixel_size"], nlohmann::json({10, 10}));
  write("tenth_a.csv", "label,x,y\na,9.55,7.55\nb,79.55,9.55\nc,74.55,49.55\nd,39.55,29.55\n");
  write("tenth_b.csv", "label,x,y\na,12.55,7.55\nb,79.55,9.55\nc,74.55,49.55\nd,39.55,29.55\n");
  done("register tenth_a.csv tenth_b.csv -o tenth --no-picture -q");
  done("warp tenth photo.png -o tenth.png --size 90x60 -q");
  expect_same_picture("copy.png", "tenth.png");
  done("warp out photo.png -o alone.png -q");
  expect_same_picture("copy.png", "alone.png");
  write_image("square.png", photo(70, 70));
  expect_refused("warp out square.png -o w.png", "it is another picture");
}

// A target on another picture has its own size, however the image was reduced.
TEST_F(FramesProgram, OfResultsAreThoseOfTheTargetsPicture) {
  write("large.csv", "# frame: y=down size=900x600\nx,y\n100,80\n800,100\n750,500\n120,520\n400,300\n");
  write("small.csv", "# frame: y=down size=90x60\nx,y\n10,8\n80,10\n75,50\n12,52\n40,30\n");
  done("register large.csv small.csv -o out --no-picture -q");
  done("warp out photo.png -o w.png -q");
  EXPECT_NEAR(images::read_image("w.png").width(), kWide, 1);
  EXPECT_NEAR(images::read_image("w.png").height(), kHigh, 1);
}

TEST_F(FramesProgram, OfTurnedPicturesGoWithThePixels) {
  images::Page page{photo(), {}};
  page.about.orientation = 6;
  write_pages("turned.tif", std::vector{page});
  done("register a.csv b.csv -o rows --no-picture -q");
  done("warp rows turned.tif -o stored.tif --size 90x60 -q");
  EXPECT_EQ(images::read_pages("stored.tif").pages.front().about.orientation, 6);
  done("warp rows turned.tif --like photo.png -o like.tif -q");
  EXPECT_EQ(images::read_pages("like.tif").pages.front().about.orientation, 1) << "its pixels are those of photo.png";
  write("shown.csv", "# frame: y=down size=60x90 orientation=displayed\nx,y\n10,8\n50,10\n45,80\n12,70\n30,40\n");
  done("register shown.csv shown.csv -o shown --no-picture -q");
  done("warp shown turned.tif -o shown.tif -q");
  const images::PictureFile shown = images::read_pages("shown.tif");
  EXPECT_EQ(shown.pages.front().about.orientation, 1);
  EXPECT_EQ(shown.pages.front().image.width(), kHigh);
  EXPECT_EQ(shown.pages.front().image.height(), kWide);
}

// What is drawn is what is warped.
TEST_F(FramesProgram, OfDrawingsAreThoseOfWarps) {
  done("register a.csv b.csv -o out");
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"down\":true"));
  done("register a.csv b.csv -o out --flip-y");
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"down\":false"));
  done("warp out photo.png -o w.png -q --json w.json");
  EXPECT_EQ(read_json("w.json")["flip_y"], true) << "as the record says";
}

}  // namespace
}  // namespace pulson
