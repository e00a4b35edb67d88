#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/estimate.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::ensemble {

/// How a sample path ended.
enum class PathStatus {
  kClean,
  kNoRoot,         ///< a step's equation had no unique root, or the state left the range of numbers
  kMomentumBound,  ///< some |p_a| passed the bound
};

/// `clean`, `no_root`, `momentum_bound`.
std::string path_status_name(PathStatus status);

/// One sample path, up to its end or to where it could not be followed.
struct SamplePath {
  Trajectory path;
  PathStatus status = PathStatus::kClean;
  std::string reason;          ///< why it ended early; empty for a clean path
  double largest_momentum{};   ///< max |p_a| over landmarks and time
  double momentum_error{};     ///< max over time of the change of total momentum, relative to Σ|p_a(0)| (or 1 at rest)
  double contraction_bound{};  ///< largest κ of its steps; from sample_paths() alone, as Monte Carlo has no use for it
};

inline constexpr double kMomentumBound = 1e8;  ///< by default, a path with a larger momentum counts as lost

/// The path of these increments, as far as it can be followed.
SamplePath sample_path(const StochasticSystem& system, const Integrator& integrator, const PhaseState& start,
                       const TimeGrid& grid, const Eigen::MatrixXd& increments, double momentum_bound = kMomentumBound);

struct SamplePathsOptions {
  TimeGrid grid{};
  std::uint64_t seed = 1;
  int samples = 1;
  double momentum_bound = kMomentumBound;
};

/// Sample paths number 0 … samples − 1 of a system from one start: the increments of path m are
/// brownian_increments(seed, m). Paths are independent tasks, so the result has the same bits for any number of
/// threads. @throws InputError if the noise or the integrator refuse the start
std::vector<SamplePath> sample_paths(const StochasticSystem& system, const Integrator& integrator,
                                     const PhaseState& start, const SamplePathsOptions& options);

/// Count, mean and sum of squared deviations of several numbers that are sampled together.
struct Moments {
  std::int64_t count = 0;
  Eigen::ArrayXd mean;
  Eigen::ArrayXd squares;  ///< Σ (x − mean)²

  /// As if the samples of `other` had come after these: T. Chan, G. Golub, R. LeVeque, Updating formulae and a pairwise
  /// algorithm for computing sample variances (1979).
  void merge(const Moments& other);
  /// Squared deviations over count − 1; NaN for fewer than two samples.
  Eigen::ArrayXd variance() const;
  /// Of the mean.
  Eigen::ArrayXd standard_error() const;
};

/// Moments of the rows of x that are to be used.
Moments moments_of(const Eigen::ArrayXXd& x, const std::vector<bool>& used);

/// A density, constant between edges.
struct DensityBars {
  std::vector<double> edges;   ///< n + 1
  std::vector<double> values;  ///< n
};

/// Counts of one number in equal bins; what lies outside is counted in the first bin or the last.
struct Histogram {
  double low = 0;
  double high = 1;
  std::vector<std::uint64_t> counts;
  double smallest = std::numeric_limits<double>::infinity();  ///< of the samples
  double largest = -std::numeric_limits<double>::infinity();

  std::size_t bin_of(double x) const {
    const auto bins = static_cast<double>(counts.size());
    const double place = (x - low) * (bins / (high - low));
    return static_cast<std::size_t>(place > 0 ? (place < bins ? place : bins - 1) : 0);
  }
  double width() const { return (high - low) / static_cast<double>(counts.size()); }
  std::int64_t total() const;
  /// The x below which the fraction `probability` of the samples lies, linear within bins and
  /// not beyond the smallest and the largest sample. NaN where there are none.
  double quantile(double probability) const;
  /// The density between the quantiles `tail` and 1 − tail, bins joined so that there are at most `most` bars.
  DensityBars bars(double tail, double most) const;
};

/// How many paths ended how. A path is counted where it first fits: with momenta beyond the bound, without a root, with
/// two landmarks at exactly the same position at the end, clean.
struct PathCounts {
  std::int64_t clean = 0;
  std::int64_t no_root = 0;
  std::int64_t momentum_bound = 0;
  std::int64_t tie = 0;

  std::int64_t total() const { return clean + no_root + momentum_bound + tie; }
};

/// Landmarks on a line that changed their order, among the clean paths.
struct CrossingCounts {
  std::int64_t at_end = 0;
  std::int64_t ever = 0;  ///< at the end of some step
  /// Antithetic pairs of clean paths, by how many of the two crossed (0, 1, 2).
  std::array<std::int64_t, 3> pairs{};
};

/// The moments at each record of the paths of the blocks first_block … first_block + 2^level − 1.
struct MomentNode {
  std::int64_t first_block = 0;
  int level = 0;
  std::vector<Moments> moments;
  std::vector<Moments> pair_moments;  ///< of the means of antithetic pairs; empty without these

  std::int64_t end_block() const { return first_block + (std::int64_t{1} << level); }
};

/// Moments of consecutive blocks, by a binary tree of pairwise sums: a node of level l + 1 begins at a multiple of
/// 2^(l+1) blocks and merges the two of level l below it. So the sum over any blocks is of the same bits, however these
/// were shared out before; it is kept as the fewest nodes.
class MomentTree {
 public:
  const std::vector<MomentNode>& nodes() const { return nodes_; }
  /// Adds the node that follows the last one.
  void add(MomentNode node);
  /// The sum of all, nodes added up from the last to the first; empty moments where there are none.
  MomentNode total() const;

 private:
  std::vector<MomentNode> nodes_;
};

/// One of `count` parts of an ensemble, whose blocks of 64 paths are shared out in their order.
struct Shard {
  int index = 1;  ///< 1 … count
  int count = 1;
};

/// All that an ensemble, or a shard of it, has added up so far: its first `samples` paths.
struct EnsembleSums {
  std::int64_t samples = 0;
  PathCounts paths;
  CrossingCounts crossing;
  double momentum_error = 0;    ///< max over paths and records of |Σp − Σp(0)| / Σ|p_a(0)|
  double largest_momentum = 0;  ///< max |p_a| over all paths, as far as they were followed
  MomentTree tree;              ///< what the moments below are the sum of
  /// For each record: of the 2dN coordinates of (q, p), over the paths that were clean up to then.
  std::vector<Moments> moments;
  std::vector<Moments> pair_moments;               ///< of the means of antithetic pairs; empty without these
  std::vector<std::vector<Histogram>> histograms;  ///< [record][coordinate]; empty for records without
  /// [path][record][coordinate] of all records or the last, NaN where a path is not clean so far; or empty.
  std::vector<double> states;

  /// The fraction of the clean paths whose landmarks, on a line, end in a different order from the start. With
  /// antithetic pairs the error is that of the pairs' means.
  Estimate crossing_probability() const;
  /// Standard errors of the mean at a record.
  Eigen::ArrayXd mean_error(std::size_t record) const;
  /// Adds the counts and the states of paths that follow these; moments and histograms are left as they are.
  void add_counts(const EnsembleSums& next);
  /// Appends the sums of the paths that follow these: the same bits as if all had been added to one.
  void append(const EnsembleSums& next);
};

/// The states of single paths that are kept.
enum class KeepStates { kNone, kFinal, kAll };

struct EnsembleOptions {
  TimeGrid grid{};
  std::uint64_t seed = 1;
  std::int64_t samples = 50000;
  double momentum_bound = kMomentumBound;
  /// Path 2j + 1 has the noise of path 2j with the other sign, and both that of path j without this option.
  bool antithetic = false;
  std::vector<int> records{};     ///< steps after which statistics are taken, increasing; the last step is one
  std::vector<int> histograms{};  ///< steps of `records` for which there are histograms
  KeepStates keep = KeepStates::kNone;
  Shard shard{};

  /// The first path of the shard, and how many it has.
  std::int64_t first_path() const;
  std::int64_t shard_samples() const;
  /// Numbers of EnsembleSums::states for each path.
  std::int64_t kept_numbers(const PhaseState& start) const;
};

/// `most` or fewer steps of a grid, evenly spaced, including the first (0) and the last.
std::vector<int> spread_steps(const TimeGrid& grid, int most);

class BlockSums;
class PathSampler;

/// So many neighbouring paths are one block.
inline constexpr std::int64_t kBlockPaths = 64;

/// A Monte Carlo ensemble of sample paths 0 … samples − 1 from one start, or a shard of it, in fixed blocks of 64 that
/// are added up by a fixed tree: the result has the same bits for any number of threads, of interruptions, and of
/// shards, and whatever process sampled which blocks.
class Ensemble {
 public:
  /// @throws InputError if an option is out of its range, or the noise or the integrator refuse the start
  Ensemble(const StochasticSystem& system, const std::string& integrator, const PhaseState& start,
           EnsembleOptions options);
  ~Ensemble();

  /// Continues from the sums of an equal ensemble. @throws InputError if they cannot be from one
  void resume(EnsembleSums sums);

  /// Samples the next blocks of paths, on all threads.
  void advance(int blocks);

  /// The sums of `count` blocks from block `first` of the shard on, which are left out of this ensemble's own; moments
  /// are in the tree alone. Thread-safe.
  EnsembleSums sample(std::int64_t first, std::int64_t count) const;
  /// Adds what sample() made of the blocks that follow those that are there.
  void append(const EnsembleSums& next);

  /// Blocks of the shard, and how many of them have been added.
  std::int64_t blocks() const;
  std::int64_t blocks_done() const;
  bool done() const { return sums_.samples == options_.shard_samples(); }

  const EnsembleSums& sums() const { return sums_; }
  const EnsembleOptions& options() const { return options_; }
  /// How paths are computed: `pair lanes`, …
  std::string method() const;

 private:
  using Histograms = std::vector<std::vector<Histogram>>;

  const Histograms& empty_histograms() const;
  Histograms pilot_histograms() const;

  PhaseState start_;
  EnsembleOptions options_;
  std::unique_ptr<const PathSampler> sampler_;
  EnsembleSums sums_;
  mutable std::once_flag has_histograms_;
  mutable Histograms histograms_;  // empty bins of the ranges that all blocks have; made when they are needed
};

/// All that sample() makes, as bytes for the same build, and back: without `moments` and `pair_moments`, which the tree
/// gives.
std::string bytes_of(const EnsembleSums& sums);
/// @throws InputError where the bytes are not of such sums
EnsembleSums sums_of_bytes(std::string_view bytes);

}  // namespace pulson::ensemble
