// The picture of a shape that looks wrong, and of what it is without the error.

#include "draw/correction_picture.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

constexpr const char* kWrongColour = "#D4621A";
constexpr const char* kMendedColour = "#35A484";
constexpr const char* kInk = "#1F2733";

// Landmarks 2 and 5 of six on a circle are exchanged.
CorrectionPicture exchanged_pair() {
  CorrectionPicture picture;
  picture.reference.points.resize(2, 6);
  for (int a = 0; a < 6; ++a) picture.reference.points.col(a) << 3 * std::cos(a), std::sin(a);
  picture.corrected = picture.shape = picture.reference.points;
  picture.shape.col(1).swap(picture.shape.col(4));
  picture.concerned = {1, 4};
  return picture;
}

std::vector<std::string> texts_of(const std::string& svg) {
  std::vector<std::string> texts;
  for (const SvgText& text : svg_texts(svg)) texts.push_back(text.text);
  return texts;
}

TEST(CorrectionPicture, MarksWhatIsWrongAndWhereItBelongs) {
  const CorrectionPicture picture = exchanged_pair();
  const std::string svg = correction_svg(picture);
  const SvgParts wrong = svg_parts(svg, kWrongColour), mended = svg_parts(svg, kMendedColour);
  ASSERT_EQ(wrong.discs.size(), 3U) << "the last one is the legend's";
  ASSERT_EQ(mended.discs.size(), 3U);
  // One scale in both directions, and y upwards.
  const double unit = (wrong.discs[0](0) - wrong.discs[1](0)) / (picture.shape(0, 1) - picture.shape(0, 4));
  EXPECT_GT(unit, 0);
  EXPECT_NEAR(wrong.discs[0](1) - wrong.discs[1](1), -unit * (picture.shape(1, 1) - picture.shape(1, 4)), 0.02);
  EXPECT_NEAR(mended.discs[0](1), wrong.discs[1](1), 0.02) << "at the same height beside it";
  const auto shaft = std::find_if(wrong.lines.begin(), wrong.lines.end(), [](const Points& line) {
    return line.cols() == 2 && (line.col(0) - line.col(1)).norm() > 100;
  });
  ASSERT_NE(shaft, wrong.lines.end());
  const Eigen::Vector2d along = shaft->col(1) - shaft->col(0), between = wrong.discs[1] - wrong.discs[0];
  EXPECT_NEAR(along.normalized().dot(between.normalized()), 1, 1e-3);
  const std::vector<std::string> texts = texts_of(svg);
  for (const char* name : {"2", "5"}) EXPECT_EQ(std::count(texts.begin(), texts.end(), name), 2) << name;
}

TEST(CorrectionPicture, StandsOneAboveTheOtherOnNarrowScreens) {
  const std::string svg = correction_svg(exchanged_pair(), true);
  EXPECT_NE(svg.find("width=\"600\""), std::string::npos);
  const SvgParts wrong = svg_parts(svg, kWrongColour), mended = svg_parts(svg, kMendedColour);
  ASSERT_EQ(mended.discs.size(), 3U);
  EXPECT_NEAR(mended.discs[0](0), wrong.discs[1](0), 0.02) << "below it";
  EXPECT_GT(mended.discs[0](1), wrong.discs[1](1) + 100);
}

TEST(CorrectionPicture, ShowsWhereAMissingOneBelongs) {
  CorrectionPicture picture = exchanged_pair();
  picture.reference.labels = {"a", "b", "c", "d", "e", "f"};
  picture.shape = picture.reference.points;
  picture.shape.col(2) *= 1.5;
  picture.corrected.col(2).setConstant(std::nan(""));
  picture.concerned = {2};
  const std::string svg = correction_svg(picture);
  EXPECT_EQ(svg_parts(svg, kWrongColour).discs.size(), 2U);
  EXPECT_EQ(svg_parts(svg, kMendedColour).discs.size(), 0U);
  EXPECT_EQ(svg_parts(svg, kInk).discs.size(), 12U) << "six, five, and the legend's";
  const std::vector<std::string> texts = texts_of(svg);
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "c"), 1);
}

TEST(CorrectionPicture, RefusesShapesThatDisagree) {
  CorrectionPicture picture = exchanged_pair();
  picture.shape.conservativeResize(2, 5);
  EXPECT_THROW(correction_svg(picture), InputError);
  picture = exchanged_pair();
  picture.reference.points.conservativeResize(1, 6);
  EXPECT_THROW(correction_svg(picture), InputError);
}

}  // namespace
}  // namespace pulson::draw
