#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// What shoot() may choose.
struct ShootingOptions {
  MinimiseOptions minimise;
  bool more_steps = false;   ///< whether it chooses the number of steps, from that of the problem up
  bool extrapolate = false;  ///< whether J is wanted for steps that tend to 0
  /// The frozen realisations on a grid: the same Brownian paths whatever its steps. Empty: the problem has none.
  std::function<std::vector<Eigen::MatrixXd>(const TimeGrid&)> draw{};
  bool follow_noise = false;  ///< whether the one realisation is to grow from nothing
};

struct ShootingSolution {
  MatchingProblem problem;  ///< as solved: its grid, and the realisations on it
  MinimiseSummary summary;
  MatchingCost cost;           ///< of the solution, energy and action apart
  Eigen::MatrixXd increments;  ///< ΔW, C×K, of the first path: fitted, drawn, or λh Δt
  std::optional<ExtrapolatedCost> extrapolated;
};

/// Minimises the objective of a problem through its integrator's own steps, from the path of least cost that a search
/// over paths finds; see shooting.cpp.
ShootingSolution shoot(MatchingProblem problem, const ShootingOptions& options);

}  // namespace pulson::matching
