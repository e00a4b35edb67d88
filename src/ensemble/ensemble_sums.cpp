#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "pulson/ensemble/ensemble.hpp"

namespace pulson::ensemble {

void Moments::merge(const Moments& other) {
  if (other.count == 0) return;
  if (count == 0) {
    *this = other;
    return;
  }
  const auto own = static_cast<double>(count);
  const auto others = static_cast<double>(other.count);
  const Eigen::ArrayXd apart = other.mean - mean;
  mean += apart * (others / (own + others));
  squares += other.squares + apart.square() * (own * others / (own + others));
  count += other.count;
}

Eigen::ArrayXd Moments::variance() const {
  if (count < 2) return Eigen::ArrayXd::Constant(mean.size(), std::numeric_limits<double>::quiet_NaN());
  return squares / static_cast<double>(count - 1);
}

Eigen::ArrayXd Moments::standard_error() const { return (variance() / static_cast<double>(count)).sqrt(); }

Moments moments_of(const Eigen::ArrayXXd& x, const std::vector<bool>& used) {
  Moments moments{std::count(used.begin(), used.end(), true), Eigen::ArrayXd::Zero(x.cols()),
                  Eigen::ArrayXd::Zero(x.cols())};
  if (moments.count == 0) return moments;
  const auto add = [&](const Eigen::ArrayXXd& rows) {
    for (Eigen::Index c = 0; c < rows.cols(); ++c) {
      moments.mean[c] = rows.col(c).mean();
      moments.squares[c] = (rows.col(c) - moments.mean[c]).square().sum();
    }
  };
  if (moments.count == x.rows()) {
    add(x);
    return moments;
  }
  Eigen::ArrayXXd rows(moments.count, x.cols());
  Eigen::Index next = 0;
  for (Eigen::Index row = 0; row < x.rows(); ++row)
    if (used[static_cast<std::size_t>(row)]) rows.row(next++) = x.row(row);
  add(rows);
  return moments;
}

namespace {

void merge_each(std::vector<Moments>& all, const std::vector<Moments>& next) {
  for (std::size_t record = 0; record < all.size(); ++record) all[record].merge(next[record]);
}

void merge(MomentNode& node, const MomentNode& next) {
  merge_each(node.moments, next.moments);
  merge_each(node.pair_moments, next.pair_moments);
}

}  // namespace

void MomentTree::add(MomentNode node) {
  while (!nodes_.empty() && nodes_.back().level == node.level &&
         nodes_.back().first_block % (std::int64_t{2} << node.level) == 0) {
    merge(nodes_.back(), node);
    ++nodes_.back().level;
    node = std::move(nodes_.back());
    nodes_.pop_back();
  }
  nodes_.push_back(std::move(node));
}

MomentNode MomentTree::total() const {
  if (nodes_.empty()) return {};
  MomentNode total = nodes_.back();
  for (auto node = std::next(nodes_.rbegin()); node != nodes_.rend(); ++node) {
    MomentNode sum = *node;
    merge(sum, total);
    total = std::move(sum);
  }
  return total;
}

std::int64_t Histogram::total() const {
  return static_cast<std::int64_t>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
}

double Histogram::quantile(double probability) const {
  const double wanted = probability * static_cast<double>(total());
  double below = 0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    const auto here = static_cast<double>(counts[bin]);
    if (here > 0 && below + here >= wanted)
      return std::clamp(low + width() * (static_cast<double>(bin) + std::max(0.0, wanted - below) / here), smallest,
                        largest);
    below += here;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

DensityBars Histogram::bars(double tail, double most) const {
  const std::size_t begin = bin_of(quantile(tail));
  const std::size_t end = bin_of(quantile(1 - tail)) + 1;
  const auto joined = static_cast<std::size_t>(std::ceil(static_cast<double>(end - begin) / most));
  const double bar = width() * static_cast<double>(joined);
  DensityBars bars{{low + width() * static_cast<double>(begin)}, {}};
  for (std::size_t bin = begin; bin < end; bin += joined) {
    double count = 0;
    for (std::size_t i = bin; i < std::min(bin + joined, counts.size()); ++i) count += static_cast<double>(counts[i]);
    bars.values.push_back(count / (static_cast<double>(total()) * bar));
    bars.edges.push_back(bars.edges.back() + bar);
  }
  return bars;
}

void EnsembleSums::add_counts(const EnsembleSums& next) {
  samples += next.samples;
  paths.clean += next.paths.clean;
  paths.no_root += next.paths.no_root;
  paths.momentum_bound += next.paths.momentum_bound;
  paths.tie += next.paths.tie;
  crossing.at_end += next.crossing.at_end;
  crossing.ever += next.crossing.ever;
  for (std::size_t k = 0; k < crossing.pairs.size(); ++k) crossing.pairs[k] += next.crossing.pairs[k];
  momentum_error = std::max(momentum_error, next.momentum_error);
  largest_momentum = std::max(largest_momentum, next.largest_momentum);
  states.insert(states.end(), next.states.begin(), next.states.end());
}

void EnsembleSums::append(const EnsembleSums& next) {
  add_counts(next);
  for (const MomentNode& node : next.tree.nodes()) tree.add(node);
  const MomentNode total = tree.total();
  moments = total.moments;
  pair_moments = total.pair_moments;
  for (std::size_t record = 0; record < histograms.size(); ++record)
    for (std::size_t c = 0; c < histograms[record].size(); ++c) {
      Histogram& all = histograms[record][c];
      const Histogram& more = next.histograms[record][c];
      for (std::size_t bin = 0; bin < all.counts.size(); ++bin) all.counts[bin] += more.counts[bin];
      all.smallest = std::min(all.smallest, more.smallest);
      all.largest = std::max(all.largest, more.largest);
    }
}

Estimate EnsembleSums::crossing_probability() const {
  const auto clean = static_cast<double>(paths.clean);
  const double probability = static_cast<double>(crossing.at_end) / clean;
  const auto pairs = static_cast<double>(crossing.pairs[0] + crossing.pairs[1] + crossing.pairs[2]);
  if (pairs == 0) return {probability, std::sqrt(probability * (1 - probability) / clean)};
  double variance = 0;  // of the mean of a pair
  for (std::size_t k = 0; k <= 2; ++k) {
    const double mean = static_cast<double>(k) / 2;
    variance += static_cast<double>(crossing.pairs[k]) / pairs * (mean - probability) * (mean - probability);
  }
  return {probability, std::sqrt(variance / pairs)};
}

Eigen::ArrayXd EnsembleSums::mean_error(std::size_t record) const {
  return (pair_moments.empty() ? moments : pair_moments)[record].standard_error();
}

}  // namespace pulson::ensemble
