#include "pulson/inference/diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double normal_quantile(double p) {
  constexpr double kA[] = {-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                           1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr double kB[] = {-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02, 6.680131188771972e+01,
                           -1.328068155288572e+01};
  constexpr double kC[] = {-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                           -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr double kD[] = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00, 3.754408661907416e+00};
  constexpr double kTail = 0.02425;
  if (p > 0.5) return -normal_quantile(1 - p);
  double x = 0;
  if (p < kTail) {
    const double q = std::sqrt(-2 * std::log(p));
    x = (((((kC[0] * q + kC[1]) * q + kC[2]) * q + kC[3]) * q + kC[4]) * q + kC[5]) /
        ((((kD[0] * q + kD[1]) * q + kD[2]) * q + kD[3]) * q + 1);
  } else {
    const double q = p - 0.5, r = q * q;
    x = (((((kA[0] * r + kA[1]) * r + kA[2]) * r + kA[3]) * r + kA[4]) * r + kA[5]) * q /
        (((((kB[0] * r + kB[1]) * r + kB[2]) * r + kB[3]) * r + kB[4]) * r + 1);
  }
  const double e = normal_probability(x) - p;
  const double u = e * std::sqrt(2 * std::numbers::pi) * std::exp(0.5 * x * x);
  return x - u / (1 + 0.5 * x * u);
}

namespace {

constexpr Index kFewest = 4;
// Half chains that are shorter have no pair of lags from which their autocorrelation could be judged, and would count
// as independent draws.
constexpr Index kFewestOfHalf = 6;

bool usable(const MatrixXd& draws) {
  return draws.rows() >= kFewest && draws.cols() > 0 && draws.allFinite() && draws.maxCoeff() > draws.minCoeff();
}

// Each chain in two halves, without the middle draw of an odd number.
MatrixXd halves(const MatrixXd& draws) {
  const Index half = draws.rows() / 2;
  MatrixXd split(half, 2 * draws.cols());
  split << draws.topRows(half), draws.bottomRows(half);
  return split;
}

// Normal scores of the ranks, equal values at the mean of theirs (14).
MatrixXd rank_normalised(const MatrixXd& draws) {
  const Index count = draws.size();
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Index(0));
  const auto values = draws.reshaped();
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return values[a] < values[b]; });
  MatrixXd scores(draws.rows(), draws.cols());
  for (Index first = 0; first < count;) {
    Index end = first + 1;
    const double value = values[order[static_cast<std::size_t>(first)]];
    while (end < count && values[order[static_cast<std::size_t>(end)]] == value) ++end;
    const double rank = 0.5 * static_cast<double>(first + 1 + end);
    const double score = normal_quantile((rank - 0.375) / (static_cast<double>(count) + 0.25));
    for (; first < end; ++first) scores.reshaped()[order[static_cast<std::size_t>(first)]] = score;
  }
  return scores;
}

double variance(const VectorXd& x) { return (x.array() - x.mean()).square().sum() / static_cast<double>(x.size() - 1); }

// (3), of chains that are split already.
double rhat_of(const MatrixXd& chains) {
  const auto n = static_cast<double>(chains.rows());
  VectorXd variances(chains.cols());
  for (Index m = 0; m < chains.cols(); ++m) variances[m] = variance(chains.col(m));
  const double within = variances.mean();
  const double between = variance(chains.colwise().mean().transpose());
  return std::sqrt((within * (n - 1) / n + between) / within);
}

// The mean over chains of the autocovariances at one lag, divided by n.
double autocovariance(const MatrixXd& centred, Index lag) {
  const Index n = centred.rows();
  return centred.topRows(n - lag).cwiseProduct(centred.bottomRows(n - lag)).sum() /
         static_cast<double>(n * centred.cols());
}

// (10)–(11), of chains that are split already.
double ess_of(const MatrixXd& chains) {
  if (!usable(chains) || chains.rows() < kFewestOfHalf) return kUndefined;
  const Index n = chains.rows();
  const auto length = static_cast<double>(n);
  const auto all = static_cast<double>(chains.size());
  const MatrixXd centred = chains.rowwise() - chains.colwise().mean();
  const double within = autocovariance(centred, 0) * length / (length - 1);
  double total = within * (length - 1) / length;
  if (chains.cols() > 1) total += variance(chains.colwise().mean().transpose());
  const auto rho = [&](Index lag) { return 1 - (within - autocovariance(centred, lag)) / total; };
  // Sums of neighbouring pairs, which are positive and do not increase.
  double sum = 0, last = 1 + rho(1), even = 0;
  Index lag = 0;
  for (double pair = last; lag < n - 5 && pair > 0; lag += 2) {
    sum += std::min(pair, last);
    last = std::min(pair, last);
    even = rho(lag + 2);
    pair = even + rho(lag + 3);
  }
  const double tau = std::max(-1 + 2 * sum + std::max(even, 0.0), 1 / std::log10(all));
  return all / tau;
}

double indicator_ess(const MatrixXd& draws, double probability) {
  const double limit = quantile(draws, probability);
  return ess_of(halves((draws.array() <= limit).cast<double>().matrix()));
}

}  // namespace

double rank_rhat(const MatrixXd& draws) {
  if (!usable(draws)) return kUndefined;
  const MatrixXd folded = (draws.array() - quantile(draws, 0.5)).abs();
  const double bulk = rhat_of(rank_normalised(halves(draws)));
  return usable(folded) ? max_or_undefined(bulk, rhat_of(rank_normalised(halves(folded)))) : kUndefined;
}

double effective_sample_size(const MatrixXd& draws) { return usable(draws) ? ess_of(halves(draws)) : kUndefined; }

double bulk_ess(const MatrixXd& draws) { return usable(draws) ? ess_of(rank_normalised(halves(draws))) : kUndefined; }

double tail_ess(const MatrixXd& draws) {
  if (!usable(draws)) return kUndefined;
  return min_or_undefined(indicator_ess(draws, 0.05), indicator_ess(draws, 0.95));
}

double quantile(const MatrixXd& draws, double probability) {
  if (draws.size() == 0) return kUndefined;
  std::vector<double> values(draws.data(), draws.data() + draws.size());
  const double place = probability * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), at, values.end());
  if (below + 1 == values.size()) return *at;
  const double above = *std::min_element(at + 1, values.end());
  return *at + (place - static_cast<double>(below)) * (above - *at);
}

DrawSummary summarise(const MatrixXd& draws) {
  DrawSummary summary;
  summary.mean = draws.mean();
  summary.sd = draws.size() > 1 ? std::sqrt(variance(draws.reshaped())) : kUndefined;
  summary.mcse = summary.sd / std::sqrt(effective_sample_size(draws));
  summary.rhat = rank_rhat(draws);
  summary.ess_bulk = bulk_ess(draws);
  summary.ess_tail = tail_ess(draws);
  summary.q05 = quantile(draws, 0.05);
  summary.q50 = quantile(draws, 0.5);
  summary.q95 = quantile(draws, 0.95);
  return summary;
}

}  // namespace pulson::inference
