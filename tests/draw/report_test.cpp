#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "picture_files.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {
namespace {

namespace fs = std::filesystem;

class ReportTest : public PictureTest {
 protected:
  static void write(const RegistrationPicture& picture) {
    write_registration_picture(picture, {"picture.png", "picture.svg"});
  }

  static std::string message_of_failed_write(const RegistrationPicture& picture) {
    return error_of([&] { write(picture); });
  }
};

/// n points on an arc of the unit circle from angle 0, without its end; other coordinates grow along it.
Points arc(int d, int n, double angle) {
  Points points(d, n);
  for (int i = 0; i < n; ++i) {
    points.col(i).setConstant(0.1 * i);
    points(0, i) = std::cos(angle * i / n);
    if (d > 1) points(1, i) = std::sin(angle * i / n);
  }
  return points;
}

/// A circle that is stretched and turned in four steps; the target lies a little beside the result.
RegistrationPicture example(int d, int n) {
  RegistrationPicture picture;
  picture.source.points = arc(d, n, 2 * std::numbers::pi);
  for (int k = 0; k <= 4; ++k) {
    picture.times.push_back(0.25 * k);
    picture.trajectory.emplace_back((1 + 0.1 * k) * picture.source.points);
  }
  picture.result = picture.trajectory.back();
  picture.target.points = picture.result.array() + 0.05;
  const Points line = 1.5 * Points::Random(2, 20);
  if (d == 1) picture.grid_paths = {line.cwiseAbs()};
  if (d == 2) picture.grid_before = picture.grid_after = {line, Points(2, 0)};
  picture.title = "source → target";
  picture.subtitle = "rms 0.05";
  return picture;
}

TEST_F(ReportTest, WritesBothFilesInEachDimension) {
  for (const int d : {1, 2, 3})
    for (const int n : {1, 2, 8, 40, 500}) {
      SCOPED_TRACE(testing::Message() << "d = " << d << ", N = " << n);
      write(example(d, n));
      expect_whole_pictures("picture.png", "picture.svg");
      EXPECT_EQ(files(), (std::set<std::string>{"picture.png", "picture.svg"}));
    }
}

TEST_F(ReportTest, DrawsDegenerateAndFarAwayShapes) {
  for (const int d : {1, 2, 3})
    for (const double offset : {0.0, 5.2e6, 1e300}) {
      SCOPED_TRACE(testing::Message() << "d = " << d << ", offset = " << offset);
      RegistrationPicture picture = example(d, 3);
      picture.source.points.setConstant(offset);
      picture.target.points = picture.result = picture.source.points;
      for (Points& points : picture.trajectory) points = picture.source.points;
      picture.grid_before = picture.grid_after = picture.grid_paths = {};
      write(picture);
      expect_whole_pictures("picture.png", "picture.svg");
    }
}

TEST_F(ReportTest, DrawsFlatAndUprightShapes) {
  for (const double stretch : {0.0, 1e-3, 0.3, 4.0, 1e4}) {
    SCOPED_TRACE(testing::Message() << "stretch = " << stretch);
    RegistrationPicture picture = example(2, 30);
    picture.grid_before = picture.grid_after = {};
    for (Points* points : {&picture.source.points, &picture.target.points, &picture.result}) points->row(1) *= stretch;
    for (Points& points : picture.trajectory) points.row(1) *= stretch;
    write(picture);
    expect_whole_pictures("picture.png", "picture.svg");
  }
}

TEST_F(ReportTest, ShowsSpecialCharactersAsTheyAre) {
  RegistrationPicture picture = example(2, 8);
  picture.title = "a_b^2 {c} @d 'e' \"f\" \\n `g` %h $i #j & <k> → β";
  picture.subtitle = "not\nUTF-8: \xE9 \xC3";
  write(picture);
  expect_whole_pictures("picture.png", "picture.svg");
  const std::string svg = contents("picture.svg");
  EXPECT_NE(svg.find("a_b^2 {c} @d 'e' \"f\" \\n `g` %h $i #j &amp; &lt;k&gt; → β"), std::string::npos);
  EXPECT_NE(svg.find("not UTF-8: ? ?"), std::string::npos);
}

TEST_F(ReportTest, CutsTitlesThatDoNotFit) {
  RegistrationPicture picture = example(2, 8);
  for (int i = 0; i < 400; ++i) picture.title += "ü ";
  write(picture);
  EXPECT_NE(contents("picture.svg").find("ü…"), std::string::npos);
}

TEST_F(ReportTest, WritesToFoldersWithSpecialNames) {
  const fs::path folder = "|it's a \"folder\" & $more";
  fs::create_directory(folder);
  write_registration_picture(example(2, 8), {folder / "a'b.png", folder / "~c d.svg"});
  expect_whole_pictures(folder / "a'b.png", folder / "~c d.svg");
}

TEST_F(ReportTest, RefusesValuesThatAreNotFinite) {
  RegistrationPicture picture = example(2, 8);
  picture.trajectory[2](1, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message_of_failed_write(picture), "registration picture: point 5 of trajectory entry 3 is not finite");
  picture = example(2, 8);
  picture.target.points(0, 0) = INFINITY;
  EXPECT_EQ(message_of_failed_write(picture), "registration picture: point 1 of the target is not finite");
  picture = example(2, 8);
  picture.times[4] = picture.times[3];
  EXPECT_NE(message_of_failed_write(picture).find("time 5 is 0.75"), std::string::npos);
  EXPECT_TRUE(files().empty());
}

TEST_F(ReportTest, RefusesSizesThatDisagree) {
  RegistrationPicture picture = example(2, 8);
  picture.result = Points::Zero(2, 7);
  EXPECT_EQ(message_of_failed_write(picture), "registration picture: the result has 7 landmarks, the source 8");
  picture = example(2, 8);
  picture.target.points = Points::Zero(3, 8);
  EXPECT_EQ(message_of_failed_write(picture), "registration picture: the target has 3 rows, not 2");
  picture = example(2, 8);
  picture.times.pop_back();
  EXPECT_NE(message_of_failed_write(picture).find("4 times for 5 entries"), std::string::npos);
  picture = example(2, 8);
  picture.source.groups = {"one"};
  EXPECT_NE(message_of_failed_write(picture).find("1 group names for 8"), std::string::npos);
  EXPECT_NE(message_of_failed_write(example(4, 8)).find("dimension is 4"), std::string::npos);
  EXPECT_NE(message_of_failed_write(RegistrationPicture{}).find("dimension is 0"), std::string::npos);
  EXPECT_TRUE(files().empty());
}

TEST_F(ReportTest, HasTheWidthAndTheResolutionAskedFor) {
  const auto sides = [](const std::string& png) {
    const auto number = [&](std::size_t at) {
      return 256 * static_cast<unsigned char>(png[at + 2]) + static_cast<unsigned char>(png[at + 3]);
    };
    return std::pair(number(16), number(20));
  };
  const RegistrationPicture picture = example(2, 8);
  write_registration_picture(picture, {.png = "usual.png"});
  write_registration_picture(picture, {.png = "a.png", .svg = "a.svg", .pdf = "a.pdf", .width = 127, .dpi = 300});
  const auto [usual_width, usual_height] = sides(contents("usual.png"));
  const auto [width, height] = sides(contents("a.png"));
  EXPECT_EQ(width, 1500) << "five inches of 300 pixels";
  EXPECT_NEAR(height, 1500.0 * usual_height / usual_width, 1);
  EXPECT_NE(contents("a.svg").find("width=\"480\""), std::string::npos) << "five inches of 96 pixels";
  const std::string pdf = contents("a.pdf");
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_NE(pdf.find("/MediaBox [ 0 0 360 "), std::string::npos) << "five inches of 72 points";
  EXPECT_EQ(files().size(), 4U) << "without a name, no file";
}

TEST_F(ReportTest, SaysThatTheFolderIsMissingAndWritesNeither) {
  try {
    write_registration_picture(example(2, 8), {"picture.png", "nowhere/picture.svg"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("there is no folder"), std::string::npos);
  }
  EXPECT_THROW(write_registration_picture(example(2, 8), {".", "picture.svg"}), InputError);
  EXPECT_TRUE(files().empty());
}

TEST_F(ReportTest, APictureThatCannotBeWrittenLeavesTheOlderFile) {
  std::ofstream("old.png") << "older picture";
  EXPECT_THROW(write_registration_picture(example(2, 8), {.png = "old.png", .dpi = 5000}), InputError) << "too large";
  EXPECT_EQ(files(), (std::set<std::string>{"old.png"}));
  EXPECT_EQ(contents("old.png"), "older picture");
}

TEST(OutlineKindTest, TellsClosedOpenAndNoCurve) {
  EXPECT_EQ(outline_kind(arc(2, 12, 2 * std::numbers::pi)), OutlineKind::kClosed);
  EXPECT_EQ(outline_kind(arc(2, 12, std::numbers::pi)), OutlineKind::kOpen);
  EXPECT_EQ(outline_kind(arc(3, 40, 4 * std::numbers::pi)), OutlineKind::kOpen) << "a helix";
  EXPECT_EQ(outline_kind(arc(2, 11, 2 * std::numbers::pi)), OutlineKind::kNone) << "too few";
  EXPECT_EQ(outline_kind(arc(1, 40, 2)), OutlineKind::kNone) << "on a line";
  EXPECT_EQ(outline_kind(Points::Zero(2, 40)), OutlineKind::kNone) << "at one place";
  EXPECT_EQ(outline_kind(Points(2, 0)), OutlineKind::kNone);
}

TEST(OutlineKindTest, IsScaleFreeAndHeedsJumps) {
  const Points circle = arc(2, 100, 2 * std::numbers::pi);
  EXPECT_EQ(outline_kind(1e-9 * circle), OutlineKind::kClosed);
  Points two_circles(2, 200);
  two_circles << circle, circle.colwise() + Eigen::Vector2d(5, 0);
  EXPECT_EQ(outline_kind(two_circles), OutlineKind::kNone);
  // One within the other, of which the jump is no longer than three of the larger one's gaps.
  const Points ring = arc(2, 30, 2 * std::numbers::pi);
  Points two_rings(2, 60);
  two_rings << ring, 0.6 * ring;
  EXPECT_EQ(outline_kind(two_rings), OutlineKind::kNone);
}

// Twelve landmarks around the head of a salamander, of which two of ten turns are sharp.
TEST(OutlineKindTest, CornersAreNoCurve) {
  Points head{{8.9, 9.3, 5.6, 1.8, 1.2, 1.1, 0.8, 3.2, 6.2, 8.9, 10.7, 14.4},
              {53.8, 52.8, 54.2, 53.0, 53.3, 53.5, 55.0, 56.0, 55.9, 55.4, 55.5, 52.7}};
  EXPECT_EQ(outline_kind(head), OutlineKind::kNone);
  Points zigzag(2, 30);
  for (Eigen::Index i = 0; i < zigzag.cols(); ++i) zigzag.col(i) << static_cast<double>(i), static_cast<double>(i % 2);
  EXPECT_EQ(outline_kind(zigzag), OutlineKind::kNone);
  zigzag.row(1) *= 0.3;
  EXPECT_EQ(outline_kind(zigzag), OutlineKind::kOpen);
}

TEST(OutlineKindTest, ScatteredPointsAreNoCurve) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform;
  for (const int n : {20, 50, 300}) {
    Points points(2, n);
    for (double& value : points.reshaped()) value = uniform(generator);
    EXPECT_EQ(outline_kind(points), OutlineKind::kNone) << n;
  }
}

}  // namespace
}  // namespace pulson::draw
