#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pulson/integrators/integrator.hpp"

namespace pulson::ensemble {

/// So many neighbouring paths at a time, the unit of work: a multiple of two vectors of every target.
inline constexpr std::size_t kPathBatch = 64;

using PathLanes = std::array<double, kPathBatch>;

/// How a lane stands.
enum class LaneStatus : std::uint8_t { kRunning, kNoRoot, kBeyondBound };

/// The states of a block's paths at one time.
struct LaneStates {
  /// kPathBatch×2dN: the coordinates of q (index a·d + axis), then those of p.
  Eigen::ArrayXXd values;
  /// d = 1, N > 1: the least signed gap of neighbours in their order at the start; it is negative where that order is
  /// lost.
  PathLanes smallest_gap;
  PathLanes largest_momentum;            ///< max |p_a| up to now
  std::array<bool, kPathBatch> running;  ///< whether the path has come so far
};

/// How a block's paths ended.
struct LaneEnds {
  std::array<bool, kPathBatch> reached_end;
  PathLanes largest_momentum;  ///< max |p_a| over time
  PathLanes smallest_gap;      ///< d = 1, N > 1: the least LaneStates::smallest_gap over time
};

/// What paths to sample.
struct PathPlan {
  TimeGrid grid;
  std::uint64_t seed = 1;
  bool antithetic = false;      ///< path 2j + 1 has the noise of path 2j with the other sign, and that the number j
  double momentum_bound = 1e8;  ///< paths beyond it may end early
  std::vector<int> records;     ///< steps after which states are wanted, increasing
};

/// Samples blocks of kPathBatch neighbouring paths. A path is a function of its number alone. Methods are thread-safe.
class PathSampler {
 public:
  using Sink = std::function<void(std::size_t record, const LaneStates&)>;

  virtual ~PathSampler() = default;

  /// What it is, for people: `pair lanes`.
  virtual std::string name() const = 0;

  /// Samples the paths `first_path` … + `lanes` − 1, at most kPathBatch; `sink` gets each record in order. What the
  /// other lanes hold has no meaning.
  virtual LaneEnds sample(std::uint64_t first_path, std::size_t lanes, const Sink& sink) const = 0;
};

/// The fastest sampler that knows the system: vector lanes for the pair on a line and for noises whose formulas lanes
/// know, else one path at a time. @throws InputError where the noise or the integrator refuse the start
std::unique_ptr<const PathSampler> make_path_sampler(const StochasticSystem& system, const std::string& integrator,
                                                     const PhaseState& start, const PathPlan& plan);

/// Any system, by its integrator.
std::unique_ptr<const PathSampler> make_scalar_sampler(const StochasticSystem& system, const std::string& integrator,
                                                       const PhaseState& start, const PathPlan& plan);

/// The same, which samples the first block once and keeps it: for the ranges of histograms, and then for the sums.
std::unique_ptr<const PathSampler> keep_first_block(std::unique_ptr<const PathSampler> sampler);

/// Landmarks in vector lanes; null where they do not know the system.
std::unique_ptr<const PathSampler> make_landmark_sampler(const StochasticSystem& system, const std::string& integrator,
                                                         const PhaseState& start, const PathPlan& plan);

/// The pair on a line in vector lanes; null where they do not know the system.
std::unique_ptr<const PathSampler> make_pair_sampler(const StochasticSystem& system, const std::string& integrator,
                                                     const PhaseState& start, const PathPlan& plan);

/// Samples one batch of lanes: `advance(batch, first, last)` takes steps, `copy(batch, states)` gives what a record
/// needs.
template <class Batch, class Advance, class Copy>
LaneEnds sample_lanes(Batch&& batch, const PathPlan& plan, Eigen::Index coordinates, const PathSampler::Sink& sink,
                      const Advance& advance, const Copy& copy) {
  LaneStates states;
  states.values.resize(kPathBatch, coordinates);
  const auto is_running = [&](std::size_t lane) { return batch.status[lane] == LaneStatus::kRunning; };
  std::uint32_t now = 0;
  for (std::size_t record = 0; record < plan.records.size(); ++record) {
    const auto next = static_cast<std::uint32_t>(plan.records[record]);
    advance(batch, now, next);
    now = next;
    copy(batch, states);
    states.largest_momentum = batch.largest_momentum;
    for (std::size_t lane = 0; lane < kPathBatch; ++lane) states.running[lane] = is_running(lane);
    sink(record, states);
  }
  advance(batch, now, static_cast<std::uint32_t>(plan.grid.steps));
  LaneEnds ends{{}, batch.largest_momentum, batch.smallest_side};
  for (std::size_t lane = 0; lane < kPathBatch; ++lane) ends.reached_end[lane] = is_running(lane);
  return ends;
}

}  // namespace pulson::ensemble
