#include "importance.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "matching/momentum_basis.hpp"
#include "random/normals.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 40;
constexpr double kAccuracy =
    1e-2;  // of v, in standard deviations of the data; each weight is that of its z in any case

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

  Index normals() const { return observation_.count() + objective_.problem().source.size() + controls(); }

  // Of the evidence, where there is a path.
  // `v` is where the iteration begins and ends, if it has a size.
  std::optional<double> log_weight(const VectorXd& normals, VectorXd& v) const {
    const MatrixXd& jacobian = match_.jacobian;
    const VectorXd epsilon = normals.head(observation_.count());
    VectorXd zeta(jacobian.cols());
    zeta << white_momenta(normals.segment(epsilon.size(), objective_.problem().source.size())),
        normals.tail(controls());
    zeta.array() *= observable_.array();
    if (v.size() == 0) v = factors_.solve(VectorXd(epsilon + match_.innovation - jacobian * zeta));
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const VectorXd z = zeta + jacobian.transpose() * v;
      const auto at = objective_.evaluate(z);
      if (!at) break;
      const VectorXd residual = observation_.residual(at->path().final().q);
      const VectorXd change = factors_.solve(VectorXd(epsilon + residual - v));
      if (change.norm() <= kAccuracy) return log_weight(*at, residual);
      v += change;
    }
    v.resize(0);
    return std::nullopt;
  }

 private:
  Index controls() const { return match_.jacobian.cols() - objective_.basis().unknowns(); }

  // With λK = VDVᵀ at the pivots the unknowns are those of (λK)^-½ times these normals there: Vᵀ of them.
  VectorXd white_momenta(const VectorXd& normals) const {
    const Points& source = objective_.problem().source;
    const VectorXd eigenvalues = objective_.basis().eigenvalues();
    if (!eigenvalues.allFinite()) return normals.head(eigenvalues.size());
    const VectorXd pulled = objective_.basis().pull_back(normals.reshaped(source.rows(), source.cols()));
    return eigenvalues.cwiseSqrt().cwiseProduct(pulled);
  }

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

namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();

// Of the weights of pairs, 2×pairs.
ImportanceEstimate estimate(const Eigen::Ref<const Eigen::Matrix2Xd>& log_weights) {
  const double largest = log_weights.maxCoeff();
  const auto samples = static_cast<int>(log_weights.size());
  if (!std::isfinite(largest))
    return {largest, 0, samples, 0, samples, Eigen::VectorXd::Constant(samples / 2, largest)};
  const Eigen::Array2Xd weights = (log_weights.array() - largest).exp();
  const Eigen::ArrayXd of_pairs = weights.colwise().mean();
  const double mean = of_pairs.mean();
  const auto count = static_cast<double>(of_pairs.size());
  ImportanceEstimate found;
  found.variance = (of_pairs / mean - 1).square().sum() / (count * std::max(1.0, count - 1));
  found.log_evidence = largest + std::log(mean) + 0.5 * found.variance;
  found.samples = samples;
  found.effective_samples = weights.sum() * weights.sum() / weights.square().sum();
  found.log_pairs = largest + of_pairs.log();
  found.lost = static_cast<int>((log_weights.array() == kNone).count());
  return found;
}

}  // namespace

ImportanceEstimate importance_sample(const MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, double enough, std::uint64_t seed,
                                     std::vector<VectorXd>& begin) {
  constexpr Index kLeastPairs = 8;
  const Draws draws(objective, observation, match);
  const Index pairs = (samples + 1) / 2;
  begin.resize(static_cast<std::size_t>(2 * pairs));
  Eigen::Matrix2Xd log_weights = Eigen::Matrix2Xd::Constant(2, pairs, kNone);
  for (Index i = 0; i < pairs; ++i) {
    const VectorXd normals =
        standard_normals(seed, static_cast<std::uint64_t>(i), static_cast<int>(draws.normals()), 1);
    for (const Index sign : {0, 1}) {
      const auto log_weight =
          draws.log_weight(sign == 0 ? normals : VectorXd(-normals), begin[static_cast<std::size_t>(2 * i + sign)]);
      if (log_weight) log_weights(sign, i) = *log_weight;
    }
    if (i + 1 < kLeastPairs) continue;
    ImportanceEstimate so_far = estimate(log_weights.leftCols(i + 1));
    if (std::isfinite(so_far.log_evidence) && so_far.variance <= enough) return so_far;
  }
  return estimate(log_weights);
}

}  // namespace pulson
