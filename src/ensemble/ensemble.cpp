#include "pulson/ensemble/ensemble.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/core.h>

#include "block_sums.hpp"
#include "core/number_checks.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

constexpr std::size_t kBins = 512;
constexpr std::size_t kEnoughForRanges = 32;  // samples
constexpr std::int64_t kMostPilots = 64;      // blocks sampled for the ranges of histograms
constexpr auto kBatch = static_cast<std::int64_t>(kPathBatch);

void check(const EnsembleOptions& options) {
  if (options.samples < 1) throw InputError(fmt::format("{} samples; at least one is needed", options.samples));
  if (options.antithetic && options.samples % 2 != 0)
    throw InputError(fmt::format("{} samples; antithetic paths come in pairs", options.samples));
  if (!(options.momentum_bound > 0))
    throw InputError(fmt::format("the momentum bound is {}; it must be greater than 0", options.momentum_bound));
}

/// Room for most samples around the middle nine tenths of those of the first block.
Histogram histogram_for(std::vector<double> values) {
  Histogram histogram;
  histogram.counts.assign(kBins, 0);
  if (values.empty()) return histogram;
  std::sort(values.begin(), values.end());
  const double low = values[values.size() / 20];
  const double high = values[values.size() - 1 - values.size() / 20];
  const double least = 1e-9 * std::max({std::abs(low), std::abs(high), 1.0});
  const double margin = std::max(1.5 * (high - low), least);
  histogram.low = low - margin;
  histogram.high = high + margin;
  return histogram;
}

bool has_size(const std::vector<Moments>& moments, std::size_t coordinates) {
  return std::all_of(moments.begin(), moments.end(), [&](const Moments& m) {
    return m.count == 0 ||
           (static_cast<std::size_t>(m.mean.size()) == coordinates && m.squares.size() == m.mean.size());
  });
}

/// Whether the sums at each record are of so many coordinates, and have histograms where these are wanted.
bool records_fit(const EnsembleSums& sums, const EnsembleOptions& options, std::size_t coordinates) {
  if (sums.histograms.size() != options.records.size()) return false;
  for (std::size_t record = 0; record < options.records.size(); ++record) {
    const bool wanted =
        std::binary_search(options.histograms.begin(), options.histograms.end(), options.records[record]);
    const std::vector<Histogram>& histograms = sums.histograms[record];
    if (histograms.size() != (wanted ? coordinates : 0)) return false;
    for (const Histogram& histogram : histograms)
      if (histogram.counts.size() != kBins) return false;
  }
  return has_size(sums.moments, coordinates) && has_size(sums.pair_moments, coordinates);
}

}  // namespace

std::int64_t EnsembleOptions::kept_numbers(const PhaseState& start) const {
  if (keep == KeepStates::kNone) return 0;
  return 2 * start.q.size() * (keep == KeepStates::kFinal ? 1 : static_cast<std::int64_t>(records.size()));
}

std::vector<int> spread_steps(const TimeGrid& grid, int most) {
  const int pieces = std::min(most - 1, grid.steps);
  std::vector<int> steps;
  for (int i = 0; i <= pieces; ++i) steps.push_back(static_cast<int>(std::int64_t{grid.steps} * i / pieces));
  return steps;
}

Ensemble::Ensemble(const StochasticSystem& system, const std::string& integrator, const PhaseState& start,
                   EnsembleOptions options)
    : start_(start), options_(std::move(options)) {
  check(options_);
  require_size("the momenta at the start", start.p, start.q.rows(), start.q.cols());
  if (options_.records.empty() || options_.records.back() != options_.grid.steps)
    options_.records.push_back(options_.grid.steps);
  sampler_ =
      make_path_sampler(system, integrator, start,
                        {options_.grid, options_.seed, options_.antithetic, options_.momentum_bound, options_.records});
  sums_.moments.resize(options_.records.size());
  if (options_.antithetic) sums_.pair_moments.resize(options_.records.size());
}

Ensemble::~Ensemble() = default;

std::string Ensemble::method() const { return sampler_->name(); }

void Ensemble::resume(EnsembleSums sums) {
  const bool whole_blocks = sums.samples % kBatch == 0 || sums.samples == options_.samples;
  bool fits = sums.samples >= 0 && sums.samples <= options_.samples && whole_blocks &&
              sums.paths.total() == sums.samples && sums.moments.size() == options_.records.size() &&
              sums.pair_moments.size() == sums_.pair_moments.size() &&
              static_cast<std::int64_t>(sums.states.size()) == sums.samples * options_.kept_numbers(start_);
  if (fits && sums.samples > 0) fits = records_fit(sums, options_, static_cast<std::size_t>(2 * start_.q.size()));
  if (!fits) throw InputError("the saved sums belong to another ensemble");
  sums_ = std::move(sums);
}

void Ensemble::advance(int blocks) {
  if (sums_.samples == 0 && !done()) make_histograms();
  const std::int64_t first = sums_.samples;
  const std::int64_t left = (options_.samples - first + kBatch - 1) / kBatch;
  std::vector<std::optional<BlockSums>> done(static_cast<std::size_t>(std::min<std::int64_t>(blocks, left)));
  parallel_for(static_cast<int>(done.size()), [&](int i) {
    const std::int64_t begin = first + i * kBatch;
    const auto lanes = static_cast<std::size_t>(std::min(kBatch, options_.samples - begin));
    BlockSums block(options_, start_, sums_.histograms, lanes);
    const LaneEnds ends =
        sampler_->sample(static_cast<std::uint64_t>(begin),
                         [&](std::size_t record, const LaneStates& states) { block.take(record, states); });
    block.finish(ends);
    done[static_cast<std::size_t>(i)].emplace(std::move(block));
  });
  for (const auto& block : done) add(*block);
}

// The first block is sampled once more, for the ranges alone; where few of its paths are clean, more of them.
void Ensemble::make_histograms() {
  const auto coordinates = static_cast<std::size_t>(2 * start_.q.size());
  std::vector<std::vector<std::vector<double>>> values(options_.records.size());  // [record][coordinate]
  for (std::size_t record = 0; record < values.size(); ++record)
    if (std::binary_search(options_.histograms.begin(), options_.histograms.end(), options_.records[record]))
      values[record].resize(coordinates);
  const auto few = [](const auto& record) { return !record.empty() && record.front().size() < kEnoughForRanges; };
  for (std::int64_t block = 0; block < kMostPilots && block * kBatch < options_.samples; ++block) {
    sampler_->sample(static_cast<std::uint64_t>(block * kBatch), [&](std::size_t record, const LaneStates& states) {
      for (std::size_t lane = 0; lane < kPathBatch; ++lane)
        if (states.running[lane] && states.largest_momentum[lane] <= options_.momentum_bound)
          for (std::size_t c = 0; c < values[record].size(); ++c)
            values[record][c].push_back(states.values(static_cast<Eigen::Index>(lane), static_cast<Eigen::Index>(c)));
    });
    if (std::none_of(values.begin(), values.end(), few)) break;
  }
  sums_.histograms.assign(options_.records.size(), {});
  for (std::size_t record = 0; record < values.size(); ++record)
    for (std::vector<double>& of_coordinate : values[record])
      sums_.histograms[record].push_back(histogram_for(std::move(of_coordinate)));
}

void Ensemble::add(const BlockSums& block) {
  const EnsembleSums& more = block.sums();
  sums_.samples += more.samples;
  sums_.paths.clean += more.paths.clean;
  sums_.paths.no_root += more.paths.no_root;
  sums_.paths.momentum_bound += more.paths.momentum_bound;
  sums_.paths.tie += more.paths.tie;
  sums_.crossing.at_end += more.crossing.at_end;
  sums_.crossing.ever += more.crossing.ever;
  for (std::size_t k = 0; k < more.crossing.pairs.size(); ++k) sums_.crossing.pairs[k] += more.crossing.pairs[k];
  sums_.momentum_error = std::max(sums_.momentum_error, more.momentum_error);
  sums_.largest_momentum = std::max(sums_.largest_momentum, more.largest_momentum);
  for (std::size_t record = 0; record < more.moments.size(); ++record) {
    sums_.moments[record].merge(more.moments[record]);
    if (options_.antithetic) sums_.pair_moments[record].merge(more.pair_moments[record]);
    block.add_to(sums_.histograms[record], record);
  }
  sums_.states.insert(sums_.states.end(), more.states.begin(), more.states.end());
}

}  // namespace pulson
