// The vector code of paths against the integrator.

#include "posterior/lane_shots.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "forced_target.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random_numbers.hpp"

namespace pulson::posterior {

using compare::cohort_settings;
using compare::CohortSettings;
using compare::fit_cohort;
using compare::named_shape;
using compare::oval;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RandomNumbers = pulson::Numbers;

matching::MatchingProblem problem_of(const Points& source, const std::string& noise, const std::string& kernel,
                                     const std::string& integrator = "variational-2") {
  return {{make_kernel(kernel, source), make_noise(noise, named_shape(source))},
          make_integrator(integrator),
          {1, 4},
          source,
          std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{source, 0.1, {}, {}}),
          0.1,
          20,
          {}};
}

class OfPaths : public testing::TestWithParam<std::tuple<int, std::string, std::string, std::string>> {};
INSTANTIATE_TEST_SUITE_P(All, OfPaths,
                         testing::Combine(testing::Values(1, 2, 3),
                                          testing::Values("none", "ch-sd:beta=0.05", "trouve-vialard:sigma=0.2",
                                                          "p-sd:beta=0.05", "p-sd:fields=grid,count=2,beta=0.1"),
                                          testing::Values("gaussian:alpha=0.5", "peakon:alpha=0.8",
                                                          "matern32:alpha=0.5+matern52:alpha=0.3,weight=0.5"),
                                          testing::Values("variational-2", "heun")),
                         [](const auto& row) { return "Case" + std::to_string(row.index); });

Numbers numbers_of(const matching::MatchingProblem& problem) {
  return {std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise, problem.lambda, 1};
}

// Ends, derivatives and their products with those of another point, to round-off.
TEST_P(OfPaths, AreThoseOfTheIntegrator) {
  const auto& [dimension, noise, kernel, integrator] = GetParam();
  RandomNumbers numbers(5);
  const Points source = numbers.landmarks(dimension, 5);
  const Specimen specimen(problem_of(source, noise, kernel, integrator));
  const Specimen::Model model = specimen.model(numbers_of(specimen.problem()));
  if (LaneShots::lanes() < 2) GTEST_SKIP() << "no vector of two numbers";
  ASSERT_TRUE(LaneShots::knows(specimen, model));
  const VectorXd about = 0.2 * numbers(specimen.unknowns(), 1);
  const LinearModel linear(specimen, model, specimen.shoot(model, about).value(), about);
  const LinearAt chord(linear, model);
  const MatrixXd z = 0.5 * numbers(specimen.unknowns(), LaneShots::lanes());
  const LaneShots lanes(specimen, model, &chord);
  const auto with_products = lanes.shoot(z, LaneShots::With::kProducts);
  const auto with_slopes = lanes.shoot(z, LaneShots::With::kSlopes);
  int found = 0;
  for (Index l = 0; l < z.cols(); ++l) {
    const auto lane = static_cast<std::size_t>(l);
    const auto at = specimen.shoot(model, z.col(l));
    ASSERT_EQ(at.has_value(), with_products.found[lane] != 0);
    if (!at) continue;
    ++found;
    const VectorXd end = at->paths.front().final().q.reshaped();
    EXPECT_LE((with_products.ends.col(l) - end).norm(), 1e-12 * (1 + end.norm()));
    const Points& middle = at->paths.front().states[2].q;
    EXPECT_LE((with_slopes.middles.col(l) - middle.reshaped()).norm(), 1e-12 * (1 + middle.norm()));
    const Specimen::Slopes slopes = specimen.slopes(model, *at);
    EXPECT_LE((with_slopes.slopes[lane].momenta - slopes.momenta).norm(), 1e-11 * slopes.momenta.norm());
    const MatrixXd& of_noise = slopes.branches.front().end;
    EXPECT_LE((with_slopes.slopes[lane].branches.front().end - of_noise).norm(), 1e-11 * of_noise.norm());
    const MatrixXd product = chord.product(slopes, model);
    EXPECT_LE((with_products.products[lane] - product).norm(), 1e-11 * product.norm());
  }
  EXPECT_GT(found, 0);
}

// Fewer than there are lanes, and some without a path.
TEST(LaneShots, LeaveOutThoseWithoutAPath) {
  const Points source = Eigen::RowVector3d(0, 0.4, 1);
  const Specimen specimen(problem_of(source, "none", "gaussian:alpha=0.5"));
  const Specimen::Model model = specimen.model(numbers_of(specimen.problem()));
  if (LaneShots::lanes() < 2) GTEST_SKIP() << "no vector of two numbers";
  MatrixXd z = MatrixXd::Zero(specimen.unknowns(), 2);
  z.col(1).setConstant(1e4);
  const auto shots = LaneShots(specimen, model, nullptr).shoot(z, LaneShots::With::kNothing);
  EXPECT_TRUE(shots.found[0]);
  EXPECT_FALSE(shots.found[1]);
  EXPECT_FALSE(specimen.shoot(model, z.col(1)).has_value());
  EXPECT_LE((shots.ends.col(0) - source.reshaped()).norm(), 1e-15);
}

TEST(LaneShots, DoNotKnowOtherNoiseNorManyLandmarks) {
  RandomNumbers numbers(5);
  const auto is_known = [&](int landmarks, const std::string& noise) {
    const Specimen specimen(problem_of(numbers.landmarks(2, landmarks), noise, "gaussian:alpha=0.5"));
    return LaneShots::knows(specimen, specimen.model(numbers_of(specimen.problem())));
  };
  EXPECT_FALSE(is_known(5, "ch-sd-screened:beta=0.1,gamma=1"));
  EXPECT_FALSE(is_known(5, "langevin:sigma=0.1,friction=0.1"));
  EXPECT_FALSE(is_known(60, "none"));
}

// Fewer lanes than there are draws in a set, too.
TEST(LaneShots, GiveTheSameEvidenceOfSamplesWithAllVectorTargets) {
  const Landmarks source = oval(8);
  Points off(2, 8);
  for (Index i = 0; i < off.size(); ++i) off.reshaped()[i] = 0.2 * std::sin(3.0 * static_cast<double>(i));
  const Landmarks target = named_shape(source.points + off);
  CohortSettings settings = cohort_settings();
  settings.lambda = 10;
  settings.sampling_error = 0;
  settings.importance_samples = 16;
  const double evidence = fit_cohort({source, {target}}, "ch-sd:beta=0.05", settings).shapes.front().log_evidence;
  for (const std::int64_t vector : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(vector);
    EXPECT_NEAR(fit_cohort({source, {target}}, "ch-sd:beta=0.05", settings).shapes.front().log_evidence, evidence, 1e-3)
        << hwy::TargetName(vector);
  }
}

}  // namespace
}  // namespace pulson::posterior
