// Where the map of a picture folds: by its Jacobian at the picture's pixels, however the picture is carried.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "image_examples.hpp"
#include "images/pushed_mesh.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::images {
namespace {

const Alignment kAsItIs{AlignmentKind::kNone, 1, Eigen::Matrix2d::Identity(), Eigen::Vector2d::Zero()};
const Alignment kMirrored{AlignmentKind::kRigid, 1, (Eigen::Matrix2d() << -1, 0, 0, 1).finished(),
                          Eigen::Vector2d(63, 0)};
constexpr int kPictureSide = 64;
const Eigen::Vector2d kMiddle(31.5, 31.5);

warp::MaterialFlow flow_of(const std::string& noise, const PhaseState& initial, int steps,
                           const Eigen::MatrixXd& increments) {
  const StochasticSystem system{make_kernel("gaussian:alpha=6"), make_noise(noise)};
  return {system, make_integrator("midpoint")->integrate(system, initial, {1, steps}, increments)};
}

// Landmarks on a ring that turn about its middle: pixels are stretched up to five times.
PhaseState turning_ring() {
  constexpr int kCount = 8;
  PhaseState state{Points(2, kCount), Points(2, kCount)};
  for (int a = 0; a < kCount; ++a) {
    const double angle = a * 2 * std::numbers::pi / kCount;
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
    state.q.col(a) = kMiddle + 8 * out;
    state.p.col(a) = 12 * Eigen::Vector2d(-out[1], out[0]) - 4 * out;
  }
  return state;
}
warp::MaterialFlow swirl() { return flow_of("none", turning_ring(), 20, Eigen::MatrixXd(0, 20)); }

// Two landmarks, which noise of their own lets change places.
warp::MaterialFlow exchange() {
  PhaseState state{Points(2, 2), Points::Zero(2, 2)};
  state.q << 22, 41, 31, 31;
  Eigen::MatrixXd increments = Eigen::MatrixXd::Zero(4, 2);
  increments.col(0) << 19, 2, -19, -2;
  return flow_of("ch-sd:beta=1", state, 2, increments);
}

WarpImageOptions options_by(WarpMethod method) {
  return {.width = kPictureSide, .height = kPictureSide, .method = method, .border = Border::kReplicate};
}

Image picture() { return uneven_image(kPictureSide, kPictureSide, 1, PixelType::kUint8); }

int flipped_triangles_of_pixels(const ImageWarp& warp) {
  int flipped = 0;
  for (int y = 0; y < kPictureSide; ++y)
    for (int x = 0; x < kPictureSide; ++x) {
      Points corners(2, 4);
      corners << x, x + 1, x, x + 1, y, y, y + 1, y + 1;
      const Points there = warp.forward(corners.array() - 0.5).places;
      for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{3, 2, 1}}) {
        Eigen::Matrix2d sides;
        sides << there.col(b) - there.col(a), there.col(c) - there.col(a);
        flipped += sides.determinant() < 0 ? 1 : 0;
      }
    }
  return flipped;
}

// A strong shear turns triangles of pixels over, and nothing of that may be seen.
TEST(Folds, AreNoneOfASwirlByAnyMethod) {
  const warp::MaterialFlow flow = swirl();
  const ImageWarp warp(flow, kAsItIs, {}, {});
  EXPECT_GT(flipped_triangles_of_pixels(warp), 20);
  for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush}) {
    const WarpedImage result = warp_image(picture(), warp, options_by(method));
    EXPECT_EQ(result.figures.folded_fraction, 0);
    EXPECT_GT(result.figures.min_jacobian, 0);
    EXPECT_EQ(result.figures.max_multiplicity, 1);
    EXPECT_EQ(result.figures.hole_fraction, 0);
  }
  const std::vector<float> jacobians = jacobians_on_image(picture(), warp, options_by(WarpMethod::kPush));
  EXPECT_EQ(std::count_if(jacobians.begin(), jacobians.end(), warp::is_fold), 0);
}

TEST(Folds, AreNoneOfTheIdentityAndOfTranslationsMirroredOrNot) {
  const Eigen::MatrixXd shift = Eigen::Vector2d(3.3, -1.7);
  for (const Alignment& alignment : {kAsItIs, kMirrored})
    for (const double factor : {0.0, 1.0}) {
      const warp::MaterialFlow flow = flow_of("p-sd:beta=1", {kMiddle, Points::Zero(2, 1)}, 1, factor * shift);
      const ImageWarp warp(flow, alignment, {}, {});
      for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush}) {
        const MapFigures figures = warp_image(picture(), warp, options_by(method)).figures;
        EXPECT_EQ(figures.folded_fraction, 0);
        EXPECT_NEAR(figures.min_jacobian, 1, 1e-6);
        EXPECT_EQ(figures.max_multiplicity, 1);
      }
    }
}

// By differences on a grid four times as fine as the pixels.
double folded_by_differences(const ImageWarp& warp) {
  constexpr int kFine = 4;
  constexpr double kStep = 1e-4;
  constexpr Eigen::Index kNodes = Eigen::Index{kFine} * kPictureSide;
  Points x(2, kNodes * kNodes);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Index row = i / kNodes;
    x.col(i) << static_cast<double>(i - row * kNodes), static_cast<double>(row);
  }
  x = (x.array() + 0.5) / kFine - 0.5;
  const auto along = [&](const Eigen::Vector2d& step) -> Points {
    return (warp.forward(x.colwise() + step).places - warp.forward(x.colwise() - step).places) / (2 * kStep);
  };
  const Points by_x = along({kStep, 0}), by_y = along({0, kStep});
  const Eigen::ArrayXd jacobians =
      by_x.row(0).array() * by_y.row(1).array() - by_x.row(1).array() * by_y.row(0).array();
  return static_cast<double>((jacobians < 0).count()) / static_cast<double>(jacobians.size());
}

// Their outlines, some 100 pixels long, pass through pixels of which the centre decides.
TEST(Folds, OfAnExchangeHaveTheAreaThatDifferencesFind) {
  const warp::MaterialFlow flow = exchange();
  const ImageWarp warp(flow, kAsItIs, {}, {});
  const WarpedImage result = warp_image(picture(), warp, options_by(WarpMethod::kAuto));
  EXPECT_EQ(result.reason, "the map folds");
  EXPECT_GT(result.figures.folded_fraction, 0.03);
  EXPECT_NEAR(result.figures.folded_fraction, folded_by_differences(warp), 0.002);
  EXPECT_LT(result.figures.min_jacobian, -1);
  EXPECT_GE(result.figures.max_multiplicity, 3);
  const std::vector<float> jacobians = jacobians_on_image(picture(), warp, options_by(WarpMethod::kPush));
  EXPECT_EQ(std::count_if(jacobians.begin(), jacobians.end(), warp::is_fold),
            std::lround(result.figures.folded_fraction * kPictureSide * kPictureSide));
  EXPECT_EQ(*std::min_element(jacobians.begin(), jacobians.end()), static_cast<float>(result.figures.min_jacobian));
}

}  // namespace
}  // namespace pulson::images
