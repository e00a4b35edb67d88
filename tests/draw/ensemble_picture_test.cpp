// Pictures of ensembles in the plane and in space.
#include "draw/ensemble_picture.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "picture_files.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

EnsemblePicture some_ensemble(int d, int n) {
  EnsemblePicture picture;
  picture.start.points = Points::Zero(d, n);
  for (int a = 0; a < n; ++a) picture.start.points.col(a).head(2) << a, 0.3 * a * a;
  for (int k = 0; k <= 4; ++k) {
    picture.times.push_back(0.25 * k);
    picture.mean.emplace_back((picture.start.points.array() + 0.2 * k).matrix());
  }
  for (int a = 0; a < n; ++a) {
    Eigen::MatrixXd& covariance = picture.covariances.emplace_back(0.04 * Eigen::MatrixXd::Identity(d, d));
    covariance(0, 1) = covariance(1, 0) = 0.02;
  }
  picture.paths = {picture.mean, picture.mean};
  picture.title = "An ensemble";
  return picture;
}

class EnsemblePictureTest : public PictureTest {
 protected:
  static std::string draw(const EnsemblePicture& picture) {
    write_ensemble_picture(picture, {"ensemble.png", "ensemble.svg"});
    return expect_whole_pictures("ensemble.png", "ensemble.svg");
  }

  static std::string refusal(const EnsemblePicture& picture) {
    std::string message = error_of([&] { write_ensemble_picture(picture, {"ensemble.png", "ensemble.svg"}); });
    EXPECT_TRUE(files().empty());
    return message;
  }
};

TEST_F(EnsemblePictureTest, HasAnEllipseForEachLandmarkInEachPanel) {
  for (const int d : {2, 3})
    for (const int n : {1, 5, 40}) {
      SCOPED_TRACE(testing::Message() << "d = " << d << ", N = " << n);
      const std::string svg = draw(some_ensemble(d, n));
      const auto panels = static_cast<std::size_t>(d == 2 ? 1 : 3);
      const SvgParts target = svg_parts(svg, "#D4621A");
      EXPECT_EQ(target.lines.size(), panels * static_cast<std::size_t>(n));
      EXPECT_EQ(target.rings.size(), 1U) << "in the legend";
      EXPECT_TRUE(contains(svg, ">2 sample paths<"));
    }
}

TEST_F(EnsemblePictureTest, StandsOneAboveTheOtherOnNarrowScreens) {
  std::string plane, space;
  write_ensemble_picture(some_ensemble(2, 5), {.png = "ensemble.png", .narrow = &plane});
  write_ensemble_picture(some_ensemble(3, 5), {.png = "ensemble.png", .narrow = &space});
  EXPECT_EQ(size_of_png(plane).first, 600);
  EXPECT_EQ(size_of_png(space).first, 600);
  EXPECT_GE(size_of_png(plane).second, 300);
  EXPECT_GE(size_of_png(space).second, 4 * 250) << "three planes and the view from the side";
}

// An outline whose mean path leads so far away that it is a point: its marks are as far apart as it has landmarks.
TEST_F(EnsemblePictureTest, OfAnOutlineThatIsAPointInItHasAnEnd) {
  EnsemblePicture picture = some_ensemble(2, 40);
  for (int a = 0; a < 40; ++a) picture.start.points.col(a) << std::cos(a * M_PI / 20), std::sin(a * M_PI / 20);
  picture.mean.back() *= 1e30;
  EXPECT_TRUE(contains(draw(picture), ">2 sample paths<"));
}

// A tall covariance must be drawn tall, whichever way y points.
TEST_F(EnsemblePictureTest, EllipsesHaveTheAxesOfTheirCovariance) {
  EnsemblePicture picture = some_ensemble(2, 1);
  picture.covariances.front() << 1, 0, 0, 9;
  for (const bool y_down : {false, true}) {
    picture.start.frame.y_down = y_down;
    const std::string svg = draw(picture);
    const SvgParts target = svg_parts(svg, "#D4621A");
    ASSERT_EQ(target.lines.size(), 1U);
    const Eigen::Vector2d size = target.lines[0].rowwise().maxCoeff() - target.lines[0].rowwise().minCoeff();
    EXPECT_NEAR(size.y() / size.x(), 3, 0.02);
  }
}

// A legend that one row does not hold goes on in another, and nothing of it is cut.
TEST_F(EnsemblePictureTest, LegendOfManyGroupsIsWhole) {
  EnsemblePicture picture = some_ensemble(2, 8);
  for (int a = 0; a < 8; ++a) picture.start.groups.push_back("a part of the shape " + std::to_string(a));
  const std::string svg = draw(picture);
  for (const std::string& name : picture.start.groups) EXPECT_TRUE(contains(svg, ">" + name + "<")) << name;
  EXPECT_FALSE(contains(svg, "…"));
  EXPECT_TRUE(contains(svg, ">2 sample paths<"));
}

TEST_F(EnsemblePictureTest, NamesTheTimeOfTheMean) {
  EXPECT_TRUE(contains(draw(some_ensemble(2, 3)), ">mean at t = 1<"));
}

TEST_F(EnsemblePictureTest, NamesWhatIsWrong) {
  EnsemblePicture picture = some_ensemble(2, 3);
  picture.covariances.pop_back();
  EXPECT_EQ(refusal(picture), "ensemble picture: 2 covariances of 3 landmarks");
  picture = some_ensemble(2, 3);
  picture.covariances[1] = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_EQ(refusal(picture), "ensemble picture: covariance 2 is not 2×2");
  picture = some_ensemble(2, 3);
  picture.mean[1](0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(picture), "no error");
}

}  // namespace
}  // namespace pulson::draw
