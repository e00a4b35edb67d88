#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {
namespace {

Landmarks ring(int count) {
  Landmarks shape;
  shape.points.resize(2, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    shape.points.col(a) << std::cos(angle), std::sin(angle);
  }
  return shape;
}

CalibrationOptions short_study() {
  CalibrationOptions calibration;
  calibration.sampler.method = "pcn";
  calibration.sampler.warmup = 100;
  calibration.sampler.draws = 310;
  calibration.sampler.searches = 1;
  calibration.simulations = 150;
  calibration.ranks = 31;
  return calibration;
}

Calibration calibration_of(const std::string& fault, double factor) {
  matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.noise = "ch-sd:beta=0.1";
  options.sigma = 0.02;
  options.lambda = 1000;  // paths are nearly linear in what moves them, and short chains mix
  options.align = AlignmentKind::kNone;
  options.grid = {1, 4};
  const PosteriorProblem problem = make_posterior_problem(ring(8), {ring(8)}, options, {"beta=0.3"});
  CalibrationOptions calibration = short_study();
  calibration.fault_name = fault;
  calibration.fault_factor = factor;
  return calibrate(problem, calibration);
}

TEST(Calibration, RanksStayWithinTheirBand) {
  const Calibration calibration = calibration_of("", 1);
  EXPECT_EQ(calibration.failed, 0);
  ASSERT_EQ(calibration.quantities.size(), 4U);
  // Four bands of 95 %: each p-value is below 0.001 with probability 0.001.
  for (const CalibratedQuantity& quantity : calibration.quantities)
    EXPECT_GT(quantity.deviation, 0.001) << quantity.name;
}

TEST(Calibration, CatchesAnAmplitudeThatIsOffByAFifth) {
  const Calibration calibration = calibration_of("beta", 1.2);
  EXPECT_EQ(calibration.quantities.front().name, "beta");
  EXPECT_FALSE(calibration.quantities.front().inside_band);
  EXPECT_LT(calibration.quantities.front().deviation, 0.001);
}

// Noise whose fields move with the landmarks, along ((a,b)x,c).
TEST(Calibration, RanksOfATreeStayWithinTheirBand) {
  matching::RegistrationOptions options;
  options.noise = "kunita:beta=0.1,width=0.8";
  options.sigma = 0.1;
  options.grid = {1, 4};
  std::vector<Landmarks> leaves(3, ring(3));
  for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i].name = "abc"[i];
  const std::vector<TreeNode> tree = {{"", -1, 0}, {"x", 0, 1}, {"a", 1, 1}, {"b", 1, 1}, {"c", 0, 2}};
  const PosteriorProblem problem =
      make_tree_problem(ring(3), tree, leaves, options, {"beta=0.3", "width=0.3", "data-sigma=0.2"});
  const Calibration calibration = calibrate(problem, short_study());
  ASSERT_EQ(calibration.quantities.size(), 6U);
  EXPECT_EQ(calibration.quantities[3].name, "node");
  for (const CalibratedQuantity& quantity : calibration.quantities)
    EXPECT_GT(quantity.deviation, 0.001) << quantity.name;
}

}  // namespace
}  // namespace pulson::inference
