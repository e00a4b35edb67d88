// Shapes about their own mean: the restricted likelihood.

#include "own_mean.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "combinations.hpp"
#include "matching/displacement_likelihood.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::Specimen;

double log_determinant(const MatrixXd& matrix) {
  return 2 * Eigen::LLT<MatrixXd>(matrix).matrixLLT().diagonal().array().log().sum();
}

// Shapes whose displacements of an oval are so small that the end is linear in the momenta.
constexpr double kSmall = 1e-4;
std::vector<Landmarks> small_changes(int count, int landmarks) {
  Numbers numbers(7);
  std::vector<Landmarks> shapes(static_cast<std::size_t>(count), oval(landmarks));
  for (Landmarks& shape : shapes) shape.points += kSmall * numbers(2, landmarks);
  return shapes;
}

CohortSettings small_settings(double lambda) {
  CohortSettings settings = cohort_settings();
  settings.sigma = 0.3 * kSmall;
  settings.lambda = lambda;
  return settings;
}

// As `atlas` and `register` compute it.
TEST(OwnMean, GivesTheRestrictedLikelihoodOfSmallDisplacements) {
  constexpr int kCount = 5;
  const CohortShapes shapes{std::nullopt, small_changes(kCount, 8), AlignmentKind::kSimilarity};
  const Cohort cohort = shapes.cohort();
  EXPECT_TRUE(cohort.about_own_mean);
  const Points& mean = cohort.source.points;
  std::vector<Index> all;
  for (Index i = 0; i < mean.size(); ++i) all.push_back(i);
  matching::DisplacementDraws draws{mean, MatrixXd(mean.size(), kCount), motion_directions(mean, cohort.alignment, all),
                                    kCount - 1};
  for (int s = 0; s < kCount; ++s)
    draws.columns.col(s) = (cohort.targets[static_cast<std::size_t>(s)].points - mean).reshaped();
  const matching::DisplacementLikelihood likelihood(make_kernel("gaussian:alpha=0.5"), draws);
  const auto expected = [&](double lambda) { return likelihood(lambda * std::pow(0.3 * kSmall, 2), 1 / lambda); };
  const auto found = [&](double lambda) { return fit_cohort(cohort, "none", small_settings(lambda)); };
  const double first = 0.3 / (kSmall * kSmall), second = 3 / (kSmall * kSmall);
  // ε of the momenta moves variances by a thousandth of σ².
  EXPECT_NEAR(found(first).log_evidence - found(second).log_evidence, expected(first) - expected(second), 0.02);
  const CohortFit fit = found(first);
  double sum = fit.of_own_mean;
  for (const ShapeFit& shape : fit.shapes) sum += shape.log_evidence;
  EXPECT_DOUBLE_EQ(fit.log_evidence, sum);
  EXPECT_GT(std::abs(fit.of_own_mean - found(second).of_own_mean), 5) << "which no tolerance hides";
}

// Of a prior of the mean of variance κ², κ → ∞, whichever coordinates the shapes lack.
TEST(OwnMean, IsTheLimitOfAWidePriorOfTheMean) {
  const Landmarks source = oval(5);
  std::vector<Landmarks> shapes = small_changes(4, 5);
  shapes[1].points(0, 2) = shapes[2].points(1, 4) = std::numeric_limits<double>::quiet_NaN();
  for (const AlignmentKind alignment : {AlignmentKind::kNone, AlignmentKind::kSimilarity}) {
    const Cohort cohort{source, shapes, alignment};
    const CohortSettings settings = small_settings(1 / (kSmall * kSmall));
    CohortFit fit;
    fit.kernel = settings.kernel.spec();
    fit.noise = "ch-sd:beta=2e-5";
    fit.lambda = *settings.lambda;
    std::vector<Specimen> specimens;
    for (int s = 0; s < 4; ++s) specimens.emplace_back(shape_problem(cohort, fit, settings, s), alignment);
    const Specimen& first = specimens.front();
    const posterior::Numbers numbers{std::make_shared<KernelOperator>(first.problem().system.kernel),
                                     first.problem().system.noise, 2e8, 1.3};
    const Specimen::Model model = first.model(numbers);
    const OwnMean mean(specimens, {Specimen(shape_problem({source, {source}}, fit, settings, 0)), model});

    const double sigma = first.problem().sigma, wide = 300;  // wider, and what shapes leave of their sizes shows
    Index data = 0;
    for (const Specimen& specimen : specimens) data += specimen.coordinates();
    MatrixXd covariance = MatrixXd::Zero(data, data), observed(data, source.points.size());
    Index row = 0;
    for (const Specimen& specimen : specimens) {
      const Index n = specimen.coordinates();
      const VectorXd rest = VectorXd::Zero(specimen.unknowns());
      covariance.block(row, row, n, n) = posterior::LinearModel(specimen, model, *specimen.shoot(model, rest), rest)
                                             .covariance(model)
                                             .topLeftCorner(n, n);
      observed.middleRows(row, n) = sigma * specimen.projection(source.points.reshaped()).topRows(n);
      row += n;
    }
    const double m = static_cast<double>(source.points.size()) - (alignment == AlignmentKind::kNone ? 0 : 4);
    const double expected = 0.5 * (log_determinant(covariance) -
                                   log_determinant(covariance + wide * wide * observed * observed.transpose())) +
                            m * (std::log(wide * sigma) + 0.5 * std::log(2 * std::numbers::pi));
    EXPECT_NEAR(mean.log_factor(*mean.at_rest(model), model), expected, 3e-4);
  }
}

}  // namespace
}  // namespace pulson::compare
