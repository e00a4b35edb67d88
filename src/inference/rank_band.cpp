#include <algorithm>
#include <cmath>
#include <vector>

#include "pulson/inference/posterior.hpp"
#include "rank_statistics.hpp"

namespace pulson::inference {
namespace {

// log of the binomial probabilities of 0 … n.
std::vector<double> log_binomial(int n, double p) {
  std::vector<double> logs(static_cast<std::size_t>(n) + 1);
  for (int c = 0; c <= n; ++c)
    logs[static_cast<std::size_t>(c)] = std::lgamma(n + 1.0) - std::lgamma(c + 1.0) - std::lgamma(n - c + 1.0) +
                                        (c > 0 ? c * std::log(p) : 0) + (c < n ? (n - c) * std::log1p(-p) : 0);
  return logs;
}

// Twice the smaller tail of each count, the count itself included.
std::vector<double> two_sided(int n, double p) {
  std::vector<double> tails(static_cast<std::size_t>(n) + 1, 1);
  if (p >= 1) {
    for (int c = 0; c < n; ++c) tails[static_cast<std::size_t>(c)] = 0;
    return tails;
  }
  const std::vector<double> logs = log_binomial(n, p);
  std::vector<double> below(logs.size()), above(logs.size());
  double sum = 0;
  for (std::size_t c = 0; c < logs.size(); ++c) below[c] = sum += std::exp(logs[c]);
  sum = 0;
  for (std::size_t c = logs.size(); c-- > 0;) above[c] = sum += std::exp(logs[c]);
  for (std::size_t c = 0; c < logs.size(); ++c) tails[c] = 2 * std::min(below[c], above[c]);
  return tails;
}

// The counts whose two-sided probability is greater than γ.
RankBand band_of(int simulations, int ranks, double gamma) {
  RankBand band{gamma, {}, {}};
  for (int i = 0; i <= ranks; ++i) {
    const std::vector<double> tails = two_sided(simulations, (i + 1.0) / (ranks + 1.0));
    int low = 0, high = simulations;
    while (low < simulations && tails[static_cast<std::size_t>(low)] <= gamma) ++low;
    while (high > 0 && tails[static_cast<std::size_t>(high)] <= gamma) --high;
    band.lower.push_back(low);
    band.upper.push_back(high);
  }
  return band;
}

}  // namespace

// The counts of ranks ≤ i are a Markov chain: given C_i = c, C_{i+1} − c ~ Bin(n − c, 1/(L − i)).
double band_probability(const std::vector<int>& lower, const std::vector<int>& upper, int simulations) {
  const int ranks = static_cast<int>(lower.size()) - 1;
  std::vector<double> now(static_cast<std::size_t>(simulations) + 1, 0);
  now[0] = 1;
  for (int i = 0; i <= ranks; ++i) {
    const auto at = static_cast<std::size_t>(i);
    std::vector<double> next(now.size(), 0);
    for (int c = 0; c <= simulations; ++c) {
      const double mass = now[static_cast<std::size_t>(c)];
      if (mass == 0) continue;
      if (i == ranks) {
        next[static_cast<std::size_t>(simulations)] += mass;
        continue;
      }
      const std::vector<double> logs = log_binomial(simulations - c, 1.0 / (ranks + 1.0 - i));
      for (int more = std::max(0, lower[at] - c); c + more <= upper[at]; ++more)
        next[static_cast<std::size_t>(c + more)] += mass * std::exp(logs[static_cast<std::size_t>(more)]);
    }
    if (i == ranks && (lower[at] > simulations || upper[at] < simulations)) return 0;
    now = std::move(next);
  }
  return now[static_cast<std::size_t>(simulations)];
}

RankBand rank_band(int simulations, int ranks, double level) {
  double none = 0, too_much = 1 - level;  // γ
  if (band_probability(band_of(simulations, ranks, too_much).lower, band_of(simulations, ranks, too_much).upper,
                       simulations) >= level)
    return band_of(simulations, ranks, too_much);
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (none + too_much);
    const RankBand band = band_of(simulations, ranks, middle);
    (band_probability(band.lower, band.upper, simulations) >= level ? none : too_much) = middle;
  }
  return band_of(simulations, ranks, none);
}

std::vector<int> rank_counts(const std::vector<int>& ranks, int largest) {
  std::vector<int> counts(static_cast<std::size_t>(largest) + 1, 0);
  for (const int rank : ranks) ++counts[static_cast<std::size_t>(rank)];
  for (std::size_t i = 1; i < counts.size(); ++i) counts[i] += counts[i - 1];
  return counts;
}

double rank_p_value(const std::vector<int>& counts) {
  const int simulations = counts.back(), ranks = static_cast<int>(counts.size()) - 1;
  double least = 1;
  for (int i = 0; i < ranks; ++i)
    least = std::min(
        least, two_sided(simulations,
                         (i + 1.0) / (ranks + 1.0))[static_cast<std::size_t>(counts[static_cast<std::size_t>(i)])]);
  const RankBand inside = band_of(simulations, ranks, least);
  return std::max(0.0, 1 - band_probability(inside.lower, inside.upper, simulations));  // a sum that rounds
}

}  // namespace pulson::inference
