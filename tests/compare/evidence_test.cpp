// The evidence of a shape under a complete model: against closed forms and the integral itself.

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "combinations.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of N(0, v) in each coordinate.
double log_normal_density(const VectorXd& x, double v) {
  return -0.5 * x.squaredNorm() / v - 0.5 * static_cast<double>(x.size()) * std::log(2 * std::numbers::pi * v);
}

CohortSettings complete_settings(double sigma, double lambda, int steps) {
  CohortSettings settings;
  settings.kernel = "gaussian:alpha=1";
  settings.grid = {1, steps};
  settings.sigma = sigma;
  settings.lambda = lambda;
  settings.integrator = "variational";
  settings.importance_samples = 0;
  settings.sampling_error = 0;
  return settings;
}

class OfMatching : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, OfMatching,
                         testing::Values("none", "ch-sd:beta=0.3", "p-sd:beta=0.2,fields=cos", "trouve-vialard:sigma=1",
                                         "ch-sd-screened:beta=0.2,gamma=1"),
                         [](const auto& row) { return "Model" + std::to_string(row.index); });

TEST_P(OfMatching, IsTheOneAtTheMinimum) {
  Numbers numbers(3);
  const Landmarks source = named_shape(numbers.landmarks(2, 4));
  Landmarks target = named_shape(source.points + 0.2 * numbers(2, 4));
  target.points(1, 2) = std::numeric_limits<double>::quiet_NaN();
  const Cohort cohort{source, {target, named_shape(source.points + 0.2 * numbers(2, 4))}};
  const CohortSettings settings = complete_settings(0.05, 10, 4);
  const CohortFit fit = fit_cohort(cohort, GetParam(), settings);
  EXPECT_TRUE(fit.fitted.empty());
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.score(), fit.log_evidence);
  double sum = 0;
  for (int s = 0; s < 2; ++s) {
    const matching::MatchingObjective objective(shape_problem(cohort, fit, settings, s));
    matching::MinimiseOptions options;
    options.gradient_tolerance = 1e-7;
    const matching::MinimiseSummary minimum = minimise(objective, options);
    const ShapeFit& shape = fit.shapes[static_cast<std::size_t>(s)];
    EXPECT_NEAR(shape.log_evidence, log_evidence(objective, minimum.solution), 2e-3);  // a search ends at 1e-3
    EXPECT_NEAR(shape.cost.total(), minimum.solution.cost.total(), 1e-3);
    EXPECT_EQ(shape.coordinates, s == 0 ? 7 : 8);
    sum += shape.log_evidence;
  }
  EXPECT_DOUBLE_EQ(fit.log_evidence, sum);
}

// As λ grows, one direction of the momenta after another becomes too faint for the data to show.
TEST(Evidence, HasNoJumpsWhereDirectionsFade) {
  const Landmarks source = oval(24);
  CohortSettings settings = cohort_settings();
  settings.grid.steps = 10;  // five are too few for momenta as rough: 1.3 nats
  settings.kernel = "gaussian:alpha=1";
  const Cohort cohort = drawn_cohort(source, "none", 40, settings, 6, 5);
  std::vector<double> evidence;
  for (int i = 0; i < 60; ++i) {
    settings.lambda = 40 * std::exp(0.02 * i);
    evidence.push_back(fit_cohort(cohort, "none", settings).log_evidence);
  }
  for (std::size_t i = 3; i < evidence.size(); ++i)
    EXPECT_NEAR(evidence[i] - 3 * (evidence[i - 1] - evidence[i - 2]) - evidence[i - 3], 0, 0.006) << "place " << i;
}

// Momenta that do nothing, λ → ∞: y − q0 ~ N(0, σ² + β²c) with c = Δt (K − 3/4), as w_k = ½(ΔW_{k−1} + ΔW_k).
struct LinearModel {
  static constexpr double kSigma = 0.1, kBeta = 0.3;
  static constexpr int kSteps = 4;
  double variance = kSigma * kSigma + kBeta * kBeta * (kSteps - 0.75) / kSteps;
  Landmarks source = oval(4);
  Numbers numbers{7};
  CohortSettings settings = complete_settings(kSigma, 1e14, kSteps);

  CohortFit fit(const Cohort& cohort) const { return fit_cohort(cohort, "ch-sd:beta=0.3", settings); }
};

TEST(Evidence, OfALinearModelIsTheClosedForm) {
  LinearModel linear;
  const MatrixXd change = 0.4 * linear.numbers(2, 4);
  Landmarks target = named_shape(linear.source.points + change);
  const Cohort whole{linear.source, {target}};
  EXPECT_NEAR(linear.fit(whole).log_evidence, log_normal_density(change.reshaped(), linear.variance), 1e-6);
  target.points(0, 0) = std::numeric_limits<double>::quiet_NaN();
  const CohortFit partial = linear.fit({linear.source, {target}});
  EXPECT_EQ(partial.coordinates, 7);
  EXPECT_NEAR(partial.log_evidence, log_normal_density(change.reshaped().tail(7), linear.variance), 1e-6);
  linear.settings.importance_samples = 50;  // every weight is the same
  const ShapeFit sampled = linear.fit(whole).shapes.front();
  EXPECT_NEAR(sampled.log_evidence, sampled.laplace, 1e-6);
  EXPECT_NEAR(sampled.effective_samples, sampled.samples, 1e-4);
}

// What a translation takes out is no datum: N d − d coordinates are left, of the same variance.
TEST(Evidence, OfALinearModelWithTranslationIsThatOfTheCoordinatesLeft) {
  LinearModel linear;
  const MatrixXd change = 0.4 * linear.numbers(2, 4);
  const Cohort cohort =
      make_cohort(linear.source, {named_shape(linear.source.points + change)}, AlignmentKind::kTranslation);
  const CohortFit fit = linear.fit(cohort);
  EXPECT_EQ(fit.coordinates, 6);
  const MatrixXd centred = change.colwise() - change.rowwise().mean();
  const double expected =
      log_normal_density(centred.reshaped(), linear.variance) - log_normal_density(VectorXd::Zero(2), linear.variance);
  EXPECT_NEAR(fit.log_evidence, expected, 1e-6);
}

// The same of a rigid motion, whose directions are motion_directions().
TEST(Evidence, OfALinearModelWithRigidMotionsLeavesThoseOut) {
  LinearModel linear;
  const MatrixXd change = 1e-4 * linear.numbers(2, 4);  // so that a rigid motion is its directions
  const Cohort cohort{linear.source, {named_shape(linear.source.points + change)}, AlignmentKind::kRigid};
  std::vector<Index> all(8);
  for (Index i = 0; i < 8; ++i) all[static_cast<std::size_t>(i)] = i;
  const MatrixXd out = motion_directions(linear.source.points, AlignmentKind::kRigid, all);
  const VectorXd left = change.reshaped() - out * (out.transpose() * change.reshaped());
  const double expected =
      log_normal_density(left, linear.variance) - log_normal_density(VectorXd::Zero(3), linear.variance);
  EXPECT_NEAR(linear.fit(cohort).log_evidence, expected, 1e-6);
}

struct Estimated {
  double log_evidence = 0;
  double error = 0;  // standard, of that
};

// Mean of N(y; q(T), σ²) over momenta and increments drawn from the prior, here by the kernel's own factor.
std::vector<Estimated> by_monte_carlo(const std::string& noise, const Points& q0, const Points& y, double lambda,
                                      const TimeGrid& grid, const std::vector<double>& sigmas) {
  constexpr int kDraws = 60000;
  const StochasticSystem system{make_kernel("gaussian:alpha=1", q0), make_noise(noise, named_shape(q0))};
  const auto integrator = make_integrator("variational");
  const int channels = system.noise->channels(1, 2);
  const MatrixXd normals = standard_normals(12, 0, kDraws, 2 + channels * grid.steps);
  const MatrixXd root = (lambda * system.kernel.gram(q0, q0)).llt().matrixU();
  MatrixXd densities = MatrixXd::Zero(kDraws, std::ssize(sigmas));
  for (int i = 0; i < kDraws; ++i) {
    const Points p0 = root.triangularView<Eigen::Upper>().solve(normals.row(i).head(2).transpose()).transpose();
    const MatrixXd increments =
        std::sqrt(grid.dt()) * normals.row(i).tail(channels * grid.steps).reshaped(channels, grid.steps);
    try {
      const Points end = integrator->integrate(system, {q0, p0}, grid, increments).final().q;
      for (Index s = 0; s < densities.cols(); ++s)
        densities(i, s) =
            std::exp(log_normal_density((end - y).reshaped(), std::pow(sigmas[static_cast<std::size_t>(s)], 2)));
    } catch (const StepError&) {
      // no path: no density
    }
  }
  std::vector<Estimated> found;
  for (const auto& column : densities.colwise()) {
    const double mean = column.mean();
    const double square = (column.array() - mean).square().mean();
    found.push_back({std::log(mean), std::sqrt(square / kDraws) / mean});
  }
  return found;
}

struct Integrated {
  std::string name, noise;
};
class OfTheIntegral : public testing::TestWithParam<Integrated> {};
INSTANTIATE_TEST_SUITE_P(All, OfTheIntegral,
                         testing::Values(Integrated{"none", "none"}, Integrated{"chsd", "ch-sd:beta=0.2"},
                                         Integrated{"psd", "p-sd:beta=0.2,fields=cos,wavenumber=1"},
                                         Integrated{"trouvevialard", "trouve-vialard:sigma=0.6"}),
                         [](const auto& row) { return row.param.name; });

// Two landmarks on a line; displacements of about 0.3 with errors of a tenth and a third of that.
TEST_P(OfTheIntegral, LaplaceIsNearAndImportanceSamplingWithinItsErrors) {
  const Points q0 = Eigen::RowVector2d(0, 1);
  const Points y = Eigen::RowVector2d(0.3, 1.1);
  constexpr double kLambda = 8;
  const std::vector<double> sigmas = {0.03, 0.1};
  const std::vector<Estimated> truth = by_monte_carlo(GetParam().noise, q0, y, kLambda, {1, 2}, sigmas);
  for (std::size_t i = 0; i < sigmas.size(); ++i) {
    CohortSettings settings = complete_settings(sigmas[i], kLambda, 2);
    settings.importance_samples = 2000;
    const CohortFit fit = fit_cohort({named_shape(q0), {named_shape(y)}}, GetParam().noise, settings);
    const ShapeFit& shape = fit.shapes.front();
    EXPECT_LE(truth[i].error, 0.05);  // the Monte Carlo mean says something
    EXPECT_NEAR(shape.log_evidence, truth[i].log_evidence, 3 * std::hypot(std::sqrt(shape.variance), truth[i].error));
    // The next term of Laplace's series: a tenth of a nat where displacements are a third of the kernel's range.
    EXPECT_NEAR(shape.laplace, truth[i].log_evidence, 0.1 + 3 * truth[i].error);
    EXPECT_GT(shape.effective_samples, 0.5 * shape.samples);
  }
}

// The noise a tenth of σ, as large as the displacement, and three times that, where the posterior is bent.
TEST(Evidence, OfSmallAndLargeNoiseIsTheIntegralWithinItsError) {
  const Points q0 = Eigen::RowVector2d(0, 1);
  const Points y = Eigen::RowVector2d(0.3, 1.1);
  for (const char* noise :
       {"ch-sd:beta=0.01", "ch-sd:beta=0.3", "ch-sd:beta=1", "p-sd:beta=0.02,fields=cos,wavenumber=1",
        "p-sd:beta=0.8,fields=cos,wavenumber=1", "trouve-vialard:sigma=1.2"}) {
    const Estimated truth = by_monte_carlo(noise, q0, y, 8, {1, 2}, {0.1}).front();
    CohortSettings settings = complete_settings(0.1, 8, 2);
    settings.importance_samples = 1000;
    const ShapeFit shape = fit_cohort({named_shape(q0), {named_shape(y)}}, noise, settings).shapes.front();
    EXPECT_LE(truth.error, 0.03) << noise;
    EXPECT_LE(std::sqrt(shape.variance), 0.03) << noise;
    EXPECT_NEAR(shape.log_evidence, truth.log_evidence, 3 * std::hypot(std::sqrt(shape.variance), truth.error))
        << noise << ", Laplace " << shape.laplace << ", effective " << shape.effective_samples;
  }
}

// The posterior has parts to which no draw about the match comes: without them the evidence would be 0.2 nats too low.
TEST(Evidence, CountsPartsFarFromTheMatch) {
  const Points q0 = Eigen::RowVector2d(0, 1);
  const Points y = Eigen::RowVector2d(0.3, 1.1);
  const char* noise = "trouve-vialard:sigma=3";
  const Estimated truth = by_monte_carlo(noise, q0, y, 8, {1, 2}, {0.1}).front();
  CohortSettings settings = complete_settings(0.1, 8, 2);
  settings.importance_samples = 4000;
  const ShapeFit shape = fit_cohort({named_shape(q0), {named_shape(y)}}, noise, settings).shapes.front();
  EXPECT_LE(std::sqrt(shape.variance), 0.05);
  EXPECT_GT(shape.distant, 0.05);
  EXPECT_NEAR(shape.log_evidence, truth.log_evidence, 3 * std::hypot(std::sqrt(shape.variance), truth.error))
      << "Laplace " << shape.laplace << ", distant " << shape.distant << ", lost " << shape.lost_samples
      << ", effective " << shape.effective_samples;
}

// Displacements of 0.15 of each landmark by itself.
Landmarks far_from(const Landmarks& source) {
  Numbers numbers(11);
  return named_shape(source.points + 0.15 * numbers(source.points.rows(), source.points.cols()));
}

// Displacements by the noise of ten times σ, where the posterior is thin and bent: draws from a normal distribution
// miss it, 1 of 40 being effective.
TEST(Evidence, IsSampledWhereTheNoiseIsMuchGreaterThanSigma) {
  const Landmarks source = oval(8);
  const Landmarks target = far_from(source);
  CohortSettings settings = complete_settings(0.01, 10, 10);
  settings.importance_samples = 40;
  const ShapeFit shape = fit_cohort({source, {target}}, "ch-sd:beta=0.1", settings).shapes.front();
  EXPECT_EQ(shape.lost_samples, 0);
  EXPECT_GT(shape.effective_samples, 25);
  EXPECT_NEAR(shape.log_evidence, shape.laplace, 1);
}

// By a few samples, whose errors depend on β as the evidence does: else they would have a slope at 0, and the evidence
// a maximum beside it.
TEST(Evidence, BySamplesIsEvenInTheAmplitudeAsItIs) {
  const Landmarks source = oval(8);
  const Landmarks target = far_from(source);
  CohortSettings settings = complete_settings(0.01, 10, 5);
  settings.importance_samples = 16;
  const auto sampled_excess = [&](const std::string& noise) {
    const ShapeFit shape = fit_cohort({source, {target}}, noise, settings).shapes.front();
    return shape.log_evidence - shape.laplace;
  };
  const double without = sampled_excess("none");
  const double small = sampled_excess("ch-sd:beta=0.001") - without;
  const double twice = sampled_excess("ch-sd:beta=0.002") - without;
  EXPECT_GT(std::abs(small), 1e-5);
  EXPECT_NEAR(twice / small, 4, 0.1);
}

}  // namespace
}  // namespace pulson::compare
