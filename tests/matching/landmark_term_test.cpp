#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "core/text.hpp"
#include "error_of.hpp"
#include "numbers.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::HasSubstr;

constexpr int kTermCount = 5;

struct TermCase {
  std::string name;
  bool weighted, correlated, missing;
};

// Observations of five landmarks, some with weights, covariances or missing coordinates.
LandmarkObservations observations(const TermCase& of, int d, Numbers& numbers) {
  LandmarkObservations observed;
  observed.target = numbers.landmarks(d, kTermCount);
  observed.sigma = 0.3;
  if (of.weighted) observed.weights = (VectorXd(kTermCount) << 1, 0.25, 0, 3, 2).finished();
  if (of.correlated)
    for (int a = 0; a < kTermCount; ++a) {
      const MatrixXd x = numbers(d, d);
      observed.covariances.emplace_back(x * x.transpose() + 0.1 * MatrixXd::Identity(d, d));
    }
  if (of.missing) {
    observed.target(0, 0) = kNaN;
    observed.target(d - 1, 2) = kNaN;
    observed.target(d / 2, 4) = kNaN;
    observed.target.col(3).setConstant(kNaN);
  }
  return observed;
}

// The definition, dense: the indices observed, and the covariance of y there.
struct Dense {
  std::vector<Index> seen;
  MatrixXd covariance;
  VectorXd target;

  explicit Dense(const LandmarkObservations& of) {
    const Index d = of.target.rows();
    MatrixXd all = of.sigma * of.sigma * MatrixXd::Identity(of.target.size(), of.target.size());
    for (Index a = 0; a < of.target.cols(); ++a) {
      const double weight = of.weights.size() == 0 ? 1 : of.weights[a];
      if (!of.covariances.empty()) all.block(a * d, a * d, d, d) = of.covariances[static_cast<std::size_t>(a)];
      all.block(a * d, a * d, d, d) /= weight;
      for (Index i = a * d; i < (a + 1) * d; ++i)
        if (weight > 0 && !std::isnan(of.target.reshaped()[i])) seen.push_back(i);
    }
    covariance = all(seen, seen);
    target = of.target.reshaped()(seen);
  }

  VectorXd difference(const Points& q) const { return q.reshaped()(seen) - target; }
  double value(const Points& q) const { return 0.5 * difference(q).dot(covariance.inverse() * difference(q)); }
};

class Term : public testing::TestWithParam<TermCase> {
 protected:
  // Runs `check(term, observations, q, numbers)` in each dimension.
  template <class Check>
  static void in_each_dimension(const Check& check) {
    for (int d = 1; d <= 3; ++d) {
      SCOPED_TRACE("dimension " + std::to_string(d));
      Numbers numbers(static_cast<unsigned>(d));
      const LandmarkObservations observed = observations(GetParam(), d, numbers);
      const Points q = numbers.landmarks(d, kTermCount);
      check(LandmarkTerm(observed), observed, q, numbers);
    }
  }
};

INSTANTIATE_TEST_SUITE_P(All, Term,
                         testing::Values(TermCase{"plain", false, false, false},
                                         TermCase{"weighted", true, false, false},
                                         TermCase{"correlated", false, true, false},
                                         TermCase{"missing", false, false, true}, TermCase{"all", true, true, true}),
                         [](const auto& row) { return row.param.name; });

TEST_P(Term, IsTheDefinition) {
  in_each_dimension([](const LandmarkTerm& term, const LandmarkObservations& observed, const Points& q, Numbers&) {
    const Dense dense(observed);
    EXPECT_NEAR(term.value(q), dense.value(q), 1e-12 * dense.value(q));
    EXPECT_EQ(term.residuals(), std::ssize(dense.seen));
    EXPECT_TRUE(term.is_least_squares());
    EXPECT_EQ(term.residual(q).size(), term.residuals());
    EXPECT_DOUBLE_EQ(0.5 * term.residual(q).squaredNorm(), term.value(q));
    const double expected = std::log((2 * std::numbers::pi * dense.covariance).determinant());
    EXPECT_NEAR(term.log_determinant(), expected, 1e-12 * (1 + std::abs(expected)));
  });
}

TEST_P(Term, GradientIsTheDefinitionAndTheChangeOfTheValue) {
  in_each_dimension(
      [](const LandmarkTerm& term, const LandmarkObservations& observed, const Points& q, Numbers& numbers) {
        const Dense dense(observed);
        VectorXd expected = VectorXd::Zero(q.size());
        expected(dense.seen) = dense.covariance.inverse() * dense.difference(q);
        const Points gradient = term.gradient(q);
        EXPECT_LE((gradient.reshaped() - expected).norm(), 1e-12 * expected.norm());
        const Points direction = numbers(q.rows(), q.cols());
        const double h = 1e-3;  // central differences of a quadratic are exact
        const double change = (term.value(q + h * direction) - term.value(q - h * direction)) / (2 * h);
        EXPECT_NEAR(gradient.cwiseProduct(direction).sum(), change, 1e-10 * gradient.norm() * direction.norm());
      });
}

TEST_P(Term, LinearisationIsExact) {
  in_each_dimension(
      [](const LandmarkTerm& term, const LandmarkObservations& observed, const Points& q, Numbers& numbers) {
        const MatrixXd changes = numbers(q.size(), 4);
        const DataTerm::Linearisation at = term.linearise(q, changes);
        EXPECT_EQ(at.residual, term.residual(q));
        ASSERT_EQ(at.changes.rows(), term.residuals());
        ASSERT_EQ(at.changes.cols(), 4);
        for (Index j = 0; j < 4; ++j) {
          const Points moved = q + changes.col(j).reshaped(q.rows(), q.cols());
          EXPECT_LE((term.residual(moved) - at.residual - at.changes.col(j)).norm(), 1e-13 * at.residual.norm());
          EXPECT_NEAR(at.residual.dot(at.changes.col(j)), term.gradient(q).reshaped().dot(changes.col(j)), 1e-11);
        }
        const Dense dense(observed);
        const MatrixXd expected =
            changes(dense.seen, Eigen::all).transpose() * dense.covariance.inverse() * changes(dense.seen, Eigen::all);
        EXPECT_LE((at.changes.transpose() * at.changes - expected).norm(), 1e-12 * expected.norm());
      });
}

// exp(−D) over the missing coordinates, integrated, is exp(−D) of the rest: their determinants make up the difference.
TEST(LandmarkTermMissing, IsTheMarginal) {
  LandmarkObservations observed;
  observed.target = Eigen::Vector2d(0.3, -0.2);
  observed.covariances = {(MatrixXd(2, 2) << 0.5, 0.3, 0.3, 0.4).finished()};
  const Points q = Eigen::Vector2d(0.9, 0.4);
  const auto density = [&q](const LandmarkObservations& of) {
    const LandmarkTerm term(of);
    return std::exp(-term.value(q) - 0.5 * term.log_determinant());
  };
  for (const Index axis : {0, 1}) {
    double integral = 0;
    LandmarkObservations whole = observed;
    const double step = 0.02;  // the trapezoidal rule is exact to round-off for a Gaussian this wide
    for (double y = -10; y <= 10; y += step) {
      whole.target(axis, 0) = y;
      integral += step * density(whole);
    }
    LandmarkObservations part = observed;
    part.target(axis, 0) = kNaN;
    EXPECT_NEAR(density(part), integral, 1e-12);
  }
}

TEST(LandmarkDistances, AreOverWhatIsObserved) {
  Points target(2, 4);
  target << 0, 1, kNaN, kNaN,  //
      0, 1, 2, kNaN;
  const Points q = (Points(2, 4) << 3, 1, 7, 1, 4, 1, 0, 1).finished();
  const VectorXd found = distances(q, target);
  EXPECT_EQ(found.head(3), Eigen::Vector3d(5, 0, 2));
  EXPECT_TRUE(std::isnan(found[3]));
  EXPECT_DOUBLE_EQ(rms_distance(q, target), std::sqrt(29.0 / 3));
  EXPECT_TRUE(std::isnan(rms_distance(q, Points::Constant(2, 4, kNaN))));
}

TEST(Covariance, IsToldFromWhatIsNone) {
  const MatrixXd good = (MatrixXd(2, 2) << 2, 1, 1, 1).finished();
  for (const double unit : {1e-40, 1.0, 1e40}) {
    EXPECT_TRUE(is_covariance(unit * good));
    EXPECT_TRUE(is_covariance(unit * Eigen::Vector2d(1, 1e-20).asDiagonal().toDenseMatrix()));
    EXPECT_FALSE(is_covariance(unit * (MatrixXd(2, 2) << 2, 1, 1.001, 1).finished())) << "not symmetric";
    EXPECT_FALSE(is_covariance(unit * (MatrixXd(2, 2) << 1, 2, 2, 1).finished())) << "indefinite";
    EXPECT_FALSE(is_covariance(unit * (MatrixXd(2, 2) << 1, 1, 1, 1 + 1e-15).finished())) << "singular";
  }
  EXPECT_FALSE(is_covariance(MatrixXd::Zero(2, 2)));
  EXPECT_FALSE(is_covariance(-good));
  EXPECT_FALSE(is_covariance(good.leftCols(1)));
  EXPECT_FALSE(is_covariance(kInfinity * good));
  EXPECT_FALSE(is_covariance(kNaN * good));
}

TEST(LandmarkTermErrors, NameWhatIsWrong) {
  const auto error_with = [](const std::function<void(LandmarkObservations&)>& change) {
    LandmarkObservations observed;
    observed.target = Numbers(1).landmarks(2, 4);
    observed.sigma = 0.01;
    change(observed);
    return error_of([&] { LandmarkTerm{observed}; });
  };
  EXPECT_EQ(error_with([](auto&) {}), "no error");
  for (const double wrong : {0.0, -1.0, kNaN, kInfinity})
    EXPECT_THAT(error_with([&](auto& of) { of.sigma = wrong; }), HasSubstr("sigma is"));
  EXPECT_THAT(error_with([](auto& of) { of.weights = VectorXd::Ones(5); }), HasSubstr("5 weights for 4 landmarks"));
  for (const double wrong : {-1.0, kNaN, kInfinity})
    EXPECT_THAT(error_with([&](auto& of) { of.weights = Eigen::Vector4d(1, wrong, 1, 1); }),
                HasSubstr("the weight of landmark 2 is"));
  const std::vector<MatrixXd> unit(4, MatrixXd::Identity(2, 2));
  EXPECT_EQ(error_with([&](auto& of) { of.covariances = unit; }), "no error");
  EXPECT_THAT(error_with([&](auto& of) { of.covariances.assign(3, unit[0]); }),
              HasSubstr("3 covariances for 4 landmarks"));
  const auto error_of_third = [&](const MatrixXd& covariance) {
    return error_with([&](auto& of) {
      of.covariances = unit;
      of.covariances[2] = covariance;
    });
  };
  EXPECT_THAT(error_of_third(MatrixXd::Identity(3, 3)), HasSubstr("of landmark 3 is 3x3; 2x2 is needed"));
  EXPECT_THAT(error_of_third(-unit[0]), HasSubstr("of landmark 3 is not symmetric and positive definite"));
  for (const double infinite : {kInfinity, -kInfinity})
    EXPECT_THAT(error_with([&](auto& of) { of.target(1, 3) = infinite; }),
                HasSubstr("landmark 4 of the target has an infinite coordinate"));
  EXPECT_THAT(error_with([](auto& of) { of.target.setConstant(kNaN); }), HasSubstr("nothing is observed"));
  EXPECT_THAT(error_with([](auto& of) { of.weights = VectorXd::Zero(4); }), HasSubstr("nothing is observed"));
}

}  // namespace
}  // namespace pulson::matching
