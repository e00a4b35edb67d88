#include <algorithm>
#include <cmath>
#include <vector>

#include "core/undefined.hpp"
#include "pulson/inference/diagnostics.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index kFewestOfTail = 5;

// k of a generalised Pareto law of positive numbers in increasing order: the posterior mean under the prior of Zhang
// and Stephens (2009), drawn towards 1/2 as ten more numbers would.
double generalised_pareto_k(const ArrayXd& x) {
  constexpr double kPrior = 3, kMore = 10;
  const auto n = static_cast<double>(x.size());
  const int places = 30 + static_cast<int>(std::sqrt(n));
  const double quartile = x[static_cast<Index>(std::floor(n / 4 + 0.5)) - 1];
  ArrayXd slopes(places), logs(places);
  for (int j = 0; j < places; ++j) {
    slopes[j] = 1 / x[x.size() - 1] + (1 - std::sqrt(places / (j + 0.5))) / (kPrior * quartile);
    const double k = (-slopes[j] * x).log1p().mean();
    logs[j] = n * (std::log(-slopes[j] / k) - k - 1);
  }
  const ArrayXd weights = (logs - logs.maxCoeff()).exp();
  const double slope = (weights * slopes).sum() / weights.sum();
  const double k = (-slope * x).log1p().mean();
  return (n * k + kMore * 0.5) / (n + kMore);
}

}  // namespace

double pareto_k(const VectorXd& log_weights) {
  const auto count = static_cast<double>(log_weights.size());
  const auto tail = static_cast<Index>(std::ceil(std::min(0.2 * count, 3 * std::sqrt(count))));
  if (tail < kFewestOfTail || tail >= log_weights.size()) return kUndefined;
  const double largest = log_weights.maxCoeff();
  if (!std::isfinite(largest)) return kUndefined;
  std::vector<double> weights;
  for (const double log_weight : log_weights) weights.push_back(std::exp(log_weight - largest));
  std::sort(weights.begin(), weights.end());
  const double cutoff = weights[weights.size() - static_cast<std::size_t>(tail) - 1];
  std::vector<double> beyond;
  for (std::size_t i = weights.size() - static_cast<std::size_t>(tail); i < weights.size(); ++i)
    if (weights[i] > cutoff) beyond.push_back(weights[i] - cutoff);
  // Weights that are alike to rounding have no tail; of those that are nearly all 0 nothing can be said.
  constexpr double kAlike = 1e-9;
  if (1 - cutoff < kAlike) return 0;
  if (std::ssize(beyond) < kFewestOfTail) return kUndefined;
  return generalised_pareto_k(ArrayXd::Map(beyond.data(), std::ssize(beyond)));
}

}  // namespace pulson::inference
