// Pictures carried along by meshes that may fold.

#include "images/push_forward.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "image_examples.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::images {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using Place = std::array<float, 2>;

// The mesh of an image's pixel corners, each at place(x, y).
warp::DeformedMesh mesh_of(const Image& image, const std::function<Place(float, float)>& place) {
  warp::DeformedMesh mesh{image.width() + 1, image.height() + 1, {}};
  for (int r = 0; r < mesh.rows; ++r)
    for (int c = 0; c < mesh.columns; ++c)
      mesh.vertices.push_back(place(static_cast<float>(c) - 0.5F, static_cast<float>(r) - 0.5F));
  return mesh;
}

Place identity(float x, float y) { return {x, y}; }

// A strip of two colours, the right one laid over the left: positions x > 1.5 flipped at that edge.
const Image kStrip = image_u8(4, 1, 3, {200, 0, 0, 200, 0, 0, 0, 100, 0, 0, 100, 0});
Place folded(float x, float y) { return {x <= 1.5F ? x : 3 - x, y}; }

// Of an image of 60 × 50: it folds again and again.
Place curl(float x, float y) { return {30 + 25 * std::sin(x / 7), y + 6 * std::cos(x / 5 + y / 9)}; }

PushedImage push_strip(warp::SheetOrder over, std::vector<float> priority = {}) {
  return push_forward(kStrip, mesh_of(kStrip, folded), {.width = 4, .height = 1, .over = over}, {},
                      std::move(priority));
}

TEST(PushForward, IdentityGivesTheSourceBack) {
  for_every_kind(9, 6, [](const Image& image) {
    for (const warp::SheetOrder over :
         {warp::SheetOrder::kLeastStretched, warp::SheetOrder::kAverage, warp::SheetOrder::kFirst})
      for (const int supersampling : {1, 2, 3}) {
        const PushedImage same = push_forward(image, mesh_of(image, identity),
                                              {.width = 9, .height = 6, .supersampling = supersampling, .over = over});
        EXPECT_EQ(same.image, image) << name_of(image) << ", " << over_name(over);
        EXPECT_THAT(same.multiplicity, Each(1));
        EXPECT_EQ(same.coverage.uncovered, 0);
      }
  });
}

TEST(PushForward, ShiftsAndMirrorsWholePixels) {
  for_every_kind(9, 6, [](const Image& image) {
    const PushedImage right = push_forward(image,
                                           mesh_of(image,
                                                   [](float x, float y) -> Place {
                                                     return {x + 2, y - 1};
                                                   }),
                                           {.width = 9, .height = 6});
    const PushedImage mirrored = push_forward(image,
                                              mesh_of(image,
                                                      [](float x, float y) -> Place {
                                                        return {8 - x, y};
                                                      }),
                                              {.width = 9, .height = 6});
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 9; ++x)
        for (int c = 0; c < image.channels(); ++c) {
          const double from = x >= 2 && y < 5 ? image.at(x - 2, y + 1, c) : 0;
          ASSERT_EQ(right.image.at(x, y, c), from) << name_of(image) << " at " << x << ", " << y;
          ASSERT_EQ(mirrored.image.at(x, y, c), image.at(8 - x, y, c)) << name_of(image);
        }
  });
}

TEST(PushForward, LaysTheSheetOnTopThatIsAskedFor) {
  for (const warp::SheetOrder over : {warp::SheetOrder::kLeastStretched, warp::SheetOrder::kFirst}) {
    const PushedImage pushed = push_strip(over);
    EXPECT_THAT(pushed.multiplicity, ElementsAre(2, 2, 0, 0));
    for (int x = 0; x < 2; ++x) EXPECT_THAT(pixel(pushed.image, x, 0), ElementsAre(200, 0, 0)) << over_name(over);
    EXPECT_THAT(pixel(pushed.image, 3, 0), ElementsAre(0, 0, 0));
  }
  const PushedImage last = push_strip(warp::SheetOrder::kPriority, {0, 0, 1, 1});
  for (int x = 0; x < 2; ++x) EXPECT_THAT(pixel(last.image, x, 0), ElementsAre(0, 100, 0));
  const PushedImage mean = push_strip(warp::SheetOrder::kAverage);
  for (int x = 0; x < 2; ++x) EXPECT_THAT(pixel(mean.image, x, 0), ElementsAre(100, 50, 0));
  EXPECT_EQ(mean.coverage.max_multiplicity, 2);
}

// A strip that turns back at 0.8: two sheets up to there, of which pixel 1 holds the last 0.3, and not its centre.
TEST(PushForward, MultiplicityIsTheSameForAnySupersampling) {
  const auto turned = [](float x, float y) -> Place { return {x < 1 ? x : x > 2 ? 3 - x : 0.8F, y}; };
  const Image image = uneven_image(60, 50, 3, PixelType::kUint8);
  const auto multiplicity = [&](int supersampling) {
    return push_forward(image, mesh_of(image, curl), {.width = 60, .height = 50, .supersampling = supersampling})
        .multiplicity;
  };
  const std::vector<std::uint8_t> usual = multiplicity(2);
  for (const int supersampling : {1, 2, 3, 8}) {
    const PushedImage pushed =
        push_forward(kStrip, mesh_of(kStrip, turned), {.width = 4, .height = 1, .supersampling = supersampling});
    EXPECT_THAT(pushed.multiplicity, ElementsAre(2, 2, 0, 0)) << supersampling;
    EXPECT_EQ(pushed.coverage.max_multiplicity, 2);
    EXPECT_EQ(multiplicity(supersampling), usual) << supersampling;
  }
}

// A pixel half of whose width is covered twice: the mean over its area of what is there.
TEST(PushForward, AveragesSheetsAtEverySampleAndThenSamples) {
  const Image image = image_u8(2, 1, 1, {0, 200});
  warp::DeformedMesh mesh{3, 2, {{-0.5F, -0.5F}, {0.5F, -0.5F}, {0, -0.5F}, {-0.5F, 0.5F}, {0.5F, 0.5F}, {0, 0.5F}}};
  const PushedImage mean =
      push_forward(image, mesh, {.width = 1, .height = 1, .supersampling = 4, .over = warp::SheetOrder::kAverage},
                   {.interpolation = Interpolation::kNearest});
  EXPECT_EQ(mean.image.at(0, 0, 0), 50);
}

TEST(PushForward, HolesAreFilledOrTransparent) {
  const Image wide = image_u8(3, 1, 1, {10, 20, 30});
  warp::DeformedMesh torn = mesh_of(wide, identity);
  torn.vertices[0][0] = kNan;  // its cell is left out
  const PushedImage filled = push_forward(wide, torn, {.width = 3, .height = 1}, {.fill = {{77, 0, 0, 0}}});
  EXPECT_THAT(pixel(filled.image, 0, 0), ElementsAre(77));
  EXPECT_THAT(pixel(filled.image, 1, 0), ElementsAre(20));
  const PushedImage clear = push_forward(wide, torn, {.width = 3, .height = 1}, {.fill = std::nullopt});
  EXPECT_THAT(pixel(clear.image, 0, 0), ElementsAre(0, 0));
  EXPECT_THAT(pixel(clear.image, 1, 0), ElementsAre(20, 255));
  EXPECT_EQ(clear.uncovered, (std::vector<bool>{true, false, false}));
  EXPECT_NEAR(clear.coverage.uncovered_fraction(), 1.0 / 3, 1e-12);
}

// Half a pixel to the right: the first pixel is half covered by the first and half by the fill.
TEST(PushForward, EdgesAreMixedWithTheFillOrHalfTransparent) {
  const Image image = image_u8(2, 1, 1, {100, 100});
  const warp::DeformedMesh mesh = mesh_of(image, [](float x, float y) -> Place { return {x + 0.5F, y}; });
  const PushedImage filled = push_forward(image, mesh, {.width = 3, .height = 1}, {.fill = {{50, 0, 0, 0}}});
  EXPECT_THAT(filled.image.values<std::uint8_t>(), ElementsAre(75, 100, 75));
  const PushedImage clear = push_forward(image, mesh, {.width = 3, .height = 1}, {.fill = std::nullopt});
  EXPECT_THAT(clear.image.values<std::uint8_t>(), ElementsAre(100, 128, 100, 255, 100, 128));
}

TEST(PushForward, MixesColoursInProportionToTheirOpacity) {
  // Opaque 200 beside clear 10, both seen by one pixel: the colour is 200, half opaque.
  const Image image = image_u8(2, 1, 2, {200, 255, 10, 0});
  const PushedImage half =
      push_forward(image,
                   mesh_of(image,
                           [](float x, float y) -> Place {
                             return {x / 2 - 0.25F, y};
                           }),
                   {.width = 1, .height = 1, .supersampling = 4}, {.interpolation = Interpolation::kNearest});
  EXPECT_THAT(pixel(half.image, 0, 0), ElementsAre(200, 128));
}

TEST(PushForward, ShrinkingAverages) {
  std::vector<std::uint8_t> values;
  for (int i = 0; i < 32 * 32; ++i) values.push_back((i % 32 + i / 32) % 2 == 0 ? 0 : 255);
  const Image board = image_u8(32, 32, 1, values);
  const PushedImage grey = push_forward(board,
                                        mesh_of(board,
                                                [](float x, float y) -> Place {
                                                  return {(x + 0.5F) / 8 - 0.5F, (y + 0.5F) / 8 - 0.5F};
                                                }),
                                        {.width = 4, .height = 4, .supersampling = 8});
  for (const std::uint8_t value : grey.image.values<std::uint8_t>()) EXPECT_NEAR(value, 127.5, 1.5);
}

// Shrunk, stretched and folded, whatever the samples are.
TEST(PushForward, LabelsAreNeverMadeUp) {
  constexpr std::array<std::uint8_t, 3> kLabels = {0, 5, 200};
  std::vector<std::uint8_t> values;
  for (int i = 0; i < 40 * 40; ++i) values.push_back(kLabels[static_cast<std::size_t>((i % 40 / 7 + i / 40 / 5) % 3)]);
  const Image labels = image_u8(40, 40, 1, values);
  const auto map = [](float x, float y) -> Place { return {x / 3 + 4 * std::sin(y / 6), y / 2 + 5 * std::sin(x / 4)}; };
  const auto push = [&](Interpolation interpolation, warp::SheetOrder over) {
    return push_forward(labels, mesh_of(labels, map), {.width = 24, .height = 24, .supersampling = 3, .over = over},
                        {.interpolation = interpolation, .fill = std::vector<double>{200, 0, 0, 0}});
  };
  const auto is_label = [&](std::uint8_t value) {
    return std::find(kLabels.begin(), kLabels.end(), value) != kLabels.end();
  };
  for (const warp::SheetOrder over : {warp::SheetOrder::kLeastStretched, warp::SheetOrder::kAverage}) {
    const Image found = push(Interpolation::kLabel, over).image;
    const auto pixels = found.values<std::uint8_t>();
    EXPECT_TRUE(std::all_of(pixels.begin(), pixels.end(), is_label));
  }
  const Image mixed = push(Interpolation::kNearest, warp::SheetOrder::kLeastStretched).image;
  const auto pixels = mixed.values<std::uint8_t>();
  EXPECT_FALSE(std::all_of(pixels.begin(), pixels.end(), is_label)) << "the example tests nothing";
}

TEST(PushForward, ALabelIsThatOfMostSamples) {
  // Four pixels and the half of a fifth in one: 5, 5, 9, 9, 9 and nothing; then 5 alone on a third of it.
  const Image labels = image_u8(5, 1, 1, {5, 5, 9, 9, 9});
  const auto shrunk = [](double factor) {
    return [factor](float x, float y) -> Place { return {static_cast<float>(factor * (x + 0.5) - 0.5), y}; };
  };
  const auto value = [&](double factor, std::vector<double> fill) {
    return push_forward(labels, mesh_of(labels, shrunk(factor)), {.width = 1, .height = 1, .supersampling = 8},
                        {.interpolation = Interpolation::kLabel, .fill = fill})
        .image.at(0, 0, 0);
  };
  EXPECT_EQ(value(0.2, {}), 9);
  EXPECT_EQ(value(0.45, {}), 5) << "two of the three fifths that are in the pixel";
  EXPECT_EQ(value(0.05, {}), 0) << "a quarter is covered";
  EXPECT_EQ(value(0.05, {77}), 77);
}

TEST(PushForward, IsTheSameForAnyNumberOfThreads) {
  const Image image = uneven_image(60, 50, 3, PixelType::kUint16);
  for (const warp::SheetOrder over :
       {warp::SheetOrder::kLeastStretched, warp::SheetOrder::kAverage, warp::SheetOrder::kFirst}) {
    std::vector<PushedImage> results;
    for (const int threads : {1, 3}) {
      set_thread_count(threads);
      for (const int rows : {1, 7, 50})
        results.push_back(push_forward(image, mesh_of(image, curl),
                                       {.width = 60, .height = 50, .over = over, .rows_per_band = rows}));
    }
    set_thread_count(0);
    for (const PushedImage& other : results) {
      EXPECT_TRUE(other.image == results.front().image) << over_name(over);
      EXPECT_EQ(other.multiplicity, results.front().multiplicity);
      EXPECT_EQ(other.uncovered, results.front().uncovered);
      EXPECT_EQ(other.coverage.uncovered, results.front().coverage.uncovered);
    }
    EXPECT_GT(results.front().coverage.max_multiplicity, 2);
  }
}

TEST(PushForward, RefusesAMeshOfAnotherSize) {
  const Image image = uneven_image(9, 6, 3, PixelType::kUint8);
  const Image other = uneven_image(6, 9, 3, PixelType::kUint8);
  EXPECT_EQ(error_of([&] { push_forward(image, mesh_of(other, identity), {.width = 9, .height = 6}); }),
            "the mesh has 6 x 9 cells, and the image 9 x 6 pixels");
  EXPECT_THAT(error_of([&] { push_forward(image, mesh_of(image, identity), {.width = 0, .height = 6}); }),
              HasSubstr("sizes must be positive"));
}

}  // namespace
}  // namespace pulson::images
