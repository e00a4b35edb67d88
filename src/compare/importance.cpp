#include "importance.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "random/normals.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 40;
constexpr double kAccuracy = 1e-4;  // of v, in standard deviations of the data

// The draws of one shape.
class Draws {
 public:
  Draws(const MatchingObjective& objective, const Observation& observation, const Linearised& match)
      : objective_(objective), observation_(observation), match_(match), observable_(observable_unknowns(objective)) {
    MatrixXd covariance = MatrixXd::Identity(observation.count(), observation.count());
    covariance.selfadjointView<Eigen::Lower>().rankUpdate(match.jacobian);
    factors_.compute(covariance);
    half_log_determinant_ = factors_.matrixLLT().diagonal().array().log().sum();
  }

  Index normals() const { return observation_.count() + match_.jacobian.cols(); }

  // Of the evidence, where there is a path.
  std::optional<double> log_weight(const VectorXd& normals) const {
    const MatrixXd& jacobian = match_.jacobian;
    const VectorXd epsilon = normals.head(observation_.count());
    const VectorXd zeta = normals.tail(jacobian.cols()).cwiseProduct(observable_);
    VectorXd v = factors_.solve(VectorXd(epsilon + match_.innovation - jacobian * zeta));
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const VectorXd z = zeta + jacobian.transpose() * v;
      const auto at = objective_.evaluate(z);
      if (!at) return std::nullopt;
      const VectorXd residual = observation_.residual(at->path().final().q);
      const VectorXd change = factors_.solve(VectorXd(epsilon + residual - v));
      if (change.norm() <= kAccuracy) return log_weight(*at, residual);
      v += change;
    }
    return std::nullopt;
  }

 private:
  std::optional<double> log_weight(const MatchingObjective::Evaluation& at, const VectorXd& residual) const {
    const MatrixXd& jacobian = match_.jacobian;
    MatrixXd slope = observation_.projection * objective_.endpoint_changes(at.path());
    slope = MatrixXd(slope * jacobian.transpose());
    slope.diagonal().array() += 1;
    const Eigen::PartialPivLU<MatrixXd> lu(slope);
    if (lu.determinant() <= 0) return std::nullopt;
    const VectorXd eta = at.z - jacobian.transpose() * residual;
    const VectorXd image = jacobian * eta;
    const double drawn = 0.5 * (eta.squaredNorm() - image.dot(factors_.solve(image))) + half_log_determinant_ -
                         lu.matrixLU().diagonal().array().abs().log().sum();
    return drawn - 0.5 * (at.z.squaredNorm() + residual.squaredNorm()) - observation_.log_volume;
  }

  const MatchingObjective& objective_;
  const Observation& observation_;
  const Linearised& match_;
  VectorXd observable_;
  Eigen::LLT<MatrixXd> factors_;  // of I + JJᵀ
  double half_log_determinant_ = 0;
};

}  // namespace

ImportanceEstimate importance_sample(const MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, std::uint64_t seed) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  const Draws draws(objective, observation, match);
  const Index pairs = (samples + 1) / 2;
  Eigen::Matrix2Xd log_weights = Eigen::Matrix2Xd::Constant(2, pairs, kNone);
  ImportanceEstimate found;
  for (Index i = 0; i < pairs; ++i) {
    const VectorXd normals =
        standard_normals(seed, static_cast<std::uint64_t>(i), static_cast<int>(draws.normals()), 1);
    for (const Index sign : {0, 1}) {
      const auto log_weight = draws.log_weight(sign == 0 ? normals : VectorXd(-normals));
      if (log_weight) log_weights(sign, i) = *log_weight;
      if (!log_weight) ++found.lost;
    }
  }
  const double largest = log_weights.maxCoeff();
  if (!std::isfinite(largest)) return {kNone, 0, 0, found.lost};
  const Eigen::Array2Xd weights = (log_weights.array() - largest).exp();
  const Eigen::ArrayXd of_pairs = weights.colwise().mean();
  const double mean = of_pairs.mean();
  const auto count = static_cast<double>(pairs);
  found.log_evidence = largest + std::log(mean);
  found.variance = (of_pairs / mean - 1).square().sum() / (count * std::max(1.0, count - 1));
  found.effective_samples = weights.sum() * weights.sum() / weights.square().sum();
  return found;
}

}  // namespace pulson
