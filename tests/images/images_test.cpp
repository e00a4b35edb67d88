// Images as such: colours of values, composition and drawing.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "image_examples.hpp"
#include "images/colour_maps.hpp"
#include "images/compose.hpp"

namespace pulson::images {
namespace {

using testing::HasSubstr;

// ---- colours of values

TEST(ColourMaps, ViridisHasThePublishedColours) {
  const Image image = viridis({0, 1, 2, 0.4F, 5, -5, kNan}, 7, 1, 0, 2);
  EXPECT_EQ(pixel(image, 0, 0), (std::vector<double>{0x44, 0x01, 0x54, 255}));
  // Colour 127 of 255 is 0x21908C or one step beside it.
  EXPECT_THAT(pixel(image, 1, 0), testing::Pointwise(testing::DoubleNear(2), {0x21, 0x90, 0x8C, 255}));
  EXPECT_EQ(pixel(image, 2, 0), (std::vector<double>{0xFD, 0xE7, 0x25, 255}));
  EXPECT_THAT(pixel(image, 3, 0), testing::Pointwise(testing::DoubleNear(2), {0x41, 0x44, 0x87, 255}));
  EXPECT_EQ(pixel(image, 4, 0), pixel(image, 2, 0));
  EXPECT_EQ(pixel(image, 5, 0), pixel(image, 0, 0));
  EXPECT_EQ(pixel(image, 6, 0), (std::vector<double>{0, 0, 0, 0}));
  EXPECT_THAT(error_of([] { viridis({0}, 1, 1, 2, 2); }), HasSubstr("the first must be less than the second"));
}

TEST(ColourMaps, DivergingIsWhiteAtTheCentreAndMarksFolds) {
  const Image image = diverging({1, 0, 2, -0.1F, kNan, kInfinity}, 6, 1, {1, 1, 0});
  EXPECT_EQ(pixel(image, 0, 0), (std::vector<double>{255, 255, 255, 255}));
  EXPECT_EQ(pixel(image, 1, 0), (std::vector<double>{0x05, 0x30, 0x61, 255}));
  EXPECT_EQ(pixel(image, 2, 0), (std::vector<double>{0x67, 0x00, 0x1F, 255}));
  EXPECT_EQ(pixel(image, 3, 0), (std::vector<double>{0xF0, 0xE4, 0x42, 255}));
  EXPECT_EQ(pixel(image, 4, 0), (std::vector<double>{0, 0, 0, 0}));
  EXPECT_EQ(pixel(image, 5, 0), pixel(image, 2, 0));
  EXPECT_THAT(error_of([] { diverging({0}, 1, 1, {0, 0}); }), HasSubstr("the first must be greater than 0"));
}

// ---- composition

TEST(Compose, Rgba8RoundsAndLimits) {
  const std::vector<std::uint16_t> wide{0, 128, 129, 65535};
  EXPECT_EQ(pixel(to_rgba8({2, 1, 2, std::span(wide)}), 0, 0), (std::vector<double>{0, 0, 0, 0}));
  EXPECT_EQ(pixel(to_rgba8({2, 1, 2, std::span(wide)}), 1, 0), (std::vector<double>{1, 1, 1, 255}));
  const std::vector<float> numbers{-1, 0.5F, 2, 0, kNan, 1};
  EXPECT_EQ(pixel(to_rgba8({2, 1, 3, std::span<const float>(numbers)}), 0, 0), (std::vector<double>{0, 128, 255, 255}));
  EXPECT_EQ(pixel(to_rgba8({2, 1, 3, std::span<const float>(numbers)}), 1, 0), (std::vector<double>{0, 0, 0, 0}));
}

TEST(Compose, ImagesOfOneSizeAreLaidOverOneAnother) {
  const Image a = image_u8(4, 2, 1, {0, 0, 0, 0, 0, 0, 0, 0}),
              b = image_u8(4, 2, 2, {90, 255, 90, 255, 90, 255, 90, 0, 90, 255, 90, 255, 90, 255, 90, 0});
  const Image squares = checkerboard(a, b, 2), half = blend(a, b), apart = difference(a, b);
  EXPECT_EQ(pixel(squares, 1, 1), (std::vector<double>{0, 0, 0, 255}));
  EXPECT_EQ(pixel(squares, 2, 0), (std::vector<double>{90, 90, 90, 255}));
  EXPECT_EQ(pixel(half, 0, 0), (std::vector<double>{45, 45, 45, 255}));
  EXPECT_EQ(pixel(half, 3, 0), (std::vector<double>{0, 0, 0, 255}));  // b is transparent
  EXPECT_EQ(pixel(apart, 0, 0), (std::vector<double>{165, 165, 165, 255}));
  EXPECT_EQ(pixel(apart, 3, 1)[3], 0);
  EXPECT_EQ(pixel(difference(b, b), 0, 0), (std::vector<double>{255, 255, 255, 255}));
  EXPECT_THAT(error_of([&] { blend(a, image_u8(1, 1, 1, {0})); }), HasSubstr("4 x 2 and 1 x 1 pixels"));
}

TEST(Compose, ScaledDownIsTheMeanOfAreas) {
  const Image image = image_u8(4, 2, 1, {0, 10, 100, 200, 20, 30, 100, 200});
  const Image half = scaled_down(image, 2);
  ASSERT_EQ(half.width(), 2);
  ASSERT_EQ(half.height(), 1);
  EXPECT_EQ(half.at(0, 0, 0), 15);
  EXPECT_EQ(half.at(1, 0, 0), 150);
  EXPECT_EQ(scaled_down(image, 1), image);
  EXPECT_EQ(scaled_down(image, 100).pixel_count(), 1u);
  const Image clear = scaled_down(image_u8(2, 1, 2, {200, 255, 0, 0}), 2);
  EXPECT_THAT(pixel(clear, 0, 0), testing::ElementsAre(200, testing::DoubleNear(127.5, 0.5)));
  EXPECT_THAT(error_of([&] { scaled_down(image, 0.5); }), HasSubstr("by 0.500000; the factor must be at least 1"));
}

// ---- drawing

Points columns(std::vector<double> numbers) {
  return Points::Map(numbers.data(), 2, static_cast<Eigen::Index>(numbers.size() / 2));
}

TEST(Drawing, LinesGoThroughPixelCentres) {
  const Image black = image_u8(5, 3, 1, std::vector<std::uint8_t>(15, 0));
  const Image drawn = blend_lines(black, {columns({1, 1, 3, 1})}, {{255, 128, 0}, 1, false});
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) {
      const bool is_on_line = y == 1 && x >= 1 && x <= 3;
      EXPECT_EQ(pixel(drawn, x, y),
                (is_on_line ? std::vector<double>{255, 128, 0, 255} : std::vector<double>{0, 0, 0, 255}))
          << x << ", " << y;
    }
}

TEST(Drawing, FractionsOfPixelsShiftTheWeight) {
  const Image black(20, 20, 1, PixelType::kUint8);
  // The mean row of what a horizontal line at y brightened.
  const auto mean_row = [&](double y) {
    const Image drawn = blend_lines(black, {columns({2, y, 17, y})}, {{255, 255, 255}, 1, true});
    double sum = 0, moment = 0;
    for (int row = 0; row < 20; ++row) {
      sum += drawn.at(10, row, 0);
      moment += row * drawn.at(10, row, 0);
    }
    return moment / sum;
  };
  for (const double y : {9.0, 9.25, 9.5, 9.75}) EXPECT_NEAR(mean_row(y), y, 0.1);
}

TEST(Drawing, LinesBlendWithColoursAndAlpha) {
  const Image image = image_u8(2, 1, 4, {100, 100, 100, 255, 9, 9, 9, 0});
  const Image drawn = blend_lines(image, {columns({0, 0, 1, 0})}, {{200, 0, 0, 51}, 1, false});
  EXPECT_EQ(pixel(drawn, 0, 0), (std::vector<double>{120, 80, 80, 255}));
  EXPECT_EQ(pixel(drawn, 1, 0), (std::vector<double>{200, 0, 0, 51}));
}

TEST(Drawing, WhatIsNotFiniteInterruptsALine) {
  const Image black(9, 1, 1, PixelType::kUint8);
  const double nan = kNan;
  const Image drawn = blend_lines(
      black, {columns({0, 0, 2, 0, nan, 0, 5, 0, 7, 0}), columns({nan, nan}), columns({1e9, 0}), Points(2, 0)},
      {{255, 0, 0}, 1, false});
  std::string row;
  for (int x = 0; x < 9; ++x) row += drawn.at(x, 0, 0) > 0 ? '#' : '.';
  EXPECT_EQ(row, "###..###.");
  EXPECT_EQ(blend_lines(black, {}, {}), to_rgba8(black));
}

TEST(Drawing, RingsAreOpenAndAroundTheirCentres) {
  const Image black(41, 31, 1, PixelType::kUint8);
  const Image drawn = blend_rings(black, columns({20.5, 12.25, kNan, 3}), 8, {{255, 255, 255}, 2});
  double area = 0, x_sum = 0, y_sum = 0;
  for (int y = 0; y < 31; ++y)
    for (int x = 0; x < 41; ++x) {
      area += drawn.at(x, y, 0) / 255;
      x_sum += x * drawn.at(x, y, 0) / 255;
      y_sum += y * drawn.at(x, y, 0) / 255;
    }
  const double length = 2 * 3.14159 * 8;
  EXPECT_THAT(area, testing::AllOf(testing::Ge(2 * length), testing::Le(4 * length)));  // antialiasing widens it
  EXPECT_NEAR(x_sum / area, 20.5, 0.1);
  EXPECT_NEAR(y_sum / area, 12.25, 0.1);
  EXPECT_EQ(drawn.at(20, 12, 0), 0);
}

}  // namespace
}  // namespace pulson::images
