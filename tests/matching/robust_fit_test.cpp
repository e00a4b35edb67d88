// Weights of landmarks reach every part of a registration, and a robust fit finds them.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

constexpr Index kWrong = 7;

Landmarks planted_shape(const Points& points) {
  Landmarks shape;
  shape.points = points;
  return shape;
}

// An oval with four landmarks inside, and a smooth change of it; one landmark is wrong by a fifth of the diameter.
struct PlantedPair {
  Landmarks source, target, missing;

  PlantedPair() {
    Points q(2, 24);
    for (Index a = 0; a < 20; ++a) {
      const double angle = 0.1 * static_cast<double>(a) * std::numbers::pi;
      q.col(a) << 1.5 * std::cos(angle) + 0.1 * std::cos(3 * angle), std::sin(angle);
    }
    q.rightCols(4) << -0.6, 0.0, 0.5, 0.2, 0.1, -0.4, 0.3, 0.05;
    Points y = q;
    for (Index a = 0; a < q.cols(); ++a) {
      const double u = q(0, a), v = q(1, a);
      y.col(a) += Eigen::Vector2d(0.1 * std::sin(2.5 * v) + 0.05 * u * u, 0.12 * std::cos(2 * u) + 0.05 * u * v);
      y.col(a) +=
          0.006 * Eigen::Vector2d(std::sin(37.0 * static_cast<double>(a)), std::cos(91.0 * static_cast<double>(a)));
    }
    y.col(kWrong) += Eigen::Vector2d(0.45, -0.4);
    source = planted_shape(q);
    target = missing = planted_shape(y);
    missing.points.col(kWrong).setConstant(std::nan(""));
  }
};

RegistrationOptions with_weights(Index count) {
  RegistrationOptions options;
  options.data.weights = Eigen::VectorXd::Ones(count);
  options.data.weights[kWrong] = 0;
  return options;
}

// Alignment, kernel, λ and flow.
TEST(LandmarkWeights, OfZeroAreAsMissing) {
  const PlantedPair pair;
  const Registration weighed = register_shapes(pair.source, pair.target, with_weights(pair.source.count()));
  const Registration missing = register_shapes(pair.source, pair.missing);
  EXPECT_EQ(weighed.kernel, missing.kernel);
  EXPECT_EQ(weighed.lambda, missing.lambda);
  EXPECT_EQ(weighed.fitted_kernel->prediction_error, missing.fitted_kernel->prediction_error);
  EXPECT_EQ(weighed.source.points, missing.source.points);
  EXPECT_NEAR((weighed.result - missing.result).cwiseAbs().maxCoeff(), 0, 1e-9);
}

// All weights or covariances alike are another σ.
TEST(LandmarkWeights, ThatAreAlikeAreAnotherSigma) {
  const PlantedPair pair;
  RegistrationOptions plain, weighed, covariances;
  plain.sigma = 0.02;
  weighed.sigma = covariances.sigma = 0.06;
  weighed.data.weights.setConstant(pair.source.count(), 9);
  covariances.data.covariances.assign(static_cast<std::size_t>(pair.source.count()),
                                      0.0004 * Eigen::MatrixXd::Identity(2, 2));
  const Registration expected = register_shapes(pair.source, pair.missing, plain);
  for (const RegistrationOptions& options : {weighed, covariances}) {
    const Registration found = register_shapes(pair.source, pair.missing, options);
    EXPECT_NEAR((found.source.points - expected.source.points).cwiseAbs().maxCoeff(), 0, 1e-12);
    EXPECT_NEAR(found.lambda / expected.lambda, 1, 1e-6);
    EXPECT_NEAR((found.result - expected.result).cwiseAbs().maxCoeff(), 0, 1e-6);
  }
}

TEST(RobustRegistration, IsTheFitWithoutTheWrongLandmark) {
  const PlantedPair pair;
  RegistrationOptions options;
  options.loss = RobustLoss{};
  const Registration robust = register_shapes(pair.source, pair.target, options);
  const Registration missing = register_shapes(pair.source, pair.missing, options);
  ASSERT_TRUE(robust.robust);
  EXPECT_EQ(robust.robust->loss, "tukey:5.12299");
  for (Index a = 0; a < pair.source.count(); ++a) {
    if (a == kWrong) {
      EXPECT_LT(robust.robust->weights[a], 0.1);
    } else {
      EXPECT_GT(robust.robust->weights[a], 0.1);
    }
  }
  EXPECT_EQ(robust.data.weights[kWrong], 0);
  EXPECT_NEAR(std::log(robust.sigma / missing.sigma), 0, 0.05);
  EXPECT_NEAR(std::log(robust.lambda / missing.lambda), 0, 0.1);
  EXPECT_NEAR((robust.result - missing.result).cwiseAbs().maxCoeff(), 0, robust.sigma);

  // Least squares without the landmark: half of the standard error of log λ, which that of 46 coordinates less four
  // exceeds where the width is known.
  RegistrationOptions plain;
  plain.sigma = missing.sigma;
  const Registration least_squares = register_shapes(pair.source, pair.missing, plain);
  EXPECT_NEAR(std::log(robust.lambda / least_squares.lambda), 0, 0.5 * std::sqrt(2.0 / 42));
}

TEST(RobustRegistration, RefusesWhatItCannotJudge) {
  const PlantedPair pair;
  RegistrationOptions options;
  options.loss = RobustLoss{};
  const auto error = [&] { return error_of([&] { register_shapes(pair.source, pair.target, options); }); };
  options.data.covariances.assign(static_cast<std::size_t>(pair.source.count()), Eigen::MatrixXd::Identity(2, 2));
  EXPECT_NE(error().find("covariances"), std::string::npos);
  options.data.covariances.clear();
  options.data.kind = DataKind::kVarifold;
  EXPECT_NE(error().find("landmarks"), std::string::npos);
  const Points triangle{{0.0, 1.0, 0.3}, {0.0, 0.1, 0.9}};
  options.data.kind = DataKind::kLandmarks;
  EXPECT_NE(
      error_of([&] { register_shapes(planted_shape(triangle), planted_shape(2 * triangle), options); }).find("robust"),
      std::string::npos);
}

}  // namespace
}  // namespace pulson::matching
