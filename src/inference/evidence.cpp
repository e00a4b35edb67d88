#include "evidence.hpp"

#include <cmath>
#include <limits>

#include "pulson/core/parallel.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostIterations = 1000;
constexpr double kSettled = 1e-10;
constexpr int kMostReference = 2000;

double square_sum(const ArrayXd& x) { return (x - x.mean()).square().sum() / static_cast<double>(x.size() - 1); }

}  // namespace

// With l = w/e^shift and estimate r: the mean over the reference of l/(s₁l + s₂r) over that over the posterior of
// 1/(s₁l + s₂r). −∞, where there is no path, is l = 0.
Estimate bridge(const VectorXd& posterior, const VectorXd& reference,
                const std::function<double(const VectorXd&)>& effective) {
  const double shift = posterior.mean();
  const ArrayXd l1 = (posterior.array() - shift).exp(), l2 = (reference.array() - shift).exp();
  // The weights of the optimal bridge, with effective numbers.
  double n1 = effective(posterior);
  if (!(n1 > 1)) n1 = static_cast<double>(l1.size());
  const auto n2 = static_cast<double>(l2.size());
  const double s1 = n1 / (n1 + n2), s2 = n2 / (n1 + n2);
  double r = 1;
  for (int i = 0; i < kMostIterations; ++i) {
    const double next = (l2 / (s1 * l2 + s2 * r)).mean() / (1 / (s1 * l1 + s2 * r)).mean();
    const bool settled = std::abs(next - r) <= kSettled * r;
    r = next;
    if (settled) break;
  }
  const ArrayXd f2 = (l2 / r) / (s1 * l2 / r + s2);  // of the reference
  const ArrayXd f1 = 1 / (s1 * l1 / r + s2);         // of the posterior
  const double of_reference = square_sum(f2) / (f2.mean() * f2.mean()) / n2;
  double count = effective(f1.matrix());
  if (!(count > 1)) count = static_cast<double>(f1.size());
  const double of_posterior = square_sum(f1) / (f1.mean() * f1.mean()) / count;
  return {shift + std::log(r), std::sqrt(of_reference + of_posterior)};
}

Estimate bridge_log_evidence(const ChainSetting& setting, const PosteriorDraws& draws) {
  const int count = std::min<int>(kMostReference, static_cast<int>(draws.log_weight.size()));
  VectorXd reference(count);
  parallel_for(count, [&](int i) { reference[i] = reference_log_weight(setting, static_cast<std::uint64_t>(i)); });
  if (!(reference.maxCoeff() > -std::numeric_limits<double>::infinity()))
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  return bridge(draws.log_weight, reference,
                [&](const VectorXd& values) { return effective_sample_size(draws.by_chain(values.transpose())); });
}

}  // namespace pulson::inference
