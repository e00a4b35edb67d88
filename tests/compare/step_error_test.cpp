// What steps change of the evidence, beside fits with eight times as many, and beside the posterior's own chains.

#include "compare/step_error.hpp"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::compare {
namespace {

constexpr double kBent = 8;  // λ of shapes that move by a third of their size

// By default those whose error is larger than heun's, and than the draws'.
CohortSettings bent_settings(int steps, const std::string& integrator = "variational-2") {
  CohortSettings settings = cohort_settings();
  settings.lambda = kBent;
  settings.grid.steps = steps;
  settings.integrator = integrator;
  return settings;
}

Cohort bent_cohort(const std::string& noise, int shapes) {
  return drawn_cohort(oval(6), noise, kBent, bent_settings(40), shapes, 5);
}

CohortFit corrected(const Cohort& cohort, const NoiseChoice& noise, const CohortSettings& settings) {
  CohortFit fit = fit_cohort(cohort, noise, settings);
  correct_for_steps(change_of_finer_steps(cohort, noise, settings, fit), settings, fit);
  return fit;
}

class StepsOf : public testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(StepsOf, CorrectedEvidencesAreThoseOfEightTimesAsMany) {
  const auto& [noise, integrator] = GetParam();
  const Cohort cohort = bent_cohort(noise, 6);
  const CohortFit few = corrected(cohort, noise, bent_settings(5, integrator));
  const CohortFit many = fit_cohort(cohort, noise, bent_settings(40, integrator));
  EXPECT_LT(std::abs(few.log_evidence - many.log_evidence), 0.5 * std::abs(few.step_error.value));
  EXPECT_NEAR(few.log_evidence, many.log_evidence, 0.02);
  EXPECT_DOUBLE_EQ(few.log_evidence, few.laplace);
}

INSTANTIATE_TEST_SUITE_P(Models, StepsOf,
                         testing::Combine(testing::Values("none", "ch-sd:beta=0.1", "p-sd:fields=grid,count=2,beta=0.2",
                                                          "trouve-vialard:sigma=0.3"),
                                          testing::Values("variational-2", "heun")),
                         [](const auto& row) { return "Model" + std::to_string(row.index); });

// The samples have the same Brownian paths with more steps.
TEST(StepsOfSamples, ChangeTheEvidenceByMoreThanTheirError) {
  const std::string noise = "trouve-vialard:sigma=0.3";
  const Cohort cohort = bent_cohort(noise, 6);
  CohortSettings settings = bent_settings(5);
  settings.importance_samples = 50;
  const CohortFit fit = fit_cohort(cohort, noise, settings);
  const StepChange same = change_of_finer_steps(cohort, noise, settings, fit, 0);
  EXPECT_NEAR(same.total.value, 0, 1e-3);
  const StepChange twice = change_of_finer_steps(cohort, noise, settings, fit);
  const StepChange eight = change_of_finer_steps(cohort, noise, settings, fit, 3);
  EXPECT_NEAR(4 * twice.total.value / 3, eight.total.value, 0.03);
  EXPECT_GT(std::abs(eight.total.value), 2 * eight.total.standard_error);
  EXPECT_LT(eight.total.standard_error, fit.sampling_error);
}

// By Heun's steps and Markov chains, with the same numbers; of very few steps most of the error is taken away.
TEST(StepsOfSamples, HaveTheLimitOfThePosteriorsIntegrator) {
  const std::string noise = "trouve-vialard:sigma=0.3";
  const Cohort cohort = bent_cohort(noise, 1);
  const auto fit_in = [&](int steps) {
    CohortSettings settings = bent_settings(steps);
    settings.sigma = 0.02;
    settings.importance_samples = 2000;
    settings.sampling_error = 0.01;
    return std::pair{corrected(cohort, noise, settings), settings};
  };
  const auto [fit, settings] = fit_in(5);
  inference::PosteriorProblem problem;
  problem.specimens.push_back(shape_problem(cohort, fit, settings, 0));
  problem.specimens.front().integrator = make_integrator("heun");
  problem.specimens.front().grid.steps = 40;
  inference::SamplerOptions options;
  options.draws = 500;
  options.paths_kept = 0;
  const Estimate chains = sample_posterior(problem, options).log_evidence;
  const double error = std::hypot(chains.standard_error, std::hypot(fit.sampling_error, fit.step_error.standard_error));
  EXPECT_LT(error, 0.05);
  EXPECT_NEAR(fit.log_evidence, chains.value, 4 * error);
  const CohortFit few = fit_in(3).first;
  const double before = std::abs(few.log_evidence - few.step_error.value - chains.value);
  EXPECT_GT(before, 8 * error);
  EXPECT_LT(std::abs(few.log_evidence - chains.value), before / 2);
}

TEST(StepsOfAComparison, AreTooFewWhereTheVerdictMayBeTheirs) {
  Comparison comparison;
  comparison.cohort = bent_cohort("none", 4);
  comparison.settings = bent_settings(5);
  comparison.models.resize(2);
  const auto wanted = [&](double difference, double step_error) {
    comparison.models[1].difference = {difference, 0.1};
    comparison.models[1].fit.step_error.value = step_error;
    return comparison.steps_wanted();
  };
  EXPECT_EQ(wanted(-1, 0.1), std::nullopt);
  EXPECT_EQ(wanted(-1, -1.9), std::nullopt);
  EXPECT_EQ(wanted(-1, -2.1), 10);   // it may be the best
  EXPECT_EQ(wanted(-2.9, 0.3), 10);  // and here behind
  EXPECT_EQ(wanted(-3.1, -1), 20);   // or not
  EXPECT_EQ(wanted(-3.1, 100), 40);
  EXPECT_EQ(wanted(-9, 2), std::nullopt);
  EXPECT_EQ(wanted(-9, std::nan("")), 10);
}

}  // namespace
}  // namespace pulson::compare
