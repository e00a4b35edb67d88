// Where fits begin, and the table of defaults.

#include "matching/starting_values.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "matching/defaults.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::matching {
namespace {

constexpr int kLandmarks = 60;
constexpr double kMoved = 0.3;  // root mean square of a coordinate
constexpr double kTime = 2;

// Landmarks on a circle, and the same moved by ±kMoved in each coordinate.
Landmarks ring(double moved) {
  Landmarks shape;
  shape.points.resize(2, kLandmarks);
  for (int a = 0; a < kLandmarks; ++a) {
    const double t = 2 * std::acos(-1.0) * a / kLandmarks;
    shape.points.col(a) << 10 * std::cos(t) + (a % 2 == 0 ? moved : -moved),
        10 * std::sin(t) + (a % 3 == 0 ? moved : -moved);
  }
  return shape;
}

RegistrationOptions options_of_ring() {
  RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.align = AlignmentKind::kNone;
  options.sigma = 1e-3;
  options.grid = {kTime, 10};
  return options;
}

Eigen::VectorXd starts_of(const std::string& noise) {
  const std::string spec =
      with_starting_values(OpenSpec::parse(noise, "noise"), ring(0), {ring(kMoved)}, options_of_ring());
  return make_noise(spec, ring(0))->parameters();
}

// In the mean over 16 draws and the 120 coordinates, each with the variance of a χ², to five standard errors.
const double kTolerance = 5 * std::sqrt(2.0 / (16 * 2 * kLandmarks)) / 2;

// Var q(T) = β²T, half of what is observed.
TEST(StartingValues, ExplainTheShareOfEachAmplitude) {
  const double right = kMoved / std::sqrt(2 * kTime);
  EXPECT_NEAR(starts_of("ch-sd:beta=fit")[0] / right, 1, kTolerance);
  EXPECT_NEAR(starts_of("p-sd:beta=fit")[0] / right, 1, 5 * std::sqrt(2.0 / (16 * 2)) / 2);  // two channels
  // A third each of what is observed, and the half of the landmarks has it all.
  const Eigen::VectorXd two = starts_of("ch-sd:beta=fit+ch-sd:beta=fit,on=1/2/3/4/5/6");
  EXPECT_NEAR(two[0] / (kMoved / std::sqrt(3 * kTime)), 1, kTolerance);
  EXPECT_NEAR(two[1] / (kMoved / std::sqrt(3 * kTime / 10)), 1, std::sqrt(10) * kTolerance);
}

// dp = σ dW, dq = K p dt with K about the identity for landmarks so far apart: Var q(T) = σ²T³/3.
TEST(StartingValues, GoThroughTheMomenta) {
  RegistrationOptions options = options_of_ring();
  options.kernel = "gaussian:alpha=0.1";
  options.grid.steps = 100;
  const std::string spec =
      with_starting_values(OpenSpec::parse("trouve-vialard:sigma=fit", "noise"), ring(0), {ring(kMoved)}, options);
  const double right = kMoved / std::sqrt(2 * std::pow(kTime, 3) / 3);
  EXPECT_NEAR(make_noise(spec, ring(0))->parameters()[0] / right, 1, kTolerance + 0.01);  // and of the time step
}

TEST(StartingValues, StayWhereTheyAreGiven) {
  EXPECT_EQ(starts_of("ch-sd:beta=0.7:fit")[0], 0.7);
  const Eigen::VectorXd screened = starts_of("ch-sd-screened:beta=2:fit,gamma=fit");
  EXPECT_EQ(screened[0], 2);
  EXPECT_EQ(screened[1], 1);                                                  // alpha²
  EXPECT_THROW(starts_of("ch-sd-screened:beta=fit,gamma=1e-9"), InputError);  // which moves nothing
}

TEST(Defaults, AreThoseOfTheLibraryWhereItHasThem) {
  const RegistrationOptions options;
  const TaskDefaults& row = register_defaults();
  EXPECT_EQ(options.kernel.spec(), row.kernel.value);
  EXPECT_EQ(options.sigma.text(), row.sigma.value);
  EXPECT_EQ(options.integrator, row.integrator.value);
  EXPECT_EQ(std::to_string(options.grid.steps), row.steps.value);
  EXPECT_FALSE(options.lambda || options.align);  // auto
}

TEST(Defaults, GiveAReasonWhereATaskDiffers) {
  for (const TaskDefaults& task : default_table())
    for (const DefaultColumn& column : default_columns()) {
      const Default &usual = register_defaults().*column.setting, &here = task.*column.setting;
      EXPECT_TRUE(here.value == usual.value || here.value.empty() || !here.reason.empty())
          << task.task << ' ' << column.name;
    }
}

}  // namespace
}  // namespace pulson::matching
