#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pulson/integrators/integrator.hpp"

namespace pulson {

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

}  // namespace pulson
