// Images carried by the map of a registration: which way, and what is refused.

#include "pulson/images/warp_image.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "image_examples.hpp"
#include "images/pushed_mesh.hpp"
#include "plain_options.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::images {
namespace {

using testing::Each;
using testing::HasSubstr;

const Alignment kUnaligned{AlignmentKind::kNone, 1, Eigen::Matrix2d::Identity(), Eigen::Vector2d::Zero()};
constexpr int kSide = 17;

Landmarks shape_of(std::vector<double> numbers) {
  Landmarks shape;
  shape.points = Points::Map(numbers.data(), 2, static_cast<Eigen::Index>(numbers.size() / 2));
  return shape;
}

// A square that becomes a larger, crooked one; with noise its corners move individually.
warp::MaterialFlow flow_of_squares(const std::string& noise = "none") {
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=8";
  options.noise = noise;
  if (noise != "none") options.mode.reset();
  const matching::Registration found =
      register_shapes(shape_of({4, 4, 12, 4, 12, 12, 4, 12}), shape_of({4, 3, 13, 5, 13, 12, 3, 13}), options);
  return {registration_system(found), replay(found)};
}

// Grey that rises to the right, and less so downwards.
Image ramp() {
  std::vector<float> values;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) values.push_back(static_cast<float>(100 + 5 * x - 3 * y));
  return {kSide, kSide, 1, std::span<const float>(values)};
}

class WarpImage : public testing::Test {
 protected:
  const warp::MaterialFlow flow_ = flow_of_squares();
  const ImageWarp warp_{flow_, kUnaligned, {}, {}};
  const WarpImageOptions options_{.width = kSide, .height = kSide, .border = Border::kReplicate};
};

// image'(φ(x)) = image(x), and back again image(x) = image'(φ(x)).
TEST_F(WarpImage, CarriesPixelsThereAndBack) {
  const WarpedImage there = warp_image(ramp(), warp_, options_);
  EXPECT_TRUE(there.pulled);
  EXPECT_EQ(there.reason, "the map is a diffeomorphism");
  EXPECT_EQ(there.figures.folded_fraction, 0);
  EXPECT_GT(there.figures.min_jacobian, 0);
  const Points ends = warp_.forward((Points(2, 1) << 8, 8).finished()).places;
  const int x = static_cast<int>(std::lround(ends(0, 0))), y = static_cast<int>(std::lround(ends(1, 0)));
  const Eigen::Vector2d from = warp_.backward((Points(2, 1) << x, y).finished()).places;
  EXPECT_NEAR(there.image.at(x, y, 0), 100 + 5 * from.x() - 3 * from.y(), 0.2);

  WarpImageOptions inverse = options_;
  inverse.inverse = true;
  const WarpedImage back = warp_image(there.image, warp_, inverse);
  for (int j = 5; j < 12; ++j)
    for (int i = 5; i < 12; ++i) EXPECT_NEAR(back.image.at(i, j, 0), 100 + 5 * i - 3 * j, 0.3);
}

TEST_F(WarpImage, IsTheSamePictureWhenPushed) {
  WarpImageOptions pushing = options_;
  pushing.method = WarpMethod::kPush;
  const WarpedImage pulled = warp_image(ramp(), warp_, options_), pushed = warp_image(ramp(), warp_, pushing);
  EXPECT_FALSE(pushed.pulled);
  EXPECT_EQ(pushed.reason, "as requested");
  for (int y = 4; y < 13; ++y)
    for (int x = 4; x < 13; ++x) EXPECT_NEAR(pushed.image.at(x, y, 0), pulled.image.at(x, y, 0), 0.5);
}

// Displacements and Jacobians are those of the map itself.
TEST_F(WarpImage, ReportsTheMapOnTheImage) {
  WarpImageOptions asking = options_;
  asking.with_displacements = true;
  const WarpedImage pulled = warp_image(ramp(), warp_, asking);
  ASSERT_EQ(pulled.displacements.size(), 2U * kSide * kSide);
  const std::vector<float> jacobians = jacobians_on_image(ramp(), warp_, options_);
  const std::vector<float> lengths = displacements_on_image(ramp(), warp_, options_);
  for (const int i : {108, 144, 180}) {  // (6, 6), (8, 8), (10, 10)
    const auto at = static_cast<std::size_t>(i);
    const Points pixel = (Points(2, 1) << i % kSide, std::floor(i / kSide)).finished();
    const warp::MovedPoints forward = warp_.forward(pixel);
    const Eigen::Vector2d back = warp_.backward(pixel).places - pixel;
    EXPECT_NEAR(pulled.displacements[2 * at], back.x(), options_.tolerance);
    EXPECT_NEAR(pulled.displacements[2 * at + 1], back.y(), options_.tolerance);
    EXPECT_NEAR(jacobians[at], forward.jacobians()[0], 0.4 * options_.tolerance);
    EXPECT_NEAR(lengths[at], (forward.places - pixel).norm(), options_.tolerance);
  }
}

TEST_F(WarpImage, RefusesWhatTheMapDoesNotAllow) {
  WarpImageOptions options = options_;
  options.inverse = true;
  options.method = WarpMethod::kPush;
  EXPECT_EQ(error_of([&] { warp_image(ramp(), warp_, options); }),
            "`inverse` always pulls the image; it cannot be combined with `method = push`");
  const warp::MaterialFlow noisy = flow_of_squares("ch-sd:beta=1");
  ASSERT_FALSE(noisy.is_diffeomorphic());
  const ImageWarp of_noise(noisy, kUnaligned, {}, {});
  EXPECT_FALSE(warp_image(ramp(), of_noise, options_).pulled);
  options = options_;
  options.method = WarpMethod::kPull;
  EXPECT_THAT(error_of([&] { warp_image(ramp(), of_noise, options); }),
              HasSubstr("`method = pull` needs a map that has an inverse"));
  options.method = WarpMethod::kPush;
  options.over = warp::SheetOrder::kPriority;
  options.label_ranks = {0, 1};
  EXPECT_EQ(error_of([&] { warp_image(ramp(), of_noise, options); }), "2 ranks for 4 landmarks");
}

// Before anything of that size is allocated: it would be 40 GB.
TEST_F(WarpImage, RefusesResultsOfTooManyPixels) {
  WarpImageOptions options = options_;
  options.width = options.height = 100'000;
  EXPECT_EQ(error_of([&] { warp_image(ramp(), warp_, options); }),
            "the warped image has 100000 x 100000 pixels, more than `max_pixels = 200000000` allows");
  options.width = options.height = kSide;
  options.max_pixels = kSide * kSide - 1;
  EXPECT_THAT(error_of([&] { warp_image(ramp(), warp_, options); }), HasSubstr("more than `max_pixels = 288`"));
  options.max_pixels = kSide * kSide;
  EXPECT_EQ(warp_image(ramp(), warp_, options).image.pixel_count(), 289U);
}

}  // namespace
}  // namespace pulson::images
