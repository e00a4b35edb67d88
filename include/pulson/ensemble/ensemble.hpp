#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pulson/ensemble/ensemble_sums.hpp"
#include "pulson/ensemble/sample_paths.hpp"

namespace pulson {

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

  /// Numbers of EnsembleSums::states for each path.
  std::int64_t kept_numbers(const PhaseState& start) const;
};

/// `most` or fewer steps of a grid, evenly spaced, including the first (0) and the last.
std::vector<int> spread_steps(const TimeGrid& grid, int most);

class BlockSums;
class PathSampler;

/// A Monte Carlo ensemble of sample paths 0 … samples − 1 from one start, in fixed blocks of 64 that are added up in
/// their order: the result has the same bits for any number of threads, and for any number of interruptions.
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
  bool done() const { return sums_.samples == options_.samples; }

  const EnsembleSums& sums() const { return sums_; }
  const EnsembleOptions& options() const { return options_; }
  /// How paths are computed: `pair lanes`, …
  std::string method() const;

 private:
  void make_histograms();
  void add(const BlockSums& block);

  PhaseState start_;
  EnsembleOptions options_;
  std::unique_ptr<const PathSampler> sampler_;
  EnsembleSums sums_;
};

}  // namespace pulson
