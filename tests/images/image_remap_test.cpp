// Images warped by a map of places.

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "image_examples.hpp"
#include "pulson/images/image_warp.hpp"

namespace pulson::images {
namespace {

using testing::HasSubstr;
using Place = std::array<float, 2>;

TEST(Remap, IdentityIsExactForEveryKindAndInterpolation) {
  const PixelMap identity = map_of(9, 6, [](float x, float y) { return Place{x, y}; });
  for_every_kind(9, 6, [&](const Image& image) {
    for (const auto& row : interpolation_table().rows())
      EXPECT_EQ(remap(image, identity, {row.make, Border::kConstant, {}}), image) << name_of(image) << row.name;
  });
}

TEST(Remap, ShowsTheSourceAtThePlace) {
  // Right and down by whole pixels, and out at the left: for every kind, the pixel (x, y) shows (x + 2, y + 1).
  const PixelMap shift = map_of(8, 4, [](float x, float y) { return Place{x + 2, y + 1}; });
  for_every_kind(9, 6, [&](const Image& image) {
    const Image shifted = remap(image, shift);
    ASSERT_EQ(shifted.width(), 8);
    ASSERT_EQ(shifted.height(), 4);
    for (int c = 0; c < image.channels(); ++c) {
      EXPECT_NEAR(shifted.at(0, 0, c), image.at(2, 1, c), 1e-6) << name_of(image);
      EXPECT_NEAR(shifted.at(6, 3, c), image.at(8, 4, c), 1e-6) << name_of(image);
      EXPECT_EQ(shifted.at(7, 3, c), 0) << name_of(image);
    }
  });
}

TEST(Remap, LinearIsTheWeightedMeanOfFour) {
  const Image image = image_u8(2, 2, 1, {0, 100, 40, 200});
  const Image result = remap(image, {1, 1, {{0.25F, 0.5F}}});
  EXPECT_EQ(result.at(0, 0, 0), std::lround(0.5 * (0.75 * 0 + 0.25 * 100) + 0.5 * (0.75 * 40 + 0.25 * 200)));
}

TEST(Remap, BordersAreAsDocumented) {
  const Image image = image_u8(4, 1, 1, {10, 20, 30, 40});
  const PixelMap wide = map_of(12, 1, [](float x, float y) { return Place{x - 4, y}; });
  const auto row = [&](Border border) {
    const Image result = remap(image, wide, {Interpolation::kLinear, border, {7, 0, 0, 0}});
    return std::vector<int>(result.values<std::uint8_t>().begin(), result.values<std::uint8_t>().end());
  };
  EXPECT_EQ(row(Border::kConstant), (std::vector{7, 7, 7, 7, 10, 20, 30, 40, 7, 7, 7, 7}));
  EXPECT_EQ(row(Border::kReplicate), (std::vector{10, 10, 10, 10, 10, 20, 30, 40, 40, 40, 40, 40}));
  EXPECT_EQ(row(Border::kReflect), (std::vector{40, 30, 20, 10, 10, 20, 30, 40, 40, 30, 20, 10}));
  EXPECT_EQ(row(Border::kTransparent),
            (std::vector{0, 0, 0, 0, 0, 0, 0, 0, 10, 255, 20, 255, 30, 255, 40, 255, 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(Remap, PlacesFarAwayFollowTheBorder) {
  const Image image = image_u8(4, 1, 1, {10, 20, 30, 40});
  const PixelMap far{4, 1, {{3e9F, 0}, {-3e9F, 0}, {40000, 0}, {1, -70000}}};
  const auto row = [&](Border border, Interpolation interpolation) {
    const Image result = remap(image, far, {interpolation, border, {7, 0, 0, 0}});
    return std::vector<int>(result.values<std::uint8_t>().begin(), result.values<std::uint8_t>().end());
  };
  for (const auto& interpolation : interpolation_table().rows()) {
    EXPECT_EQ(row(Border::kConstant, interpolation.make), (std::vector{7, 7, 7, 7})) << interpolation.name;
    EXPECT_EQ(row(Border::kReplicate, interpolation.make), (std::vector{40, 10, 40, 20})) << interpolation.name;
    // 40000 is a multiple of the period 8.
    EXPECT_EQ(row(Border::kReflect, interpolation.make)[2], 10) << interpolation.name;
  }
}

TEST(Remap, NowhereIsTheFillOrTransparent) {
  const PixelMap map{3, 1, {{kNan, 0}, {1, kInfinity}, {1, 0}}};
  for_every_kind(2, 1, [&](const Image& image) {
    for (const Border border : {Border::kConstant, Border::kReplicate, Border::kReflect}) {
      const Image result = remap(image, map, {Interpolation::kLinear, border, {1, 0.5, 1, 1}});
      const std::vector<double> fill{1, is_floating_point(image.type()) ? 0.5 : 1, 1, 1};
      for (int c = 0; c < image.channels(); ++c) {
        EXPECT_EQ(result.at(0, 0, c), fill[static_cast<std::size_t>(c)]) << name_of(image);
        EXPECT_EQ(result.at(1, 0, c), fill[static_cast<std::size_t>(c)]) << name_of(image);
        EXPECT_NEAR(result.at(2, 0, c), image.at(1, 0, c), 1e-6) << name_of(image);
      }
    }
    const Image clear = remap(image, map, {Interpolation::kLinear, Border::kTransparent, {1, 1, 1, 1}});
    ASSERT_TRUE(clear.has_alpha());
    const int alpha = clear.channels() - 1;
    EXPECT_EQ(clear.at(0, 0, alpha), 0);
    EXPECT_NEAR(clear.at(2, 0, alpha), image.has_alpha() ? image.at(1, 0, alpha) : full_value(image.type()), 1e-6);
  });
}

TEST(Remap, TransparentPixelsDoNotBleed) {
  // Opaque red beside clear green: halfway is red of half the opacity. A straight mean would be dark yellow.
  const Image image = image_u8(2, 1, 4, {200, 0, 0, 255, 0, 200, 0, 0});
  const PixelMap half{1, 1, {{0.5F, 0}}};
  for (const Interpolation interpolation : {Interpolation::kLinear, Interpolation::kCubic}) {
    const std::vector<double> mixed = pixel(remap(image, half, {interpolation, Border::kReplicate, {}}), 0, 0);
    EXPECT_THAT(mixed, testing::ElementsAre(200, 0, 0, testing::DoubleNear(127.5, 0.5)));
  }
  // So does the fill: a fading edge keeps its colour.
  const std::vector<double> edge = pixel(remap(image, {1, 1, {{-0.5F, 0}}}, {}), 0, 0);
  EXPECT_THAT(edge, testing::ElementsAre(200, 0, 0, testing::DoubleNear(127.5, 0.5)));
}

TEST(Remap, LongSidesAreWarpedAndUnknownNamesRefused) {
  Image wide(70000, 1, 1, PixelType::kUint8);
  wide.values<std::uint8_t>()[65000] = 9;
  EXPECT_EQ(remap(wide, {1, 1, {{65000, 0}}}).at(0, 0, 0), 9);
  const PixelMap tall = map_of(1, 40000, [](float, float) { return Place{65000, 0}; });
  EXPECT_EQ(remap(wide, tall).at(0, 39999, 0), 9);
  EXPECT_EQ(error_of([] { parse_interpolation("linnear"); }),
            "unknown interpolation 'linnear'; did you mean 'linear'; valid: nearest, linear, cubic, lanczos, label");
  EXPECT_THAT(error_of([] { parse_border("wrap"); }), HasSubstr("valid: constant, replicate, reflect, transparent"));
  EXPECT_EQ(parse_border("reflect"), Border::kReflect);
  EXPECT_EQ(parse_interpolation("lanczos"), Interpolation::kLanczos);
}

}  // namespace
}  // namespace pulson::images
