#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// V = K/λ + σ²I for all coordinates, written out.
MatrixXd covariance(const Points& q, const KernelTerm& kernel, double lambda, double sigma) {
  const KernelOperator k({kernel});
  const Index d = q.rows(), n = q.cols();
  MatrixXd v = sigma * sigma * MatrixXd::Identity(d * n, d * n);
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b)
      for (Index i = 0; i < d; ++i)
        v(a * d + i, b * d + i) += k.jet((q.col(a) - q.col(b)).squaredNorm()).value / lambda;
  return v;
}

MatrixXd similarity_directions(const Points& q) {
  std::vector<Index> all;
  for (Index i = 0; i < q.size(); ++i) all.push_back(i);
  return motion_directions(q, AlignmentKind::kSimilarity, all);
}

// The log density of all contrasts of the displacements that no similarity changes, without its 2π.
double contrast_density(const Points& q, const Points& y, const KernelTerm& kernel, double lambda, double sigma) {
  const MatrixXd z = similarity_directions(q);
  const MatrixXd whole = Eigen::HouseholderQR<MatrixXd>(z).householderQ();
  const MatrixXd contrasts = whole.rightCols(q.size() - z.cols());
  const MatrixXd v = contrasts.transpose() * covariance(q, kernel, lambda, sigma) * contrasts;
  const VectorXd r = contrasts.transpose() * (y - q).reshaped();
  const Eigen::LLT<MatrixXd> factors(v);
  const MatrixXd l = factors.matrixL();
  return -l.diagonal().array().log().sum() - 0.5 * r.dot(factors.solve(r));
}

struct Pair {
  Points q, y;
};

Pair drawn(Numbers& numbers, Index d, Index n, double alpha, double deviation, double sigma) {
  Pair pair{numbers(d, n), {}};
  pair.q /= diameter(pair.q);
  const MatrixXd v = covariance(pair.q, {KernelProfile::kMatern32, alpha, 1}, 1 / (deviation * deviation), sigma);
  const MatrixXd l = v.llt().matrixL();
  pair.y = pair.q + (l * std::sqrt(3.0) * numbers(d * n, 1)).reshaped(d, n);
  return pair;
}

DisplacementOptions options_of(double sigma) {
  DisplacementOptions options;
  options.alignment = AlignmentKind::kSimilarity;
  options.sigma = sigma;
  return options;
}

TEST(DisplacementModel, LikelihoodIsThatOfTheContrastsAndGreatest) {
  Numbers numbers(7);
  for (const Index d : {2, 3}) {
    const Pair pair = drawn(numbers, d, 11, 0.2, 0.05, 0.01);
    const auto model = fit_displacements(pair.q, pair.y, options_of(0.01));
    ASSERT_TRUE(model);
    const double size = diameter(pair.q);
    const auto density = [&](double alpha, double lambda) {
      return contrast_density(pair.q, pair.y, {KernelProfile::kMatern32, alpha, 1}, lambda, 0.01);
    };
    const double best = density(model->kernel.alpha, model->lambda);
    // The model's is of lengths in diameters.
    const double contrasts = static_cast<double>(pair.q.size() - similarity_directions(pair.q).cols());
    EXPECT_NEAR(model->log_likelihood, best + contrasts * std::log(size), 1e-8 * std::abs(best) + 1e-8);
    for (const double factor : {0.9, 1.1}) EXPECT_GE(best, density(model->kernel.alpha, model->lambda * factor));
    for (double alpha = 0.1; alpha <= 0.4; alpha += 0.05) EXPECT_GE(best + 0.02, density(alpha * size, model->lambda));
  }
}

// With the same V but for its noise, R_a/w_a of landmark a, and one landmark less.
TEST(DisplacementModel, LikelihoodHasWeightsAndCovariances) {
  Numbers numbers(7);
  const Index d = 2, n = 10;
  const Pair pair = drawn(numbers, d, n, 0.2, 0.05, 0.01);
  const double size = diameter(pair.q);
  DisplacementOptions options = options_of(0.01);
  options.weights = 1.5 + numbers(n, 1).array();
  options.weights[3] = 0;
  std::vector<Index> in;
  for (Index i = 0; i < d * n; ++i)
    if (i / d != 3) in.push_back(i);
  const MatrixXd z = similarity_directions(pair.q)(in, Eigen::all);
  const MatrixXd whole = Eigen::HouseholderQR<MatrixXd>(z).householderQ();
  const MatrixXd contrasts = whole.rightCols(whole.cols() - z.cols());
  for (const bool correlated : {false, true}) {
    if (correlated)
      for (Index a = 0; a < n; ++a) {
        const MatrixXd root = numbers(d, d);
        options.covariances.emplace_back(1e-4 * (root * root.transpose() + MatrixXd::Identity(d, d)));
      }
    const auto model = fit_displacements(pair.q, pair.y, options);
    ASSERT_TRUE(model);
    const auto density = [&](double alpha, double lambda) {
      MatrixXd v = covariance(pair.q, {KernelProfile::kMatern32, alpha, 1}, lambda, 0);
      for (Index a = 0; a < n; ++a)
        v.block(a * d, a * d, d, d) +=
            (correlated ? options.covariances[static_cast<std::size_t>(a)] : 1e-4 * MatrixXd::Identity(d, d)) /
            std::max(options.weights[a], 1e-9);
      const MatrixXd of = contrasts.transpose() * v(in, in) * contrasts;
      const VectorXd r = contrasts.transpose() * (pair.y - pair.q).reshaped()(in);
      const MatrixXd l = of.llt().matrixL();
      return -l.diagonal().array().log().sum() - 0.5 * r.dot(of.llt().solve(r));
    };
    const double best = density(model->kernel.alpha, model->lambda);
    for (const double factor : {0.9, 1.1}) EXPECT_GE(best, density(model->kernel.alpha, model->lambda * factor));
    for (double alpha = 0.1; alpha <= 0.4; alpha += 0.05) EXPECT_GE(best + 0.02, density(alpha * size, model->lambda));
  }
}

TEST(DisplacementModel, PredictionErrorIsThatOfRefits) {
  Numbers numbers(7);
  const Pair pair = drawn(numbers, 2, 9, 0.3, 0.08, 0.01);
  const auto model = fit_displacements(pair.q, pair.y, options_of(0.01));
  ASSERT_TRUE(model);
  const MatrixXd v = covariance(pair.q, model->kernel, model->lambda, 0.01);
  const MatrixXd z = similarity_directions(pair.q);
  const VectorXd r = (pair.y - pair.q).reshaped();
  double kriging = 0, motion = 0;
  for (Index out = 0; out < 9; ++out) {
    std::vector<Index> in, left = {2 * out, 2 * out + 1};
    for (Index i = 0; i < 18; ++i)
      if (i / 2 != out) in.push_back(i);
    const auto predicted = [&](const MatrixXd& of) -> VectorXd {
      const MatrixXd inverse = MatrixXd(of(in, in)).inverse();
      const MatrixXd zi = z(in, Eigen::all);
      const VectorXd b = (zi.transpose() * inverse * zi).ldlt().solve(zi.transpose() * inverse * r(in));
      return z(left, Eigen::all) * b + of(left, in) * (inverse * (r(in) - zi * b));
    };
    kriging += (predicted(v) - r(left)).squaredNorm() / 9;
    motion += (predicted(MatrixXd::Identity(18, 18)) - r(left)).squaredNorm() / 9;
  }
  EXPECT_NEAR(model->prediction_error, std::sqrt(kriging), 1e-10);
  EXPECT_NEAR(model->alignment_error, std::sqrt(motion), 1e-10);
}

TEST(DisplacementModel, DoesNotDependOnTheUnit) {
  Numbers numbers(7);
  const Pair pair = drawn(numbers, 2, 14, 0.2, 0.05, 0.01);
  const auto model = fit_displacements(pair.q, pair.y, options_of(0.01));
  for (const double unit : {1e-3, 1e3, 1e9}) {
    const auto other = fit_displacements(unit * pair.q, unit * pair.y, options_of(unit * 0.01));
    EXPECT_NEAR(other->kernel.alpha / unit, model->kernel.alpha, 1e-9);
    EXPECT_NEAR(other->lambda * unit * unit / model->lambda, 1, 1e-9);
    EXPECT_NEAR(other->prediction_error / unit, model->prediction_error, 1e-9);
  }
}

// Of draws from the model the fits lie about the truth: the medians within a factor that 60 draws allow (a median of 60
// values of standard deviation s has s · 1.25/√60; s was 0.35 for the logarithm of the deviation, 0.55 of the width).
TEST(DisplacementModel, RecoversWhatItWasDrawnFrom) {
  Numbers numbers(7);
  constexpr int kDraws = 60;
  std::vector<double> widths, deviations;
  for (int i = 0; i < kDraws; ++i) {
    const Pair pair = drawn(numbers, 2, 40, 0.2, 0.03, 0.002);
    const auto model = fit_displacements(pair.q, pair.y, options_of(0.002));
    widths.push_back(model->kernel.alpha / 0.2);
    deviations.push_back(1 / std::sqrt(model->lambda) / 0.03);
  }
  for (std::vector<double>* values : {&widths, &deviations})
    std::nth_element(values->begin(), values->begin() + kDraws / 2, values->end());
  EXPECT_NEAR(std::log(widths[kDraws / 2]), 0, 3 * 0.55 * 1.25 / std::sqrt(kDraws));
  EXPECT_NEAR(std::log(deviations[kDraws / 2]), 0, 3 * 0.35 * 1.25 / std::sqrt(kDraws));
}

TEST(DisplacementModel, NeedsMoreCoordinatesThanDirections) {
  const Points triangle{{0.0, 1.0, 0.3}, {0.0, 0.1, 0.9}};
  EXPECT_FALSE(fit_displacements(triangle, 2 * triangle, options_of(0.01)));
  EXPECT_FALSE(fit_displacements(Points{{0.0, 1.0}}, Points{{1.0, 0.0}}, options_of(0.01)));
  const Points missing{{0.0, 1.0, 0.3, std::nan("")}, {0.0, 0.1, 0.9, 1.0}};
  EXPECT_FALSE(fit_displacements(triangle, triangle, options_of(0.01)));
  EXPECT_FALSE(fit_displacements(missing, missing, options_of(0.01)));
}

// σ² is no number: then no width is the likeliest.
TEST(DisplacementModel, IsNoneWhereTheLikelihoodIsNotFinite) {
  const Points oval{{0.0, 1.0, 1.3, 0.8, 0.1, -0.3}, {0.0, 0.1, 0.5, 0.9, 1.0, 0.4}};
  const Points other = 1.1 * oval.array() + 0.1 * oval.array().square();
  EXPECT_TRUE(fit_displacements(oval, other, options_of(0.01)));
  EXPECT_FALSE(fit_displacements(oval, other, options_of(1e200)));
}

}  // namespace
}  // namespace pulson::matching
