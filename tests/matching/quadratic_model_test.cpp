// The quadratic model of a search, in the space of the unknowns and in that of the data.

#include "quadratic_model.hpp"

#include <string>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "combinations.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A model with more unknowns than residuals, and the same with as many residuals, the others 0: the first is factored
// in the space of the data, the second in that of the unknowns.
class Models : public testing::Test {
 protected:
  static constexpr Index kUnknowns = 17;
  static constexpr Index kResiduals = 6;

  Models() {
    wide_ = {numbers_(kResiduals, 1), numbers_(kResiduals, kUnknowns)};
    padded_ = {padded(wide_.residual), MatrixXd::Zero(kUnknowns, kUnknowns)};
    padded_.jacobian.topRows(kResiduals) = wide_.jacobian;
  }

  static VectorXd padded(const VectorXd& residual) {
    VectorXd longer = VectorXd::Zero(kUnknowns);
    longer.head(kResiduals) = residual;
    return longer;
  }

  // I + μR + JᵀJ
  MatrixXd dense(double mu) const {
    MatrixXd b = wide_.jacobian.transpose() * wide_.jacobian;
    b.diagonal().array() += 1 + mu * roughness_.array();
    return b;
  }

  Numbers numbers_{11};
  VectorXd roughness_ = VectorXd::Ones(kUnknowns) + numbers_(kUnknowns, 1).cwiseAbs() * 40;
  VectorXd z_ = numbers_(kUnknowns, 1);
  VectorXd excess_ = numbers_(kResiduals, 1);
  MatchingObjective::Linearisation wide_, padded_;
};

TEST_F(Models, AreTheSameInTheSpaceOfTheDataAndInThatOfTheUnknowns) {
  QuadraticModel in_data(wide_, roughness_);
  QuadraticModel in_unknowns(padded_, roughness_);
  for (const double mu : {0.0, 1e-3, 2.0, 1e4}) {
    SCOPED_TRACE("damping " + std::to_string(mu));
    in_data.set_damping(mu);
    in_unknowns.set_damping(mu);
    EXPECT_LE((in_data.step(z_) - in_unknowns.step(z_)).norm(), 1e-13 * in_data.step(z_).norm());
    const VectorXd correction = in_data.correction(excess_);
    EXPECT_LE((correction - in_unknowns.correction(padded(excess_))).norm(), 1e-13 * correction.norm());
    EXPECT_LE((in_data.solve(z_) - in_unknowns.solve(z_)).norm(), 1e-13 * z_.norm());
    EXPECT_NEAR(in_data.log_determinant(), in_unknowns.log_determinant(), 1e-12);
  }
}

TEST_F(Models, SolveTheirDenseSystems) {
  for (const auto* at : {&wide_, &padded_}) {
    QuadraticModel model(*at, roughness_);
    for (const double mu : {0.0, 2.0}) {
      model.set_damping(mu);
      const MatrixXd b = dense(mu);
      EXPECT_LE((b * model.solve(z_) - z_).norm(), 1e-12 * z_.norm());
      const VectorXd gradient = z_ + wide_.jacobian.transpose() * wide_.residual;
      EXPECT_LE((b * model.step(z_) + gradient).norm(), 1e-12 * gradient.norm());
      EXPECT_NEAR(model.log_determinant(), 2 * b.llt().matrixLLT().diagonal().array().log().sum(), 1e-12);
    }
  }
}

TEST_F(Models, BeginWithoutDamping) {
  const VectorXd expected = dense(0).ldlt().solve(z_);
  EXPECT_LE((QuadraticModel(wide_, roughness_).solve(z_) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LE((QuadraticModel(padded_, roughness_).solve(z_) - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace pulson::matching
