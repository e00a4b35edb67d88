#include "quadratic_model.hpp"

#include <cmath>

namespace pulson::matching {

using Eigen::MatrixXd;
using Eigen::VectorXd;

QuadraticModel::QuadraticModel(const MatchingObjective::Linearisation& at, const VectorXd& frequency)
    : at_(at), frequency_(frequency) {
  if (!in_data_space()) {
    normal_ = MatrixXd::Zero(at.jacobian.cols(), at.jacobian.cols());
    normal_.selfadjointView<Eigen::Lower>().rankUpdate(at.jacobian.transpose());
  }
  set_damping(0);
}

void QuadraticModel::set_damping(double mu) {
  c_ = (1 + mu * frequency_.array()).inverse();
  if (in_data_space()) {
    MatrixXd s = at_.jacobian * c_.asDiagonal() * at_.jacobian.transpose();
    s.diagonal().array() += 1;
    factors_.compute(s);
  } else {
    MatrixXd b = normal_;
    b.diagonal() += c_.cwiseInverse();
    factors_.compute(b);
  }
}

VectorXd QuadraticModel::pull(const VectorXd& r) const { return at_.jacobian.transpose() * factors_.solve(r); }

VectorXd QuadraticModel::step(const VectorXd& z) const {
  if (in_data_space()) return -c_.cwiseProduct(z + pull(at_.residual - at_.jacobian * c_.cwiseProduct(z)));
  return -factors_.solve(z + at_.jacobian.transpose() * at_.residual);
}

VectorXd QuadraticModel::correction(const VectorXd& excess) const {
  if (in_data_space()) return -c_.cwiseProduct(pull(excess));
  return -factors_.solve(at_.jacobian.transpose() * excess);
}

VectorXd QuadraticModel::solve(const VectorXd& v) const {
  if (!in_data_space()) return factors_.solve(v);
  const VectorXd cv = c_.cwiseProduct(v);
  return cv - c_.cwiseProduct(pull(at_.jacobian * cv));
}

VectorXd QuadraticModel::variances(const MatrixXd& transposed) const {
  if (!in_data_space()) return factors_.matrixL().solve(transposed).colwise().squaredNorm();
  const MatrixXd jw = factors_.solve(at_.jacobian * (c_.asDiagonal() * transposed));
  const MatrixXd w = transposed - at_.jacobian.transpose() * jw;  // C⁻¹W
  const VectorXd of_prior = (c_.cwiseSqrt().asDiagonal() * w).colwise().squaredNorm();
  return of_prior + jw.colwise().squaredNorm().transpose();
}

double QuadraticModel::log_determinant() const {
  const double of_factors = 2 * factors_.matrixLLT().diagonal().array().log().sum();
  return in_data_space() ? of_factors - c_.array().log().sum() : of_factors;
}

}  // namespace pulson::matching
