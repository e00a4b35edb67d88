// The map of all nodes of a plane, against the exact map at every one of them.

#include "pulson/warp/sampled_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "numbers.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::warp {
namespace {

// A displacement and its derivatives.
struct Moved {
  double dx, dy;
  double dx_x = 0, dy_x = 0, dx_y = 0, dy_y = 0;
};

template <class Displacement>
PlaneMap displaced(const Displacement& at) {
  return [at](const Points& points) {
    MovedPoints moved{points, Eigen::MatrixXd(4, points.cols())};
    for (Eigen::Index m = 0; m < points.cols(); ++m) {
      const Moved by = at(points(0, m), points(1, m));
      moved.places.col(m) += Eigen::Vector2d(by.dx, by.dy);
      moved.gradients.col(m) << 1 + by.dx_x, by.dy_x, by.dx_y, 1 + by.dy_y;
    }
    return moved;
  };
}

const PlaneMap kIdentity = displaced([](double, double) { return Moved{0, 0}; });

const PlaneMap kWaves = displaced([](double x, double y) {
  const double k = 0.05;
  const double a = 8;
  return Moved{a * std::sin(k * (x + y)),     a * std::cos(k * (y - 0.5 * x)),
               a * k * std::cos(k * (x + y)), 0.5 * a * k * std::sin(k * (y - 0.5 * x)),
               a * k * std::cos(k * (x + y)), -a * k * std::sin(k * (y - 0.5 * x))};
});

// A gaussian of that width in pixels about a centre.
PlaneMap spot(double centre_x, double centre_y, double width) {
  return displaced([=](double x, double y) {
    const double u = (x - centre_x) / width;
    const double v = (y - centre_y) / width;
    const double value = 4 * std::exp(-0.5 * (u * u + v * v));
    return Moved{value, 0, -value * u / width, 0, -value * v / width, 0};
  });
}

// |distance| / 2 from a line through a place in some direction.
PlaneMap kink(double through_x, double through_y, double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180);
  const double s = std::sin(degrees * std::numbers::pi / 180);
  return displaced([=](double x, double y) {
    const double along = c * (x - through_x) + s * (y - through_y);
    const double slope = along < 0 ? -0.5 : 0.5;
    return Moved{slope * along, 0, slope * c, 0, slope * s, 0};
  });
}

struct TrueErrors {
  double place = 0;
  double jacobian = 0;
  int without_value = 0;
};

// At every node; what has no value must agree.
TrueErrors true_errors(const SampledMap& sampled, const PlaneMap& map, double first) {
  Points nodes(2, static_cast<Eigen::Index>(sampled.places.size()));
  for (int row = 0; row < sampled.rows; ++row)
    for (int column = 0; column < sampled.columns; ++column)
      nodes.col(Eigen::Index{row} * sampled.columns + column) << column + first, row + first;
  const MovedPoints exact = map(nodes);
  const Eigen::VectorXd jacobians = exact.jacobians();
  TrueErrors errors;
  for (Eigen::Index m = 0; m < nodes.cols(); ++m) {
    const auto& place = sampled.places[static_cast<std::size_t>(m)];
    const bool has_value = std::isfinite(exact.places(0, m));
    EXPECT_EQ(std::isfinite(place[0]), has_value) << nodes.col(m).transpose();
    if (!has_value) {
      ++errors.without_value;
      continue;
    }
    errors.place = std::max(errors.place, std::hypot(place[0] - exact.places(0, m), place[1] - exact.places(1, m)));
    if (sampled.jacobians.empty()) continue;
    errors.jacobian =
        std::max(errors.jacobian, std::abs(sampled.jacobians[static_cast<std::size_t>(m)] - jacobians[m]));
  }
  return errors;
}

constexpr double kRounding = 1e-4;  // of places of some hundred pixels as floats

void expect_within(const PlaneMap& map, const SampledPlane& plane, double tolerance, int coarsest = 64) {
  for (const bool with_jacobians : {false, true}) {
    SCOPED_TRACE("tolerance " + std::to_string(tolerance) + (with_jacobians ? ", with jacobians" : ""));
    const SampledMap sampled = sample_map(map, plane, tolerance, with_jacobians, coarsest);
    ASSERT_EQ(sampled.places.size(), static_cast<std::size_t>(plane.columns * plane.rows));
    const TrueErrors errors = true_errors(sampled, map, plane.first);
    EXPECT_LE(errors.place, tolerance + kRounding);
    EXPECT_LE(sampled.error, 0.5 * tolerance);
    EXPECT_EQ(sampled.jacobians.size(), with_jacobians ? sampled.places.size() : 0);
    EXPECT_LE(errors.jacobian, 0.4 * tolerance + 1e-6);
    EXPECT_LE(sampled.jacobian_error, 0.1 * tolerance);
  }
}

constexpr SampledPlane kPlane = {300, 260, 0};

TEST(SampledMap, IdentityAndAffineMapsTakeFewExactPoints) {
  const PlaneMap affine = displaced(
      [](double x, double y) { return Moved{3 + 0.2 * x - 0.1 * y, -0.3 * x + 0.4 * y - 7, 0.2, -0.3, -0.1, 0.4}; });
  for (const PlaneMap& map : {kIdentity, affine})
    for (const double first : {0.0, -0.5}) {
      const SampledMap sampled = sample_map(map, {120, 100, first}, 0.01, true);
      const TrueErrors errors = true_errors(sampled, map, first);
      EXPECT_LE(errors.place, 1e-5);
      EXPECT_LE(errors.jacobian, 1e-6);
      EXPECT_LT(sampled.exact_fraction, 0.02);
      EXPECT_LE(sampled.error, 1e-12);
    }
}

TEST(SampledMap, SmoothMapsAreWithinTolerance) {
  for (const double tolerance : {0.5, 0.05, 0.005})
    for (const double first : {0.0, -0.5}) expect_within(kWaves, {300, 260, first}, tolerance);
}

TEST(SampledMap, ReportsTheErrorThatIsThere) {
  for (const double tolerance : {0.5, 0.05, 0.005}) {
    const SampledMap sampled = sample_map(kWaves, kPlane, tolerance, true, 64);
    const TrueErrors errors = true_errors(sampled, kWaves, 0);
    EXPECT_LE(errors.place, 2 * sampled.error + kRounding) << tolerance;
    EXPECT_GE(errors.place, sampled.error - kRounding) << tolerance;
    EXPECT_LE(errors.jacobian, 2 * sampled.jacobian_error) << tolerance;
    EXPECT_GE(errors.jacobian, sampled.jacobian_error - 1e-6) << tolerance;
  }
}

TEST(SampledMap, FinerTolerancesTakeMorePoints) {
  double before = 0;
  for (const double tolerance : {0.5, 0.05, 0.005, 0.0005}) {
    const double fraction = sample_map(kWaves, kPlane, tolerance, false, 64).exact_fraction;
    EXPECT_GT(fraction, before);
    before = fraction;
  }
  EXPECT_LT(before, 0.5);
}

// Where lattices of cells of 16 nodes see it, wherever it is.
TEST(SampledMap, RefinesASharpSpotAlone) {
  for (const double shift : {0.0, 1.0, 2.5, 4.0, 7.0, 11.3, 15.9})
    for (const double tolerance : {0.5, 0.05}) {
      SCOPED_TRACE(shift);
      const PlaneMap map = spot(130 + shift, 120 + 0.7 * shift, 3);
      expect_within(map, kPlane, tolerance, 16);
      EXPECT_LT(sample_map(map, kPlane, tolerance, false, 16).exact_fraction, 0.04);
    }
}

TEST(SampledMap, KinksAreBounded) {
  for (const double degrees : {0.0, 90.0, 45.0, 20.0, 77.0})
    for (const double shift : {0.0, 1.0, 4.7, 8.1, 21.0})
      for (const double tolerance : {0.5, 0.05}) {
        SCOPED_TRACE(std::to_string(degrees) + " degrees, shift " + std::to_string(shift));
        const PlaneMap map = kink(100 + shift, 90 + shift, degrees);
        const SampledMap sampled = sample_map(map, kPlane, tolerance, false, 64);
        EXPECT_LE(true_errors(sampled, map, 0).place, 1.1 * tolerance + kRounding);
        EXPECT_LT(sampled.exact_fraction, 0.2);
      }
}

// ---- flows of landmarks

MaterialFlow flow(const std::string& noise) {
  constexpr int kLandmarks = 12;
  PhaseState state{Points(2, kLandmarks), Points(2, kLandmarks)};
  for (int a = 0; a < kLandmarks; ++a) {
    const double angle = a * 2 * std::numbers::pi / kLandmarks;
    state.q.col(a) << 80 + 50 * std::cos(angle), 70 + 45 * std::sin(angle);
    state.p.col(a) << 10 * std::sin(3 * angle), 10 * std::cos(2 * angle);
  }
  const StochasticSystem system{make_kernel("gaussian:alpha=40", {}), make_noise(noise)};
  const TimeGrid grid{1, 10};
  const int channels = system.noise->channels(2, kLandmarks);
  Eigen::MatrixXd increments(channels, grid.steps);
  for (int k = 0; k < grid.steps; ++k)
    for (int c = 0; c < channels; ++c) increments(c, k) = std::sqrt(grid.dt()) * std::sin(7.0 * c + 3.1 * k);
  return {system, make_integrator("variational")->integrate(system, state, grid, increments)};
}

TEST(SampledMap, FlowsOfLandmarksAreWithinTolerance) {
  constexpr SampledPlane kSmall = {170, 150, -0.5};
  for (const std::string noise : {"none", "ch-sd:beta=5"}) {
    SCOPED_TRACE(noise);
    const MaterialFlow flow = warp::flow(noise);
    const PlaneMap map = [&](const Points& points) { return flow.end_with_gradients(points); };
    for (const double tolerance : {0.5, 0.05, 0.005}) expect_within(map, kSmall, tolerance);
    EXPECT_LT(sample_map(map, kSmall, 0.05, false).exact_fraction, 0.05);
  }
}

// ---- places without value

PlaneMap without(double inner, double outer, const PlaneMap& map) {
  return [=](const Points& points) {
    MovedPoints moved = map(points);
    for (Eigen::Index m = 0; m < points.cols(); ++m) {
      const double radius = std::hypot(points(0, m) - 140, points(1, m) - 120);
      if (radius < inner || radius > outer) continue;
      moved.places.col(m).setConstant(kNaN);
      moved.gradients.col(m).setConstant(kNaN);
    }
    return moved;
  };
}

TEST(SampledMap, PlacesWithoutValueHaveNone) {
  const SampledMap none = sample_map(without(0, 1e9, kIdentity), kPlane, 0.05, true);
  EXPECT_TRUE(
      std::all_of(none.places.begin(), none.places.end(), [](const auto& place) { return std::isnan(place[0]); }));
  EXPECT_TRUE(std::all_of(none.jacobians.begin(), none.jacobians.end(), [](float value) { return std::isnan(value); }));
  EXPECT_LT(none.exact_fraction, 0.02);
  const PlaneMap ring = without(40.3, 80.3, kWaves);
  expect_within(ring, kPlane, 0.05, 16);
  EXPECT_GT(true_errors(sample_map(ring, kPlane, 0.05, false, 16), ring, 0).without_value, 10000);
  EXPECT_LT(sample_map(ring, kPlane, 0.05, false, 16).exact_fraction, 0.4);
}

// Where gradients are missing, on a line or everywhere, places are exact.
TEST(SampledMap, PlacesMayHaveNoGradient) {
  for (const double reach : {0.0, 1000.0}) {
    const PlaneMap map = [reach](const Points& points) {
      MovedPoints moved = kWaves(points);
      for (Eigen::Index m = 0; m < points.cols(); ++m)
        if (std::abs(points(0, m) - points(1, m)) <= reach) moved.gradients.col(m).setConstant(kNaN);
      return moved;
    };
    const SampledMap sampled = sample_map(map, {65, 64, 0}, 0.05, false);
    EXPECT_LE(true_errors(sampled, kWaves, 0).place, 0.05);
    EXPECT_EQ(sampled.exact_fraction == 1, reach > 0);
  }
}

// ---- sizes, threads and input

TEST(SampledMap, EverySizeIsWithinTolerance) {
  for (const auto& [columns, rows] : {std::array{1, 1},
                                      {2, 1},
                                      {1, 2},
                                      {3, 1},
                                      {1, 3},
                                      {2, 2},
                                      {3, 3},
                                      {4, 3},
                                      {5, 2},
                                      {1, 200},
                                      {200, 1},
                                      {2, 90},
                                      {33, 33},
                                      {65, 64},
                                      {64, 65},
                                      {130, 70}})
    for (const int coarsest : {1, 2, 3, 7, 32, 64}) {
      SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows) + ", " + std::to_string(coarsest));
      expect_within(kWaves, {columns, rows, 0}, 0.05, coarsest);
    }
}

TEST(SampledMap, BandsMeet) { expect_within(kWaves, {50001, 70, 0}, 0.5, 16); }

TEST(SampledMap, IsTheSameSomeRowsAtATime) {
  const SampledPlane plane{50001, 130, -0.5};
  const SampledMap whole = sample_map(kWaves, plane, 0.5, true);
  int rows = 0, bands = 0;
  double error = 0;
  sample_map_by_rows(kWaves, plane, 0.5, true, [&](int first_row, const SampledMap& band) {
    ASSERT_EQ(first_row, rows);
    ASSERT_EQ(band.columns, plane.columns);
    ASSERT_EQ(band.places.size(), static_cast<std::size_t>(band.columns) * static_cast<std::size_t>(band.rows));
    const auto before = static_cast<std::ptrdiff_t>(rows) * plane.columns;
    EXPECT_TRUE(std::equal(band.places.begin(), band.places.end(), whole.places.begin() + before));
    EXPECT_TRUE(std::equal(band.jacobians.begin(), band.jacobians.end(), whole.jacobians.begin() + before));
    rows += band.rows;
    error = std::max(error, band.error);
    ++bands;
  });
  EXPECT_EQ(rows, plane.rows);
  EXPECT_GT(bands, 1) << "the example tests nothing";
  EXPECT_EQ(error, whole.error);
}

TEST(SampledMap, TheFinestToleranceMakesEveryNodeExact) {
  const SampledMap sampled = sample_map(kWaves, {70, 50, 0}, 1e-13, true);
  EXPECT_EQ(sampled.exact_fraction, 1);
  EXPECT_EQ(sampled.error, 0);
  EXPECT_LE(true_errors(sampled, kWaves, 0).place, 1e-5);
}

TEST(SampledMap, DoesNotDependOnTheNumberOfThreads) {
  const PlaneMap map = without(40, 60, kWaves);
  const auto at = [&](int threads) {
    set_thread_count(threads);
    SampledMap sampled = sample_map(map, kPlane, 0.01, true);
    set_thread_count(0);
    for (auto& place : sampled.places)
      for (float& coordinate : place) coordinate = std::isnan(coordinate) ? -1 : coordinate;
    for (float& jacobian : sampled.jacobians) jacobian = std::isnan(jacobian) ? -1 : jacobian;
    return sampled;
  };
  const SampledMap one = at(1);
  for (const int threads : {2, 3, 7}) {
    const SampledMap several = at(threads);
    EXPECT_EQ(several.places, one.places);
    EXPECT_EQ(several.jacobians, one.jacobians);
    EXPECT_EQ(several.error, one.error);
    EXPECT_EQ(several.exact_fraction, one.exact_fraction);
  }
}

TEST(SampledMap, RefusesWrongInput) {
  const auto error = [](const SampledPlane& plane, double tolerance, int coarsest = 64) {
    return error_of([&] { sample_map(kIdentity, plane, tolerance, false, coarsest); });
  };
  EXPECT_EQ(error({0, 5, 0}, 0.1), "plane of 0 x 5 nodes: sizes must be positive");
  EXPECT_EQ(error({5, -1, 0}, 0.1), "plane of 5 x -1 nodes: sizes must be positive");
  EXPECT_NE(error({1 << 20, 1 << 20, 0}, 0.1).find("at most 2147483648"), std::string::npos);
  for (const double tolerance : {0.0, -1.0, kNaN, kInfinity})
    EXPECT_NE(error({5, 5, 0}, tolerance).find("must be positive and finite"), std::string::npos) << tolerance;
  EXPECT_NE(error({5, 5, 0}, 0.1, 0).find("coarsest"), std::string::npos);
  const PlaneMap without_gradients = [](const Points& points) { return MovedPoints{points, Eigen::MatrixXd()}; };
  EXPECT_NE(error_of([&] {
              sample_map(without_gradients, {5, 5, 0}, 0.1, false);
            }).find("4 entries of the gradient"),
            std::string::npos);
}

}  // namespace
}  // namespace pulson::warp
