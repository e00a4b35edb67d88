// Images and the map of a landmark path: frames, direction, and there and back.

#include "pulson/images/image_warp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "image_examples.hpp"
#include "images/push_forward.hpp"
#include "kernel_definition.hpp"
#include "plain_options.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::images {
namespace {

constexpr int kWidth = 64, kHeight = 48;

Points pixel_grid(int width, int height, double first) {
  Points grid(2, static_cast<Eigen::Index>(width) * height);
  for (Eigen::Index i = 0; i < grid.cols(); ++i)
    grid.col(i) << first + static_cast<double>(i % width), first + std::floor(static_cast<double>(i) / width);
  return grid;
}

std::vector<std::array<float, 2>> floats(const Points& points) {
  std::vector<std::array<float, 2>> places;
  const Eigen::MatrixXf rounded = points.cast<float>();
  for (const auto& point : rounded.colwise()) places.push_back({point.x(), point.y()});
  return places;
}

// Hills without symmetry, so smooth that interpolation errs by less than 1 of 255.
Image hills() {
  std::vector<float> values;
  const auto hill = [](double x, double y, double cx, double cy, double size) {
    return std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (size * size));
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      values.push_back(static_cast<float>(hill(x, y, 40, 15, 12) + 0.5 * hill(x, y, 18, 30, 8)));
  return {kWidth, kHeight, 1, std::span<const float>(values)};
}

// Largest difference over pixels further than `margin` from the edge.
double difference(const Image& a, const Image& b, int margin) {
  double most = 0;
  for (int y = margin; y < kHeight - margin; ++y)
    for (int x = margin; x < kWidth - margin; ++x) most = std::max(most, std::abs(a.at(x, y, 0) - b.at(x, y, 0)));
  return most;
}

Image pulled(const Image& image, const ImageWarp& warp) {
  return remap(image, {kWidth, kHeight, floats(warp.backward(pixel_grid(kWidth, kHeight, 0)).places)});
}

Image pushed(const Image& image, const ImageWarp& warp) {
  warp::DeformedMesh mesh{kWidth + 1, kHeight + 1,
                          floats(warp.forward(pixel_grid(kWidth + 1, kHeight + 1, -0.5)).places)};
  return push_forward(image, std::move(mesh), {.width = kWidth, .height = kHeight}).image;
}

Landmarks circle(int count, double radius, double bump, const Eigen::Vector2d& centre) {
  Landmarks shape;
  shape.points.resize(2, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    const double r = radius + bump * std::cos(3 * angle);
    shape.points.col(a) = centre + r * Eigen::Vector2d(std::cos(angle), 0.8 * std::sin(angle));
  }
  return shape;
}

// The flow of a registration at rest.
warp::MaterialFlow still(const Landmarks& shape) {
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=0.5";
  const matching::Registration registration = register_shapes(shape, shape, options);
  EXPECT_LE(registration.momenta.norm(), 1e-12);
  return {registration_system(registration), replay(registration)};
}

const Alignment kNoAlignment{AlignmentKind::kNone, 1, Eigen::Matrix2d::Identity(), Eigen::Vector2d::Zero()};

TEST(Frame, GoesToLandmarksAndBack) {
  const Points pixels = 50 * random_points(2, 20, 1);
  for (const bool y_up : {false, true}) {
    const Frame frame{{-3, 4}, {0.02, 0.03}, !y_up, 48};
    EXPECT_LE((frame.to_pixels(frame.to_landmarks(pixels)) - pixels).norm(), 1e-11);
    const Points steps = frame.to_landmarks(pixels.colwise() + Eigen::Vector2d(1, 1)) - frame.to_landmarks(pixels);
    EXPECT_LE((steps.colwise() - frame.scale()).norm(), 1e-12);
  }
}

TEST(Frame, CountsFromTheFirstPixelDownOrFromTheLowerEdgeUp) {
  const Points corners = (Points(2, 2) << 0, 10, 0, 48).finished();
  EXPECT_LE(((Frame{{-3, 4}, {0.5, 0.25}}).to_landmarks(corners) - (Points(2, 2) << -3, 2, 4, 16).finished()).norm(),
            1e-14);
  EXPECT_LE(((Frame{{-3, 4}, {0.5, 0.25}, false, 48}).to_landmarks(corners) - (Points(2, 2) << -3, 2, 16, 4).finished())
                .norm(),
            1e-14);
}

// By 0.3 and (0.1, −0.06) in landmark units of 0.02 a pixel, y down or up: where the analytic inverse finds a colour.
TEST(ImageWarp, TurnsAndShiftsThePictureTheWayTheLandmarksGo) {
  const warp::MaterialFlow flow = still(circle(6, 0.4, 0, {0, 0}));
  const Image image = hills();
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.3).toRotationMatrix();
  const Eigen::Vector2d shift(0.1, -0.06);
  for (const bool y_up : {false, true}) {
    const Frame frame{{-0.64, -0.48}, {0.02, 0.02}, !y_up, kHeight};
    const ImageWarp warp(flow, {AlignmentKind::kRigid, 1, turn, shift}, frame, frame);
    const double sign = y_up ? -1 : 1;
    const double centre_y = y_up ? kHeight - 24 : 24;  // of the landmarks' origin; in x it is 32
    const PixelMap analytic = map_of(kWidth, kHeight, [&](float x, float y) -> std::array<float, 2> {
      const double u = 0.02 * (x - 32) - shift.x(), v = sign * 0.02 * (y - centre_y) - shift.y();
      return {static_cast<float>(32 + (std::cos(0.3) * u + std::sin(0.3) * v) / 0.02),
              static_cast<float>(centre_y + sign * (-std::sin(0.3) * u + std::cos(0.3) * v) / 0.02)};
    });
    const Image expected = remap(image, analytic);
    EXPECT_GT(difference(expected, image, 0), 0.3);
    EXPECT_LE(difference(pulled(image, warp), expected, 0), 0.01) << y_up;
    EXPECT_LE(difference(pushed(image, warp), expected, 12), 0.01) << y_up;
  }
}

// Momenta of a wide kernel shift everything alike.
TEST(ImageWarp, FollowsTheFlow) {
  const Landmarks source = circle(6, 0.4, 0, {0, 0});
  Landmarks target = source;
  target.points.colwise() += Eigen::Vector2d(0.16, 0.08);
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=300";
  options.sigma = 1e-4;
  const matching::Registration registration = register_shapes(source, target, options);
  ASSERT_LE(registration.rms(), 1e-3);
  const warp::MaterialFlow flow(registration_system(registration), replay(registration));
  const Frame frame{{-0.64, -0.48}, {0.02, 0.02}};
  const ImageWarp warp(flow, kNoAlignment, frame, frame);
  const Image image = hills();
  const Image expected = remap(image, map_of(kWidth, kHeight, [](float x, float y) -> std::array<float, 2> {
                                 return {x - 8, y - 4};
                               }));
  EXPECT_LE(difference(pulled(image, warp), expected, 0), 0.02);
  EXPECT_LE(difference(pushed(image, warp), expected, 0), 0.02);
}

TEST(ImageWarp, OfShapesThatAreTheSameIsTheSamePicture) {
  const warp::MaterialFlow flow = still(circle(6, 20, 0, {32, 24}));
  const Frame frame;
  const ImageWarp warp(flow, kNoAlignment, frame, frame);
  for (const int channels : {1, 3, 4}) {
    const Image image = uneven_image(kWidth, kHeight, channels, PixelType::kUint8);
    EXPECT_TRUE(pulled(image, warp) == image) << channels;
    EXPECT_TRUE(pushed(image, warp) == image) << channels;
  }
}

class FittedWarp : public testing::Test {
 protected:
  FittedWarp() {
    matching::RegistrationOptions options = plain_options();
    options.kernel = "gaussian:alpha=0.5";
    options.align = AlignmentKind::kSimilarity;
    registration_ = register_shapes(circle(12, 0.4, 0, {0, 0}), circle(12, 0.45, 0.1, {0.1, 0.05}), options);
    flow_.emplace(registration_system(registration_), replay(registration_));
    warp_.emplace(*flow_, registration_.alignment, Frame{{-0.64, -0.48}, {0.02, 0.02}},
                  Frame{{-1, -0.9}, {0.03, 0.025}, false, kHeight});
  }

  matching::Registration registration_;
  std::optional<warp::MaterialFlow> flow_;
  std::optional<ImageWarp> warp_;
};

TEST_F(FittedWarp, BackwardUndoesForward) {
  const Points pixels = pixel_grid(kWidth, kHeight, 0);
  const warp::MovedPoints there = warp_->forward(pixels);
  EXPECT_GT((there.places - pixels).norm(), 100);
  const warp::MovedPoints back = warp_->backward(there.places);
  EXPECT_LE((back.places - pixels).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((warp_->forward(warp_->backward(pixels).places).places - pixels).cwiseAbs().maxCoeff(), 1e-6);
  for (Eigen::Index m = 0; m < pixels.cols(); ++m)
    ASSERT_LE(
        (there.gradients.col(m).reshaped(2, 2) * back.gradients.col(m).reshaped(2, 2) - Eigen::Matrix2d::Identity())
            .norm(),
        1e-9);
}

TEST_F(FittedWarp, HasTheGradientsOfItsPlacesInPixels) {
  const Points pixels = 20 * random_points(2, 30, 4).array() + 25;
  const warp::MovedPoints moved = warp_->forward(pixels);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = 1e-3 * Eigen::Vector2d::Unit(axis);
    const Points slope =
        (warp_->forward(pixels.colwise() + step).places - warp_->forward(pixels.colwise() - step).places) / 2e-3;
    EXPECT_LE((slope - moved.gradients.middleRows(2 * axis, 2)).norm(), 1e-6 * slope.norm());
  }
  EXPECT_LT(moved.jacobians().maxCoeff(), 0);  // y is down here and up there
}

TEST_F(FittedWarp, CarriesThePixelsOfLandmarksAlongTheirPaths) {
  const std::vector<Points> paths = warp_->landmark_paths();
  const std::vector<Points> moved = warp_->paths(warp_->label_pixels());
  ASSERT_EQ(moved.size(), paths.size());
  for (std::size_t k = 0; k < paths.size(); ++k) EXPECT_LE((moved[k] - paths[k]).norm(), 1e-9) << k;
  EXPECT_LE((warp_->forward(warp_->label_pixels()).places - paths.back()).norm(), 1e-9);
  EXPECT_LE((warp_->source().to_landmarks(warp_->label_pixels()) - registration_.original.points).norm(), 1e-12);
  EXPECT_LE((warp_->target().to_landmarks(paths.back()) - registration_.result).norm(), 1e-9);
  EXPECT_LE(warp_->landmark_error(), 1e-9);
}

// Landmarks on a line, and a strip of 5 rows over each, in units and directions of its own.
class StripWarp : public testing::Test {
 protected:
  StripWarp() {
    Landmarks source, target;
    source.points = (Points(1, 4) << 1, 3, 5, 6).finished();
    target.points = (Points(1, 4) << 1.4, 2.7, 5.5, 6.1).finished();
    matching::RegistrationOptions options = plain_options();
    options.kernel = "gaussian:alpha=1.5";
    registration_ = register_shapes(source, target, options);
    flow_.emplace(registration_system(registration_), replay(registration_));
    warp_.emplace(*flow_, registration_.alignment, source_, target_);
  }

  const Frame source_{{-1, 4}, {0.1, 2}, true, 5, 90};
  const Frame target_{{0.5, -3}, {0.05, 1}, false, 5, 160};
  matching::Registration registration_;
  std::optional<warp::MaterialFlow> flow_;
  std::optional<ImageWarp> warp_;
};

TEST_F(StripWarp, MovesXByTheFlowAndKeepsRows) {
  const Points pixels = (random_points(2, 40, 1).array() + 1) * Eigen::Array2d(45, 2.5).replicate(1, 40);
  const warp::MovedPoints moved = warp_->forward(pixels);
  const Points places = flow_->end(0.1 * pixels.topRows(1).array() - 1);
  EXPECT_LE((moved.places.row(0).array() - (places.array() - 0.5) / 0.05).matrix().norm(), 1e-10);
  EXPECT_EQ(moved.places.row(1), pixels.row(1));
  EXPECT_LE((warp_->backward(moved.places).places - pixels).norm(), 1e-8);
  EXPECT_EQ(warp_->orientation(), 1);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = 1e-3 * Eigen::Vector2d::Unit(axis);
    const Points slope =
        (warp_->forward(pixels.colwise() + step).places - warp_->forward(pixels.colwise() - step).places) / 2e-3;
    EXPECT_LE((slope - moved.gradients.middleRows(2 * axis, 2)).norm(), 1e-6 * slope.norm());
  }
  EXPECT_LE((warp_->aligned_backward(warp_->aligned(pixels)) - pixels).norm(), 1e-10);
}

TEST_F(StripWarp, HasItsLandmarksInTheMiddleOfItsRows) {
  const Points labels = warp_->label_pixels();
  EXPECT_LE((labels.row(0) - (Points(1, 4) << 20, 40, 60, 70).finished()).norm(), 1e-12);
  EXPECT_LE((labels.row(1).array() - 2).matrix().norm(), 1e-12);
  EXPECT_LE((warp_->forward(labels).places - warp_->landmark_paths().back()).norm(), 1e-9);
  EXPECT_LE((warp_->target().to_landmarks(warp_->landmark_paths().back()).topRows(1) - registration_.result).norm(),
            1e-9);
}

TEST(ImageWarp, IsOfALineOrThePlane) {
  Landmarks solid;
  solid.points = random_points(3, 6, 1);
  const warp::MaterialFlow flow = still(solid);
  EXPECT_EQ(error_of([&] { ImageWarp(flow, kNoAlignment, {}, {}); }),
            "images are of a line or the plane, and the landmarks are in 3D");
}

}  // namespace
}  // namespace pulson::images
