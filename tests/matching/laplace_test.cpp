#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "error_of.hpp"
#include "numbers.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "random/normals.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::HasSubstr;

struct Setting {
  std::string kernel = "gaussian:alpha=0.9";
  std::string noise = "none";
  double lambda = 1;
  TimeGrid grid{1, 5};
  std::vector<MatrixXd> realisations{};
};

MatchingObjective objective_of(const Setting& s, const Points& q0, const LandmarkObservations& observed) {
  return MatchingObjective({{make_kernel(s.kernel, q0), make_noise(s.noise)},
                            make_integrator("variational"),
                            s.grid,
                            q0,
                            std::make_shared<LandmarkTerm>(observed),
                            observed.sigma,
                            s.lambda,
                            s.realisations});
}

MatchingObjective::Evaluation minimum_of(const MatchingObjective& objective) {
  MinimiseOptions options;
  options.gradient_tolerance = 1e-7;
  MinimiseSummary summary = minimise(objective, options);
  EXPECT_LE(summary.relative_gradient, 1e-5) << summary.reason;
  return std::move(summary.solution);
}

// Each entry of M as a multiple of the identity in R^d.
MatrixXd for_each_axis(const MatrixXd& m, Index d) {
  MatrixXd result = MatrixXd::Zero(d * m.rows(), d * m.cols());
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j) result.block(i * d, j * d, d, d).diagonal().setConstant(m(i, j));
  return result;
}

double log_normal_density(const VectorXd& x, const MatrixXd& covariance) {
  return -0.5 * x.dot(covariance.llt().solve(x)) -
         0.5 * std::log((2 * std::numbers::pi * covariance).fullPivLu().determinant());
}

// Of A z of variance C and covariance X with y, given the y of covariance S.
Points conditional_deviation(const MatrixXd& c, const MatrixXd& x, const MatrixXd& s, Index d) {
  const VectorXd variances = (c - x * s.llt().solve(x.transpose())).diagonal();
  return variances.cwiseSqrt().reshaped(d, variances.size() / d);
}

void expect_near(const Points& a, const Points& b, double relative) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.cols(), b.cols());
  EXPECT_LE(((a - b).array() / b.array()).abs().maxCoeff(), relative) << a << "\n\n" << b;
}

// All lengths of order ε beside the shape, so that q(T) is linear but for terms of order ε: q(T) = q0 + T K p0 + β Σ
// w_k with p0 ~ N(0, (λK)⁻¹) and half of the last increment, and everything is a Gaussian in closed form.
struct LinearLimit {
  static constexpr double kSmall = 1e-4;
  static constexpr Index kDimension = 2;

  explicit LinearLimit(bool plain) {
    Numbers numbers(4);
    q0 = numbers.landmarks(2, 3);
    observed.target = q0 + kSmall * numbers(2, 3);
    observed.sigma = 0.5 * kSmall;
    setting.lambda = 1 / (kSmall * kSmall);
    setting.noise = "ch-sd:beta=" + std::to_string(kBeta * kSmall);
    covariance = std::pow(observed.sigma, 2) * MatrixXd::Identity(6, 6);
    if (!plain) make_partial(numbers);
  }

  void make_partial(Numbers& numbers) {
    observed.weights = Eigen::Vector3d(1, 0.25, 3);
    for (Index a = 0; a < 3; ++a) {
      const MatrixXd x = kSmall * numbers(2, 2);
      observed.covariances.emplace_back(x * x.transpose() + 0.1 * kSmall * kSmall * MatrixXd::Identity(2, 2));
      covariance.block(2 * a, 2 * a, 2, 2) = observed.covariances.back() / observed.weights[a];
    }
    observed.target(1, 0) = kNaN;
    seen = {0, 2, 3, 4, 5};
  }

  MatrixXd kernel() const { return make_kernel(setting.kernel, q0).gram(q0, q0); }
  // Of q(T) before y is known.
  MatrixXd prior() const {
    const double time = setting.grid.time, beta = kBeta * kSmall;
    const double of_noise = beta * beta * setting.grid.dt() * (setting.grid.steps - 0.75);
    return for_each_axis(time * time / setting.lambda * kernel() + of_noise * MatrixXd::Identity(3, 3), kDimension);
  }
  MatrixXd marginal() const { return MatrixXd(prior() + covariance)(seen, seen); }

  static constexpr double kBeta = 0.7;
  Points q0;
  LandmarkObservations observed;
  Setting setting;
  MatrixXd covariance;  // R/w
  std::vector<Index> seen{0, 1, 2, 3, 4, 5};
};

class Laplace : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(PlainAndPartial, Laplace, testing::Bool());

TEST_P(Laplace, IsTheGaussianWhereTheFlowIsLinear) {
  const LinearLimit limit(GetParam());
  const MatchingObjective objective = objective_of(limit.setting, limit.q0, limit.observed);
  const MatchingObjective::Evaluation minimum = minimum_of(objective);
  const LaplaceApproximation found = laplace(objective, minimum);

  const MatrixXd s = limit.marginal();
  const VectorXd x = (limit.observed.target - limit.q0).reshaped()(limit.seen);
  constexpr double kTolerance = 10 * LinearLimit::kSmall;
  const double expected = log_normal_density(x, s);
  EXPECT_NEAR(found.log_evidence, expected, kTolerance * static_cast<double>(x.size()));
  EXPECT_EQ(log_evidence(objective, minimum), found.log_evidence);

  const MatrixXd k = limit.kernel() / limit.setting.lambda;
  const MatrixXd inverse = (limit.setting.lambda * limit.kernel()).inverse();
  const double time = limit.setting.grid.time;
  const auto covariance_with_y = [&](const MatrixXd& with_ends) {
    return MatrixXd(for_each_axis(with_ends, 2)(Eigen::all, limit.seen));
  };
  const MatrixXd of_ends = limit.prior()(Eigen::all, limit.seen);
  const MatrixXd of_momenta = covariance_with_y(time / limit.setting.lambda * MatrixXd::Identity(3, 3));
  expect_near(found.momentum_deviation, conditional_deviation(for_each_axis(inverse, 2), of_momenta, s, 2), kTolerance);
  expect_near(found.velocity_deviation, conditional_deviation(for_each_axis(k, 2), covariance_with_y(time * k), s, 2),
              kTolerance);
  expect_near(found.end_deviation, conditional_deviation(limit.prior(), of_ends, s, 2), kTolerance);
}

// The definition, dense and by differences: J of the residuals, and A.
struct ByDifferences {
  MatrixXd b, ends;

  ByDifferences(const MatchingObjective& objective, const MatchingObjective::Evaluation& at) {
    constexpr double kStep = 1e-5;
    MatrixXd j(objective.residual(at).size(), at.z.size());
    ends.resize(objective.problem().source.size(), at.z.size());
    for (Index i = 0; i < at.z.size(); ++i) {
      const VectorXd change = VectorXd::Unit(at.z.size(), i) * kStep;
      const auto more = objective.evaluate(at.z + change).value();
      const auto less = objective.evaluate(at.z - change).value();
      j.col(i) = (objective.residual(more) - objective.residual(less)) / (2 * kStep);
      ends.col(i) = (mean_end(more) - mean_end(less)).reshaped() / (2 * kStep);
    }
    b = j.transpose() * j + MatrixXd::Identity(at.z.size(), at.z.size());
  }

  static Points mean_end(const MatchingObjective::Evaluation& at) {
    Points sum = Points::Zero(at.path().final().q.rows(), at.path().final().q.cols());
    for (const Trajectory& path : at.paths) sum += path.final().q;
    return sum / static_cast<double>(at.paths.size());
  }

  Points deviations(const MatrixXd& a, Index d) const {
    const VectorXd variances = (a * b.llt().solve(a.transpose())).diagonal();
    return variances.cwiseSqrt().reshaped(d, a.rows() / d);
  }
};

// ∂p0/∂z, from the whitening itself, dN×U.
MatrixXd momentum_changes(const MatchingObjective& objective) {
  MatrixXd changes(objective.problem().source.size(), objective.unknowns());
  for (Index i = 0; i < objective.unknowns(); ++i)
    changes.col(i) = objective.momenta(VectorXd::Unit(objective.unknowns(), i)).reshaped();
  return changes;
}

struct Regime {
  std::string name;
  std::string noise;
  int realisations;
};
class LaplaceFarFromLinear : public testing::TestWithParam<Regime> {};
INSTANTIATE_TEST_SUITE_P(All, LaplaceFarFromLinear,
                         testing::Values(Regime{"deterministic", "none", 0}, Regime{"map", "ch-sd:beta=0.3", 0},
                                         Regime{"momenta", "trouve-vialard:sigma=0.4", 0},
                                         Regime{"realisations", "ch-sd:beta=0.3", 3}),
                         [](const auto& row) { return row.param.name; });

TEST_P(LaplaceFarFromLinear, IsTheDefinition) {
  Numbers numbers(11);
  const Points q0 = numbers.landmarks(2, 4);
  Setting setting{.noise = GetParam().noise, .lambda = 0.7};
  for (int s = 0; s < GetParam().realisations; ++s) setting.realisations.push_back(0.3 * numbers(8, 5));
  LandmarkObservations observed{q0 + 0.3 * numbers(2, 4), 0.1};
  observed.weights = Eigen::Vector4d(1, 0.25, 0, 3);
  observed.target(0, 1) = kNaN;
  const MatchingObjective objective = objective_of(setting, q0, observed);
  const MatchingObjective::Evaluation minimum = minimum_of(objective);
  const LaplaceApproximation found = laplace(objective, minimum);

  const ByDifferences expected(objective, minimum);
  const MatrixXd momenta = momentum_changes(objective);
  const MatrixXd gram = make_kernel(setting.kernel, q0).gram(q0, q0);
  expect_near(found.momentum_deviation, expected.deviations(momenta, 2), 1e-6);
  expect_near(found.velocity_deviation, expected.deviations(for_each_axis(gram, 2) * momenta, 2), 1e-6);
  expect_near(found.end_deviation, expected.deviations(expected.ends, 2), 1e-6);
  // Seen: 5 coordinates, with variances σ²/w.
  const double of_data = 5 * std::log(2 * std::numbers::pi * 0.01) - std::log(0.25) - 2 * std::log(3);
  const double evidence = -minimum.cost.total() - 0.5 * std::log(expected.b.fullPivLu().determinant()) - 0.5 * of_data;
  EXPECT_NEAR(found.log_evidence, evidence, 1e-6);
}

// Copies of one realisation change nothing but the number of residuals: with one there are fewer than unknowns, with
// three more.
TEST(LaplaceApproximation, IsTheSameInTheSpacesOfTheDataAndOfTheUnknowns) {
  Numbers numbers(12);
  const Points q0 = numbers.landmarks(2, 4);
  LandmarkObservations observed{q0 + 0.3 * numbers(2, 4), 0.05};
  observed.target(0, 1) = observed.target(1, 2) = kNaN;
  const MatrixXd increments = 0.3 * numbers(8, 5);
  std::vector<LaplaceApproximation> found;
  for (const std::size_t copies : {std::size_t{1}, std::size_t{3}}) {
    const Setting setting{.noise = "ch-sd:beta=0.3", .realisations = std::vector<MatrixXd>(copies, increments)};
    const MatchingObjective objective = objective_of(setting, q0, observed);
    const MatchingObjective::Evaluation minimum = minimum_of(objective);
    EXPECT_EQ(objective.linearise(minimum).residual.size() < objective.unknowns(), copies == 1);
    found.push_back(laplace(objective, minimum));
  }
  EXPECT_NEAR(found[0].log_evidence, found[1].log_evidence, 1e-8);
  expect_near(found[0].momentum_deviation, found[1].momentum_deviation, 1e-7);
  expect_near(found[0].velocity_deviation, found[1].velocity_deviation, 1e-7);
  expect_near(found[0].end_deviation, found[1].end_deviation, 1e-7);
}

// Where data say nearly all, variances in the space of the data are small differences; here of 1e-16 beside 1.
TEST(LaplaceApproximation, EndsAreAsSureAsPreciseData) {
  Numbers numbers(13);
  const Points q0 = numbers.landmarks(2, 4);
  const double sigma = 1e-8;
  const Setting setting{.noise = "ch-sd:beta=0.3"};
  const MatchingObjective objective = objective_of(setting, q0, {q0, sigma});
  const auto rest = objective.evaluate(VectorXd::Zero(objective.unknowns())).value();
  expect_near(laplace(objective, rest).end_deviation, Points::Constant(2, 4, sigma), 1e-6);
}

// log ∫ (2π)^{-n/2} exp(−J) dz less the data's normaliser, by the trapezoidal rule over ±8 deviations of the posterior.
double evidence_by_quadrature(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum,
                              double sigma) {
  constexpr int kHalf = 32;
  constexpr double kStep = 0.25;
  const MatrixXd root = ByDifferences(objective, minimum).b.llt().matrixU();
  double sum = 0;
  for (int i = -kHalf; i <= kHalf; ++i) {
    for (int j = -kHalf; j <= kHalf; ++j) {
      const Eigen::Vector2d u(kStep * i, kStep * j);
      const auto at = objective.evaluate(minimum.z + root.triangularView<Eigen::Upper>().solve(u));
      if (at) sum += std::exp(minimum.cost.total() - at->cost.total());
    }
  }
  const double volume = kStep * kStep / (root(0, 0) * root(1, 1)) / (2 * std::numbers::pi);
  return std::log(sum * volume) - minimum.cost.total() - std::log(2 * std::numbers::pi * sigma * sigma);
}

// Laplace's approximation is the first term of a series in the variance of the posterior.
TEST(LaplaceApproximation, EvidenceDiffersFromTheIntegralByTheVarianceOfTheData) {
  const Points q0 = Eigen::RowVector2d(0, 1);
  const Points target = Eigen::RowVector2d(0.3, 1.6);
  std::vector<double> sigmas, errors;
  for (double sigma = 0.08; sigma > 0.008; sigma /= 2) {
    const MatchingObjective objective = objective_of({.kernel = "gaussian:alpha=1"}, q0, {target, sigma});
    const auto minimum = minimum_of(objective);
    sigmas.push_back(sigma);
    errors.push_back(std::abs(log_evidence(objective, minimum) - evidence_by_quadrature(objective, minimum, sigma)));
  }
  EXPECT_NEAR(fitted_order(sigmas, errors), 2, 0.1);
  EXPECT_LE(errors.back(), 1e-3);
}

struct Sampled {
  Points deviation;
  double effective;  // number of samples of equal weight that would tell as much
};

// Importance sampling of exp(−J) with 1.1 times as wide a Gaussian; p0, v0 and q(T) of each sample, one below the
// other.
Sampled sampled_deviations(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum,
                           int count) {
  constexpr double kWider = 1.1;
  const Index n = objective.unknowns();
  const MatrixXd root = ByDifferences(objective, minimum).b.llt().matrixU();
  const MatrixXd normals = standard_normals(5, 0, static_cast<int>(n), count);
  const MatchingProblem& problem = objective.problem();
  const MatrixXd gram = problem.system.kernel.gram(problem.source, problem.source);
  const Index coordinates = problem.source.size();
  MatrixXd values(3 * coordinates, count);
  VectorXd weights(count);
  for (int i = 0; i < count; ++i) {
    const VectorXd z = minimum.z + kWider * root.triangularView<Eigen::Upper>().solve(normals.col(i));
    const auto at = objective.evaluate(z).value();
    weights[i] = std::exp(minimum.cost.total() - at.cost.total() + 0.5 * normals.col(i).squaredNorm());
    const Points p0 = objective.momenta(z);
    values.col(i) << p0.reshaped(), (p0 * gram).reshaped(), at.path().final().q.reshaped();
  }
  const double effective = std::pow(weights.sum(), 2) / weights.squaredNorm();
  weights /= weights.sum();
  const VectorXd mean = values * weights;
  const VectorXd variances = (values.colwise() - mean).array().square().matrix() * weights;
  return {variances.cwiseSqrt().reshaped(problem.source.rows(), variances.size() / problem.source.rows()), effective};
}

TEST(LaplaceApproximation, DeviationsAreThoseOfSamples) {
  const Points q0 = Eigen::RowVector2d(0, 0.7);
  const Points target = Eigen::RowVector2d(0.4, 0.8);
  const Setting setting{.kernel = "gaussian:alpha=1", .noise = "ch-sd:beta=0.06", .lambda = 100, .grid = {1, 4}};
  const MatchingObjective objective = objective_of(setting, q0, {target, 0.03});
  const auto minimum = minimum_of(objective);
  const LaplaceApproximation found = laplace(objective, minimum);
  const Sampled sampled = sampled_deviations(objective, minimum, 20000);
  ASSERT_GT(sampled.effective, 10000);
  // A deviation from n samples of a Gaussian has the relative standard error 1/√(2n).
  const double tolerance = 4 / std::sqrt(2 * sampled.effective);
  expect_near(found.momentum_deviation, sampled.deviation.leftCols(2), tolerance);
  expect_near(found.velocity_deviation, sampled.deviation.middleCols(2, 2), tolerance);
  expect_near(found.end_deviation, sampled.deviation.rightCols(2), tolerance);
}

TEST(LaplaceApproximation, CurvesHaveDeviationsButNoEvidence) {
  const Points q0 = (Points(2, 4) << 0, 1, 1, 0, 0, 0, 1, 1).finished();
  const Curve target{1.1 * q0, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}};
  const MatchingObjective objective(
      {{make_kernel("gaussian:alpha=0.9", q0), make_noise("none")},
       make_integrator("variational"),
       {1, 5},
       q0,
       std::make_shared<CurveTerm>(target.edges, 4, target, CurveTermOptions{CurveMeasure::kVarifold, 0.05, 0.5}),
       0.05,
       1});
  const auto minimum = minimum_of(objective);
  const LaplaceApproximation found = laplace(objective, minimum);
  EXPECT_TRUE(std::isnan(found.log_evidence));
  EXPECT_GT(found.end_deviation.minCoeff(), 0);
  EXPECT_LT(found.end_deviation.maxCoeff(), 1);
  EXPECT_THAT(error_of([&] { log_evidence(objective, minimum); }), HasSubstr("the evidence needs landmarks"));
}

}  // namespace
}  // namespace pulson::matching
