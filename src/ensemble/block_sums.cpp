#include "block_sums.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pulson {
namespace {

constexpr std::uint16_t kNoBin = std::numeric_limits<std::uint16_t>::max();

}  // namespace

BlockSums::BlockSums(const EnsembleOptions& options, const PhaseState& start,
                     const std::vector<std::vector<Histogram>>& histograms, std::size_t lanes)
    : options_(options),
      start_(start),
      histograms_(histograms),
      lanes_(lanes),
      bins_(options.records.size()),
      clean_(kPathBatch) {
  sums_.moments.resize(options.records.size());
  if (options.antithetic) sums_.pair_moments.resize(options.records.size());
  sums_.states.assign(lanes * static_cast<std::size_t>(options.kept_numbers(start)),
                      std::numeric_limits<double>::quiet_NaN());
}

void BlockSums::take(std::size_t record, const LaneStates& states) {
  for (std::size_t lane = 0; lane < lanes_; ++lane)
    clean_[lane] = states.running[lane] && states.largest_momentum[lane] <= options_.momentum_bound;
  sums_.moments[record] = moments_of(states.values, clean_);
  take_momenta(states);
  if (options_.antithetic) take_pairs(record, states);
  take_bins(record, states);
  const bool last = record + 1 == options_.records.size();
  if (last) last_gap_ = states.smallest_gap;
  if (options_.keep == KeepStates::kAll || (options_.keep == KeepStates::kFinal && last)) keep(record, states);
}

void BlockSums::take_momenta(const LaneStates& states) {
  const Eigen::Index d = start_.p.rows();
  const Eigen::VectorXd total = start_.p.rowwise().sum();
  const double size = start_.p.colwise().norm().sum();
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(states.values.rows());
  for (Eigen::Index axis = 0; axis < d; ++axis) {
    Eigen::ArrayXd sum = states.values.col(start_.p.size() + axis);
    for (Eigen::Index i = axis + d; i < start_.p.size(); i += d) sum += states.values.col(start_.p.size() + i);
    squares += (sum - total[axis]).square();
  }
  for (std::size_t lane = 0; lane < lanes_; ++lane)
    if (clean_[lane])
      sums_.momentum_error =
          std::max(sums_.momentum_error, std::sqrt(squares[static_cast<Eigen::Index>(lane)]) / (size > 0 ? size : 1));
}

void BlockSums::take_pairs(std::size_t record, const LaneStates& states) {
  Eigen::ArrayXXd means(kPathBatch / 2, states.values.cols());
  std::vector<bool> both(kPathBatch / 2);
  for (std::size_t pair = 0; pair < both.size(); ++pair) {
    const auto row = static_cast<Eigen::Index>(pair);
    means.row(row) = (states.values.row(2 * row) + states.values.row(2 * row + 1)) / 2;
    both[pair] = clean_[2 * pair] && clean_[2 * pair + 1];
  }
  sums_.pair_moments[record] = moments_of(means, both);
}

void BlockSums::take_bins(std::size_t record, const LaneStates& states) {
  const std::vector<Histogram>& histograms = histograms_[record];
  Bins& bins = bins_[record];
  bins.of_lanes.assign(histograms.size() * kPathBatch, kNoBin);
  bins.ranges.resize(histograms.size());
  for (std::size_t c = 0; c < histograms.size(); ++c) {
    const double* const x = states.values.col(static_cast<Eigen::Index>(c)).data();
    const Histogram& histogram = histograms[c];
    std::uint16_t* const bin = bins.of_lanes.data() + c * kPathBatch;
    Range& range = bins.ranges[c];
    for (std::size_t lane = 0; lane < lanes_; ++lane) {
      if (!clean_[lane]) continue;
      bin[lane] = static_cast<std::uint16_t>(histogram.bin_of(x[lane]));
      range.smallest = std::min(range.smallest, x[lane]);
      range.largest = std::max(range.largest, x[lane]);
    }
  }
}

void BlockSums::keep(std::size_t record, const LaneStates& states) {
  const auto coordinates = static_cast<std::size_t>(states.values.cols());
  const std::size_t records = sums_.states.size() / lanes_ / coordinates;
  if (records == 1) record = 0;
  for (std::size_t lane = 0; lane < lanes_; ++lane)
    for (std::size_t c = 0; c < coordinates; ++c)
      if (clean_[lane])
        sums_.states[(lane * records + record) * coordinates + c] =
            states.values(static_cast<Eigen::Index>(lane), static_cast<Eigen::Index>(c));
}

void BlockSums::finish(const LaneEnds& ends) {
  sums_.samples = static_cast<std::int64_t>(lanes_);
  std::array<bool, kPathBatch> crossed{};
  for (std::size_t lane = 0; lane < lanes_; ++lane) {
    sums_.largest_momentum = std::max(sums_.largest_momentum, ends.largest_momentum[lane]);
    if (ends.largest_momentum[lane] > options_.momentum_bound) {
      ++sums_.paths.momentum_bound;
    } else if (!ends.reached_end[lane]) {
      ++sums_.paths.no_root;
    } else if (last_gap_[lane] == 0) {
      ++sums_.paths.tie;
      clean_[lane] = false;
    } else {
      ++sums_.paths.clean;
      crossed[lane] = last_gap_[lane] < 0;
      sums_.crossing.at_end += crossed[lane] ? 1 : 0;
      sums_.crossing.ever += ends.smallest_gap[lane] < 0 ? 1 : 0;
    }
  }
  if (!options_.antithetic) return;
  for (std::size_t lane = 0; lane + 1 < lanes_; lane += 2)
    if (clean_[lane] && clean_[lane + 1])
      ++sums_.crossing.pairs.at((crossed[lane] ? 1U : 0U) + (crossed[lane + 1] ? 1U : 0U));
}

void BlockSums::add_to(std::vector<Histogram>& histograms, std::size_t record) const {
  const Bins& bins = bins_[record];
  for (std::size_t c = 0; c < histograms.size(); ++c) {
    for (std::size_t lane = 0; lane < kPathBatch; ++lane)
      if (const std::uint16_t bin = bins.of_lanes[c * kPathBatch + lane]; bin != kNoBin) ++histograms[c].counts[bin];
    histograms[c].smallest = std::min(histograms[c].smallest, bins.ranges[c].smallest);
    histograms[c].largest = std::max(histograms[c].largest, bins.ranges[c].largest);
  }
}

}  // namespace pulson
