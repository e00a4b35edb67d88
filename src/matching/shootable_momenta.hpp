#pragma once

#include <optional>

#include "path_search.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// Momenta of a path in midpoint steps.
struct ShootableMomenta {
  Points momenta;  ///< p0, d×N
  /// Of an accurate shot of them; none where that leaves the path, or takes too many steps.
  std::optional<DiscretisationError> error;
};

/// The flow of EffectiveHamiltonian from (q0, p0), its controls u = λh(q, p), by Runge–Kutta of order 4.
class EffectiveShot {
 public:
  EffectiveShot(const MatchingProblem& problem, const PathSolution& path);

  /// Its end, d×N; empty where it leaves the path by kLost.
  /// @param substeps of each step of the path
  std::optional<Points> end(const Points& momenta, int substeps) const;

  /// What of J and the end of the path differs, where the shot has this end: λTH_tot is conserved.
  DiscretisationError error(const Points& momenta, const Points& end) const;

 private:
  const MatchingProblem& problem_;
  const PathSolution& path_;
  EffectiveHamiltonian system_;
  double furthest_;
};

/// The momenta of a path solve the midpoint rule, and an accurate shot of them ends off the path by its error. Here
/// they are those whose accurate shot ends where the path does, within a tenth of σ and a thousandth of J; where these
/// cannot be had, the momenta of the path. Each round moves the end of the path against the error of the last shot
/// (defect correction).
/// @param found for this problem by search_paths() or search_accurate_paths()
ShootableMomenta shootable_momenta(const MatchingProblem& problem, const MinimiseOptions& options,
                                   const PathSolution& found);

}  // namespace pulson::matching
