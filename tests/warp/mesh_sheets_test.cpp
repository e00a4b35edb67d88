// Which sheet of a folded mesh is on top, and all sheets one by one.

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "mesh_raster_examples.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {
namespace {

// Two patches of 10 columns, each with its own map of its places from (-0.5, -0.5) on, and nowhere between them.
constexpr int kSecondPatch = 12;
DeformedMesh patches(const Map& first, const Map& second) {
  return mesh_of(22, 10, [&](double x, double y) {
    if (x < 10) return first(x, y);
    return x < 11 ? Place{kFloatNaN, kFloatNaN} : second(x - kSecondPatch, y);
  });
}

const Map kSame = [](double x, double y) { return Place{x, y}; };
const Map kTwice = [](double x, double y) { return Place{2 * x, 2 * y}; };
const Map kMirror = [](double x, double y) { return Place{9 - x, y}; };
const Map kSmallMirror = [](double x, double y) { return Place{9 - 0.5 * x, 0.5 * y + 2}; };

// Whether the second patch is on top of the first, at pixel (6, 4).
bool second_on_top(const DeformedMesh& mesh, SheetOrder over, std::vector<float> priority = {}) {
  const RasterBand band = whole(MeshRaster(mesh, {20, 20, 1, over}, std::move(priority)));
  EXPECT_EQ(count_at(band, 6, 4), 2);
  return label_at(band, 6, 4)[0] > kSecondPatch - 1;
}

TEST(SheetOrder, LeastStretchedPrefersOrientationThenStretchThenTheFirst) {
  for (const SheetOrder over : {SheetOrder::kLeastStretched, SheetOrder::kAverage}) {
    EXPECT_FALSE(second_on_top(patches(kSame, kTwice), over));
    EXPECT_TRUE(second_on_top(patches(kTwice, kSame), over));
    EXPECT_FALSE(second_on_top(patches(kTwice, kMirror), over));
    EXPECT_TRUE(second_on_top(patches(kMirror, kTwice), over));
    EXPECT_TRUE(second_on_top(patches(kMirror, kSmallMirror), over));
    EXPECT_FALSE(second_on_top(patches(kSame, kSame), over));
  }
}

TEST(SheetOrder, FirstIsTheFirst) {
  EXPECT_FALSE(second_on_top(patches(kTwice, kSame), SheetOrder::kFirst));
  EXPECT_FALSE(second_on_top(patches(kMirror, kSame), SheetOrder::kFirst));
}

TEST(SheetOrder, PriorityGoesBeforeStretch) {
  const DeformedMesh mesh = patches(kSame, kTwice);
  const auto priority = [&](float second) {
    std::vector<float> values;
    for (int cell = 0; cell < mesh.cell_columns() * mesh.cell_rows(); ++cell)
      values.push_back(cell % mesh.cell_columns() < kSecondPatch ? 1 : second);
    return values;
  };
  EXPECT_FALSE(second_on_top(mesh, SheetOrder::kPriority, priority(-1)));
  EXPECT_FALSE(second_on_top(mesh, SheetOrder::kPriority, priority(1)));
  EXPECT_TRUE(second_on_top(mesh, SheetOrder::kPriority, priority(2)));
  EXPECT_TRUE(second_on_top(patches(kTwice, kSame), SheetOrder::kPriority, priority(1)));
}

TEST(SheetOrder, HasNames) {
  for (const SheetOrder over :
       {SheetOrder::kLeastStretched, SheetOrder::kAverage, SheetOrder::kFirst, SheetOrder::kPriority})
    EXPECT_EQ(parse_over(over_name(over)), over);
  const std::string error = error_of([] { parse_over("frist"); });
  EXPECT_NE(error.find("valid: least-stretched, average, first, label-order"), std::string::npos) << error;
  EXPECT_NE(error.find("did you mean 'first'"), std::string::npos) << error;
}

// The sheets of |x − 19.5|, the left one first.
TEST(MeshRaster, HandsOutEverySheet) {
  const MeshRaster raster(mesh_of(40, 40,
                                  [](double x, double y) {
                                    return Place{std::abs(x - 19.5), y};
                                  }),
                          {15, 40, 2, SheetOrder::kAverage});
  const std::array<RasterBand, 3> sheets = {whole_sheet(raster, 0), whole_sheet(raster, 1), whole_sheet(raster, 2)};
  for_each_sample(sheets[0], [&](std::size_t i, double x, double y) {
    const auto expect_label = [&](std::size_t n, double label, int reversed) {
      ASSERT_NEAR(sheets[n].labels[i][0], label, 1e-5);
      ASSERT_NEAR(sheets[n].labels[i][1], y, 1e-5);
      ASSERT_EQ(sheets[n].reversed[i], reversed);
    };
    for (const RasterBand& sheet : sheets) ASSERT_EQ(sheet.counts[i], x < 0 ? 0 : 2);
    EXPECT_TRUE(std::isnan(sheets[2].labels[i][0]));
    if (x < 0) return;
    expect_label(0, 19.5 - x, 1);
    expect_label(1, 19.5 + x, 0);
  });
}

TEST(MeshRaster, CountsSaturate) {
  const MeshRaster raster(mesh_of(700, 4,
                                  [](double x, double y) {
                                    return Place{std::fmod(x + 0.5, 2) * 4 - 0.5, y};
                                  }),
                          {4, 4, 1, SheetOrder::kFirst});
  EXPECT_EQ(coverage(whole(raster)).max_multiplicity, 255);
  EXPECT_FALSE(std::isnan(label_at(whole_sheet(raster, 254), 1, 1)[0]));
}

}  // namespace
}  // namespace pulson::warp
