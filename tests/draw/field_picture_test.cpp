// Pictures of velocity fields on a line and in the plane.
#include "draw/field_picture.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "picture_files.hpp"
#include "png_pixels.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

// u = p: to the right below 0 and to the left above it, on a line; in the plane all to the right.
FieldPicture some_field(int d, int n) {
  FieldPicture picture;
  picture.start.points = Points::Zero(d, n);
  for (int a = 0; a < n; ++a) picture.start.points(0, a) = a - (n - 1) / 2.0;
  for (int i = 0; i < d; ++i) picture.axes.emplace_back(Eigen::VectorXd::LinSpaced(21, -n, n));
  for (int k = 0; k <= 4; ++k) {
    picture.times.push_back(0.25 * k);
    picture.positions.emplace_back((picture.start.points.array() + 0.05 * k).matrix());
    picture.momenta.push_back(picture.start.points);
    Points u = Points::Zero(d, d == 1 ? 21 : 441);
    if (d == 1)
      u.row(0) = -picture.axes[0].transpose();
    else
      u.row(0).setConstant(1);
    picture.velocities.push_back(u);
  }
  picture.title = "A field";
  return picture;
}

class FieldPictureTest : public PictureTest {
 protected:
  static std::string draw(const FieldPicture& picture) {
    write_field_picture(picture, {"field.png", "field.svg"});
    return expect_whole_pictures("field.png", "field.svg");
  }

  static std::string refusal(const FieldPicture& picture) {
    std::string message = error_of([&] { write_field_picture(picture, {"field.png", "field.svg"}); });
    EXPECT_TRUE(files().empty());
    return message;
  }
};

TEST_F(FieldPictureTest, OnALineHasAStemForEachMomentum) {
  for (const int n : {1, 4}) {
    const std::string svg = draw(some_field(1, n));
    const SvgParts momenta = svg_parts(svg, "#B03A63");
    EXPECT_EQ(momenta.discs.size(), static_cast<std::size_t>(n));
    EXPECT_EQ(momenta.lines.size(), static_cast<std::size_t>(n) + 1) << "with the legend";
    EXPECT_TRUE(contains(svg, ">Momenta p at t = 1<"));
    EXPECT_TRUE(contains(svg, ">u at t = 1<"));
    std::filesystem::remove("field.png");
    std::filesystem::remove("field.svg");
  }
}

// u falls with x, so red is below and blue above.
TEST_F(FieldPictureTest, OnALineIsRedWhereTheVelocityIsPositive) {
  draw(some_field(1, 2));
  const Raster pixels = png_pixels("field.png");
  const auto colour = [&](double part_of_height) {
    const auto at =
        4 * (static_cast<std::size_t>(part_of_height * pixels.height) * static_cast<std::size_t>(pixels.width) +
             static_cast<std::size_t>(pixels.width) / 4);
    return std::pair<int, int>(pixels.rgba[at], pixels.rgba[at + 2]);
  };
  const auto [red_above, blue_above] = colour(0.25);
  const auto [red_below, blue_below] = colour(0.7);
  EXPECT_LT(red_above, blue_above);
  EXPECT_GT(red_below, blue_below);
}

TEST_F(FieldPictureTest, InThePlaneHasAPanelForTheFirstTheMiddleAndTheLastTime) {
  const std::string svg = draw(some_field(2, 3));
  for (const char* heading : {">t = 0<", ">t = 0.5<", ">t = 1<"}) EXPECT_TRUE(contains(svg, heading)) << heading;
  EXPECT_TRUE(contains(svg, ">|u| = 0<"));
}

TEST_F(FieldPictureTest, FramesOfAMotionHaveOneSize) {
  for (const int d : {1, 2}) {
    const FieldPicture picture = some_field(d, 3);
    std::vector<std::pair<int, int>> sizes;
    for (const std::size_t k : {0U, 4U}) {
      const std::string file = "frame" + std::to_string(k) + ".png";
      write(file, field_frame_png(picture, k, {.dpi = 48}));
      const Raster frame = png_pixels(file);
      sizes.emplace_back(frame.width, frame.height);
    }
    EXPECT_EQ(sizes[0], sizes[1]) << d << "D";
  }
}

TEST_F(FieldPictureTest, RefusesWhatItCannotDraw) {
  EXPECT_EQ(refusal(some_field(3, 2)), "field picture: the start is in 3D");
  FieldPicture picture = some_field(1, 2);
  picture.velocities.back() = Points::Zero(1, 20);
  EXPECT_EQ(refusal(picture), "field picture: 20 velocities at 21 points");
  picture = some_field(1, 2);
  picture.velocities.back()(0, 3) = std::nan("");
  EXPECT_TRUE(contains(refusal(picture), "a velocity"));
  picture = some_field(1, 2);
  picture.momenta.pop_back();
  EXPECT_EQ(refusal(picture), "field picture: there are other times of momenta");
}

}  // namespace
}  // namespace pulson::draw
