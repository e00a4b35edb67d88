// Pictures of registrations whose target does not correspond to the source, or misses coordinates.
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "picture_files.hpp"
#include "pulson/draw/pictures.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// n points on a circle, a line or a closed space curve.
Points loop(int d, int n, double radius) {
  Points points(d, n);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n + 0.1;
    const Eigen::Vector3d place(std::cos(angle), std::sin(angle), 0.3 * std::sin(2 * angle + 0.3));
    points.col(i) = radius * place.head(d);
  }
  return points;
}

RegistrationPicture example(int d, int n, const Points& target) {
  RegistrationPicture picture;
  picture.source.points = loop(d, n, 1);
  for (int k = 0; k <= 2; ++k) {
    picture.times.push_back(0.5 * k);
    picture.trajectory.emplace_back((1 + 0.1 * k) * picture.source.points);
  }
  picture.result = picture.trajectory.back();
  picture.target.points = target;
  return picture;
}

/// What the SVG shows in the target's colour.
struct Drawn {
  std::vector<Points> rings;
  std::vector<Points> segments;  // of two vertices
  std::vector<Points> outlines;  // the rest
};

Drawn target_in(const std::string& svg) {
  const SvgParts parts = svg_parts(svg, "#D4621A");
  Drawn drawn{.rings = parts.rings, .segments = {}, .outlines = {}};
  for (const Points& line : parts.lines)
    if (line.cols() > 1) (line.cols() == 2 ? drawn.segments : drawn.outlines).push_back(line);
  return drawn;
}

class RegistrationPictureTest : public PictureTest {
 protected:
  static Drawn draw(const RegistrationPicture& picture) {
    write_registration_picture(picture, {"picture.png", "picture.svg"});
    return target_in(expect_whole_pictures("picture.png", "picture.svg"));
  }

  static std::string narrow_layout(const RegistrationPicture& picture) {
    std::string narrow;
    write_registration_picture(picture, {.png = "picture.png", .narrow = &narrow});
    return narrow;
  }

  static std::string refusal(const RegistrationPicture& picture) {
    return error_of([&] { write_registration_picture(picture, {"picture.png", "picture.svg"}); });
  }
};

/// Panels that show the target, and those of them that show the result too and join the two.
std::size_t panels(int d) { return static_cast<std::size_t>(d); }
std::size_t joined_panels(int d) { return d == 3 ? 3 : d == 2 ? 1 : 0; }

TEST_F(RegistrationPictureTest, StandsOneAboveTheOtherOnNarrowScreens) {
  for (const double height_of_shape : {0.05, 1.0, 20.0}) {
    RegistrationPicture picture = example(2, 8, loop(2, 8, 3));
    picture.title = std::string(200, 'W');
    std::vector<Points*> all{&picture.source.points, &picture.target.points, &picture.result};
    for (Points& points : picture.trajectory) all.push_back(&points);
    for (Points* points : all) points->row(1) *= height_of_shape;
    const auto [width, height] = size_of_png(narrow_layout(picture));
    EXPECT_EQ(width, 600) << height_of_shape;
    EXPECT_GE(height, height_of_shape < 1 ? 350 : 1200) << height_of_shape;
    EXPECT_LE(height, height_of_shape < 1 ? 700 : 1800) << height_of_shape;
  }
  // On a line of many landmarks the map in two panels below the paths over time, in space three planes and the view
  // from the side: each at least 300 pixels high.
  for (const auto& [d, n, panel_count] : {std::tuple(1, 8, 1), std::tuple(1, 20, 3), std::tuple(3, 8, 4)}) {
    const auto [width, height] = size_of_png(narrow_layout(example(d, n, loop(d, n, 3))));
    EXPECT_EQ(width, 600);
    EXPECT_GE(height, 300 * panel_count) << d << "D, N = " << n;
  }
}

TEST_F(RegistrationPictureTest, DrawsATargetThatDoesNotCorrespondByItsOwnPoints) {
  for (const int d : {1, 2, 3})
    for (const int m : {1, 5, 15, 90, 700}) {
      SCOPED_TRACE(testing::Message() << "d = " << d << ", M = " << m);
      RegistrationPicture picture = example(d, 40, loop(d, m, 3));
      picture.corresponds = false;
      const Drawn drawn = draw(picture);
      const bool dense = d > 1 && m == 700;
      EXPECT_EQ(drawn.rings.size(), dense ? 0 : panels(d) * static_cast<std::size_t>(m) + 1) << "one in the legend";
      EXPECT_EQ(drawn.segments.size(), dense ? 1u : 0u) << "one in the legend";
      EXPECT_EQ(drawn.outlines.empty(), d == 1 || m < 12);
      for (const auto* lines : {&drawn.rings, &drawn.outlines})
        for (const Points& line : *lines) {
          EXPECT_GE(line.minCoeff(), 0);
          EXPECT_LE(line.maxCoeff(), 1600);
        }
    }
}

TEST_F(RegistrationPictureTest, OutlinesTheTargetByItsOwnGroups) {
  Points target(2, 60);
  target << loop(2, 30, 1), loop(2, 30, 1).colwise() + Eigen::Vector2d(3, 0);
  RegistrationPicture picture = example(2, 20, target);
  picture.corresponds = false;
  EXPECT_TRUE(draw(picture).outlines.empty()) << "it jumps";
  for (int i = 0; i < 60; ++i) picture.target.groups.emplace_back(i < 30 ? "left" : "right");
  EXPECT_EQ(draw(picture).outlines.size(), 4u);
  EXPECT_FALSE(contains(contents("picture.svg"), "left")) << "its groups have one colour";
}

TEST_F(RegistrationPictureTest, AMissingLandmarkHasNoRingAndNoResidual) {
  for (const int d : {1, 2, 3}) {
    SCOPED_TRACE(testing::Message() << "d = " << d);
    Points target = loop(d, 8, 1.3);
    target.col(2).setConstant(kMissing);
    target(d - 1, 5) = kMissing;
    const Drawn drawn = draw(example(d, 8, target));
    EXPECT_EQ(drawn.rings.size(), 6 * panels(d) + 1) << "one in the legend";
    EXPECT_EQ(drawn.segments.size(), 6 * joined_panels(d));
  }
}

TEST_F(RegistrationPictureTest, OutlinesPassOverMissingLandmarks) {
  for (const int missing : {0, 7, 19}) {
    SCOPED_TRACE(testing::Message() << "landmark " << missing + 1);
    Points target = loop(2, 20, 1.3);
    target(1, missing) = kMissing;
    const Drawn drawn = draw(example(2, 20, target));
    ASSERT_EQ(drawn.outlines.size(), 2u);
    for (const Points& outline : drawn.outlines) {
      EXPECT_EQ(outline.cols(), 20);
      EXPECT_EQ(outline.col(0), outline.rightCols<1>()) << "closed";
    }
  }
}

TEST_F(RegistrationPictureTest, DrawsTargetsOfWhichMuchIsMissing) {
  for (const int d : {1, 2, 3})
    for (const int n : {2, 8, 40, 500}) {
      SCOPED_TRACE(testing::Message() << "d = " << d << ", N = " << n);
      Points target = loop(d, n, 1.3);
      target.rightCols(n - 1).setConstant(kMissing);
      RegistrationPicture picture = example(d, n, target);
      const bool dense = d > 1 && n == 500;
      const std::size_t of_map = d == 1 && n >= 16 ? 2 : 0;  // target over source, and displacement
      EXPECT_EQ(draw(picture).rings.size(), dense ? 0 : panels(d) + 1 + of_map);
      for (int i = 0; i < n; ++i) picture.source.groups.emplace_back(i < n / 2 ? "there" : "not there");
      draw(picture);
    }
}

TEST_F(RegistrationPictureTest, ATargetWithoutAWholePointIsNotShown) {
  Points target = loop(2, 8, 1.3);
  target.row(1).setConstant(kMissing);
  const Drawn drawn = draw(example(2, 8, target));
  EXPECT_TRUE(drawn.rings.empty() && drawn.segments.empty() && drawn.outlines.empty());
  EXPECT_FALSE(contains(contents("picture.svg"), "target"));
}

TEST_F(RegistrationPictureTest, ManyLandmarksOnALineAreShownAsAMap) {
  for (const int n : {15, 16, 145}) {
    const Points target = loop(1, n, 1.3);
    RegistrationPicture picture = example(1, n, target);
    for (int m = 0; m < 5; ++m) picture.grid_paths.push_back((Points(2, 2) << 0, 1, m - 2, 1.1 * (m - 2)).finished());
    EXPECT_EQ(draw(picture).rings.size() > static_cast<std::size_t>(2 * n), n >= 16) << n;
    EXPECT_EQ(contains(contents("picture.svg"), "Displacements over the source"), n >= 16) << n;
  }
}

TEST_F(RegistrationPictureTest, SpaceIsUnfoldedAndSmallDisplacementsAreMagnified) {
  RegistrationPicture picture = example(3, 9, loop(3, 9, 1.3));
  draw(picture);
  EXPECT_TRUE(contains(contents("picture.svg"), "Displacements × 2, from the side"));
  picture.result = 2 * picture.source.points;
  draw(picture);
  EXPECT_TRUE(contains(contents("picture.svg"), "Displacements, from the side"));
  picture.result = picture.source.points;  // nothing moves
  draw(picture);
}

TEST_F(RegistrationPictureTest, MapsEnergyAndActionAndShowsWhatIsDoubted) {
  RegistrationPicture picture = example(2, 8, loop(2, 8, 1.3));
  picture.map_triangles = {{0, 1, 2}, {3, 4, 5}};
  draw(picture);
  EXPECT_FALSE(contains(contents("picture.svg"), "action of the noise"));
  picture.action = Eigen::VectorXd::Zero(8);
  picture.action[1] = 1;
  picture.doubted = {1, 6};
  draw(picture);
  const std::string svg = contents("picture.svg");
  EXPECT_TRUE(contains(svg, "action of the noise"));
  EXPECT_TRUE(contains(svg, "doubted by prediction"));
  EXPECT_EQ(svg_parts(svg, "#B03A63").discs.size(), 2U) << "on the result and in the legend";
  EXPECT_FALSE(contains(svg, "energy of the flow"));
  picture.energy = Eigen::VectorXd::Ones(8);
  draw(picture);
  EXPECT_TRUE(contains(contents("picture.svg"), "energy of the flow"));
  picture.doubted = {8};
  EXPECT_EQ(refusal(picture), "registration picture: the source has no landmark 8");
  picture.doubted = {};
  picture.action[2] = -1;
  EXPECT_EQ(refusal(picture), "registration picture: the action needs a number of 0 or more for each landmark");
  picture.action[2] = 0;
  picture.energy = Eigen::VectorXd::Ones(7);
  EXPECT_EQ(refusal(picture), "registration picture: the energy needs a number of 0 or more for each landmark");
}

TEST_F(RegistrationPictureTest, SaysWhatIsWrongWithTheTarget) {
  const Points target = loop(2, 8, 1.3);
  const auto refusal_with = [&](const auto& change) {
    RegistrationPicture picture = example(2, 8, target);
    change(picture);
    return refusal(picture);
  };
  EXPECT_EQ(refusal_with([](auto& picture) { picture.target.points.col(4) << kMissing, -INFINITY; }),
            "registration picture: point 5 of the target is not finite");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.target.points(0, 1) = 1e305; }),
            "registration picture: point 2 of the target is larger than 1e+300, too large to be drawn");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.target.points.setConstant(kMissing); }),
            "registration picture: the target has no coordinates");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.target.points = loop(2, 9, 1); }),
            "registration picture: the target has 9 landmarks, the source 8");
  EXPECT_EQ(refusal_with([](auto& picture) {
              picture.target.points = Points(2, 0);
              picture.corresponds = false;
            }),
            "registration picture: the target has no landmarks");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.target.groups = {"one"}; }),
            "registration picture: the target has 1 group names for 8 landmarks");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.source.points(0, 0) = kMissing; }),
            "registration picture: point 1 of the source is not finite");
  EXPECT_EQ(refusal_with([](auto& picture) { picture.result(0, 0) = kMissing; }),
            "registration picture: point 1 of the result is not finite");
  EXPECT_TRUE(files().empty());
}

TEST_F(RegistrationPictureTest, JoinsLandmarksThatAreLinked) {
  for (const int d : {2, 3}) {
    SCOPED_TRACE(testing::Message() << "d = " << d);
    RegistrationPicture picture = example(d, 4, loop(d, 4, 1.3));
    const std::size_t before = draw(picture).segments.size();
    picture.source.links = {{0, 2}, {1, 3}, {3, 1}};
    EXPECT_EQ(draw(picture).segments.size(), before + 2 * panels(d)) << "each once";
    picture.target.points.col(2).setConstant(kMissing);
    EXPECT_EQ(draw(picture).segments.size(), before - joined_panels(d) + panels(d)) << "none to what is missing";
    picture.source.links = {{0, 4}};
    EXPECT_EQ(refusal(picture), "registration picture: a link joins 0 and 4");
  }
  RegistrationPicture line = example(1, 4, loop(1, 4, 1.3));
  const std::size_t before = draw(line).segments.size();
  line.source.links = {{0, 2}};
  EXPECT_EQ(draw(line).segments.size(), before);
}

TEST_F(RegistrationPictureTest, DrawsALinkAlongAnOutlineOnce) {
  RegistrationPicture picture = example(2, 40, loop(2, 40, 1.3));
  const std::size_t before = draw(picture).segments.size();
  picture.source.links = {{0, 1}, {39, 0}};
  EXPECT_EQ(draw(picture).segments.size(), before);
}

}  // namespace
}  // namespace pulson::draw
