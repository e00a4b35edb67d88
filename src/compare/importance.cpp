#include "importance.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "random/normals.hpp"

namespace pulson {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ImportanceEstimate importance_sample(const MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, std::uint64_t seed) {
  const MatrixXd& jacobian = match.jacobian;
  const Index n = jacobian.rows();
  MatrixXd covariance = MatrixXd::Identity(n, n);
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(jacobian);
  const Eigen::LLT<MatrixXd> factors(covariance);
  const VectorXd centre = jacobian.transpose() * factors.solve(match.innovation);  // of the linear model's posterior
  const VectorXd observable = observable_unknowns(objective);
  VectorXd log_weights(samples);
  for (int s = 0; s < samples; ++s) {
    const VectorXd normals =
        standard_normals(seed, static_cast<std::uint64_t>(s), static_cast<int>(n + jacobian.cols()), 1);
    const VectorXd zeta = normals.tail(jacobian.cols()).cwiseProduct(observable);
    const VectorXd moved = jacobian * zeta + normals.head(n);
    const VectorXd z = centre + zeta - jacobian.transpose() * factors.solve(moved);
    const auto at = objective.evaluate(z);
    log_weights[s] = -std::numeric_limits<double>::infinity();
    if (!at) continue;
    // Of the same prior; the linear model's residual at z is t − Jz.
    const VectorXd linear = match.innovation - jacobian * z;
    log_weights[s] = 0.5 * (linear.squaredNorm() - observation.residual(at->path().final().q).squaredNorm());
  }
  const double largest = log_weights.maxCoeff();
  if (!std::isfinite(largest)) return {-std::numeric_limits<double>::infinity(), 0, 0};
  const VectorXd weights = (log_weights.array() - largest).exp();
  const double sum = weights.sum();
  const double effective = sum * sum / weights.squaredNorm();
  const auto count = static_cast<double>(samples);
  return {match.log_evidence + largest + std::log(sum / count), 1 / effective - 1 / count, effective};
}

}  // namespace pulson
