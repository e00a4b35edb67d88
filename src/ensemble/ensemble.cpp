#include "pulson/ensemble/ensemble.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/core.h>

#include "core/text.hpp"
#include "path_sampler.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::ensemble {

namespace {

constexpr std::uint16_t kNoBin = std::numeric_limits<std::uint16_t>::max();

}  // namespace

/// What one block of paths adds to an ensemble.
class BlockSums {
 public:
  /// The first `lanes` paths of a block. The histograms' ranges are those that the ensemble has.
  BlockSums(const EnsembleOptions& options, const PhaseState& start,
            const std::vector<std::vector<Histogram>>& histograms, std::size_t lanes);

  /// Each record, in order.
  void take(std::size_t record, const LaneStates& states);
  /// After the last record.
  void finish(const LaneEnds& ends);

  /// But for the histograms.
  const EnsembleSums& sums() const { return sums_; }
  void add_to(std::vector<Histogram>& histograms, std::size_t record) const;

 private:
  void take_momenta(const LaneStates& states);
  void take_pairs(std::size_t record, const LaneStates& states);
  void take_bins(std::size_t record, const LaneStates& states);
  void keep(std::size_t record, const LaneStates& states);

  const EnsembleOptions& options_;
  const PhaseState& start_;
  const std::vector<std::vector<Histogram>>& histograms_;
  std::size_t lanes_;
  EnsembleSums sums_;
  struct Range {
    double smallest = std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
  };
  struct Bins {
    std::vector<std::uint16_t> of_lanes;  // [coordinate·kPathBatch + lane]
    std::vector<Range> ranges;            // [coordinate]
  };
  std::vector<Bins> bins_;   // [record]
  std::vector<bool> clean_;  // lanes, up to the record that was taken last
  PathLanes last_gap_{};
};

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
    clean_[lane] = states.running[lane] && states.largest_momentum[lane] <= options_.momentum_bound &&
                   states.values.row(static_cast<Eigen::Index>(lane)).allFinite();
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
    const bool within = ends.largest_momentum[lane] <= options_.momentum_bound;
    if (!within || (ends.reached_end[lane] && !clean_[lane])) {  // or the range of numbers is left
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

namespace {

constexpr std::size_t kBins = 512;
constexpr std::size_t kEnoughForRanges = 32;   // samples
constexpr std::int64_t kMostPilots = 64;       // blocks sampled for the ranges of histograms
constexpr std::int64_t kOfPilots = 5;          // all paths over those sampled for the ranges alone
constexpr std::int64_t kMostKept = 8'000'000;  // numbers of a pilot that is used again: 64 MB
constexpr std::int64_t kBatch = kBlockPaths;
static_assert(kBlockPaths == kPathBatch);

std::int64_t blocks_of(const EnsembleOptions& options) { return (options.samples + kBatch - 1) / kBatch; }

void check(const EnsembleOptions& options) {
  if (options.samples < 1) throw InputError(fmt::format("{} samples; at least one is needed", options.samples));
  if (options.antithetic && options.samples % 2 != 0)
    throw InputError(fmt::format("{} samples; antithetic paths come in pairs", options.samples));
  if (!(options.momentum_bound > 0))
    throw InputError(fmt::format("the momentum bound is {}; it must be greater than 0", options.momentum_bound));
  const Shard shard = options.shard;
  if (shard.count < 1 || shard.index < 1 || shard.index > shard.count)
    throw InputError(
        fmt::format("shard {} of {}: shards are counted from 1 to their number", shard.index, shard.count));
  if (shard.count > blocks_of(options))
    throw InputError(fmt::format("{} samples are {} of {} paths; there cannot be {} shards", options.samples,
                                 text::counted(static_cast<std::size_t>(blocks_of(options)), "block"), kBatch,
                                 shard.count));
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

/// Whether the tree holds the blocks of these samples from `first_path` on, and the moments are its total.
bool has_blocks(const EnsembleSums& sums, std::int64_t first_path) {
  std::int64_t block = first_path / kBatch;
  for (const MomentNode& node : sums.tree.nodes()) {
    if (node.first_block != block || node.moments.size() != sums.moments.size() ||
        node.pair_moments.size() != sums.pair_moments.size())
      return false;
    block = node.end_block();
  }
  return block == first_path / kBatch + (sums.samples + kBatch - 1) / kBatch;
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
  return std::all_of(sums.tree.nodes().begin(), sums.tree.nodes().end(), [&](const MomentNode& node) {
    return has_size(node.moments, coordinates) && has_size(node.pair_moments, coordinates);
  });
}

}  // namespace

std::int64_t EnsembleOptions::first_path() const { return blocks_of(*this) * (shard.index - 1) / shard.count * kBatch; }

std::int64_t EnsembleOptions::shard_samples() const {
  return std::min(blocks_of(*this) * shard.index / shard.count * kBatch, samples) - first_path();
}

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

namespace {

// Where it is more than a fifth of all, and not too large.
bool keeps_first_block(const EnsembleOptions& options, const PhaseState& start) {
  const std::int64_t numbers = kBatch * 2 * start.q.size() * std::ssize(options.records);
  return !options.histograms.empty() && options.samples < kOfPilots * kBatch && numbers <= kMostKept;
}

}  // namespace

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
  if (keeps_first_block(options_, start)) sampler_ = keep_first_block(std::move(sampler_));
  sums_.moments.resize(options_.records.size());
  if (options_.antithetic) sums_.pair_moments.resize(options_.records.size());
}

Ensemble::~Ensemble() = default;

std::string Ensemble::method() const { return sampler_->name(); }

void Ensemble::resume(EnsembleSums sums) {
  const std::int64_t all = options_.shard_samples();
  const bool whole_blocks = sums.samples % kBatch == 0 || sums.samples == all;
  bool fits = sums.samples >= 0 && sums.samples <= all && whole_blocks && sums.paths.total() == sums.samples &&
              has_blocks(sums, options_.first_path()) && sums.moments.size() == options_.records.size() &&
              sums.pair_moments.size() == sums_.pair_moments.size() &&
              static_cast<std::int64_t>(sums.states.size()) == sums.samples * options_.kept_numbers(start_);
  if (fits && sums.samples > 0) fits = records_fit(sums, options_, static_cast<std::size_t>(2 * start_.q.size()));
  if (!fits) throw InputError("the saved sums belong to another ensemble");
  sums_ = std::move(sums);
}

std::int64_t Ensemble::blocks() const { return (options_.shard_samples() + kBatch - 1) / kBatch; }

std::int64_t Ensemble::blocks_done() const { return (sums_.samples + kBatch - 1) / kBatch; }

void Ensemble::advance(int blocks) {
  const std::int64_t first = blocks_done();
  const std::int64_t count = std::min<std::int64_t>(blocks, this->blocks() - first);
  std::vector<EnsembleSums> pieces(static_cast<std::size_t>(std::min<std::int64_t>(count, thread_count())));
  const auto begin = [&](std::size_t piece) {
    return first + static_cast<std::int64_t>(piece) * count / std::ssize(pieces);
  };
  parallel_for(static_cast<int>(pieces.size()), [&](int i) {
    const auto piece = static_cast<std::size_t>(i);
    pieces[piece] = sample(begin(piece), begin(piece + 1) - begin(piece));
  });
  for (const EnsembleSums& piece : pieces) append(piece);
}

EnsembleSums Ensemble::sample(std::int64_t first, std::int64_t count) const {
  EnsembleSums sums;
  sums.histograms = empty_histograms();
  for (std::int64_t block = first; block < first + count; ++block) {
    const std::int64_t begin = options_.first_path() + block * kBatch;
    const auto lanes = static_cast<std::size_t>(std::min(kBatch, options_.samples - begin));
    BlockSums one(options_, start_, sums.histograms, lanes);
    const PathSampler::Sink take = [&](std::size_t record, const LaneStates& states) { one.take(record, states); };
    one.finish(sampler_->sample(static_cast<std::uint64_t>(begin), lanes, take));
    sums.tree.add({begin / kBatch, 0, one.sums().moments, one.sums().pair_moments});
    sums.add_counts(one.sums());
    for (std::size_t record = 0; record < sums.histograms.size(); ++record) one.add_to(sums.histograms[record], record);
  }
  return sums;
}

void Ensemble::append(const EnsembleSums& next) {
  if (next.samples == 0) return;
  if (sums_.samples == 0) sums_.histograms = empty_histograms();
  sums_.append(next);
}

const Ensemble::Histograms& Ensemble::empty_histograms() const {
  std::call_once(has_histograms_, [&] {
    histograms_ = sums_.samples > 0 ? sums_.histograms : pilot_histograms();
    for (std::vector<Histogram>& record : histograms_)
      for (Histogram& histogram : record) {
        const Histogram empty;
        histogram.counts.assign(kBins, 0);
        histogram.smallest = empty.smallest;
        histogram.largest = empty.largest;
      }
  });
  return histograms_;
}

// Those of the first block, which is sampled once more unless the sampler keeps it; where few of its paths are clean,
// of more blocks, up to a fifth of all.
Ensemble::Histograms Ensemble::pilot_histograms() const {
  const auto coordinates = static_cast<std::size_t>(2 * start_.q.size());
  std::vector<std::vector<std::vector<double>>> values(options_.records.size());  // [record][coordinate]
  for (std::size_t record = 0; record < values.size(); ++record)
    if (std::binary_search(options_.histograms.begin(), options_.histograms.end(), options_.records[record]))
      values[record].resize(coordinates);
  const auto few = [](const auto& record) { return !record.empty() && record.front().size() < kEnoughForRanges; };
  if (options_.histograms.empty()) return Histograms(options_.records.size());
  const auto lanes = static_cast<std::size_t>(std::min(kBatch, options_.samples));
  const std::int64_t most = std::clamp<std::int64_t>(options_.samples / kOfPilots / kBatch, 1, kMostPilots);
  for (std::int64_t block = 0; block < most; ++block) {
    sampler_->sample(static_cast<std::uint64_t>(block * kBatch), lanes,
                     [&](std::size_t record, const LaneStates& states) {
                       for (std::size_t lane = 0; lane < lanes; ++lane)
                         if (states.running[lane] && states.largest_momentum[lane] <= options_.momentum_bound &&
                             states.values.row(static_cast<Eigen::Index>(lane)).allFinite())
                           for (std::size_t c = 0; c < values[record].size(); ++c)
                             values[record][c].push_back(
                                 states.values(static_cast<Eigen::Index>(lane), static_cast<Eigen::Index>(c)));
                     });
    if (std::none_of(values.begin(), values.end(), few)) break;
  }
  Histograms histograms(options_.records.size());
  for (std::size_t record = 0; record < values.size(); ++record)
    for (std::vector<double>& of_coordinate : values[record])
      histograms[record].push_back(histogram_for(std::move(of_coordinate)));
  return histograms;
}

}  // namespace pulson::ensemble
