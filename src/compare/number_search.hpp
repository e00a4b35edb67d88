#pragma once

#include <optional>

#include "cohort_model.hpp"
#include "evidence_maximum.hpp"

namespace pulson::compare {

/// The numbers of a model that were found, and the matches there.
struct Found {
  Matches about;
  bool sampled = false;  ///< whether the evidence is by draws, or Laplace's approximation
  bool converged = false;
  std::optional<LocalEvidence> local{};  ///< the evidence about them; none: of the linear models alone
  Intervals intervals{};

  const Eigen::VectorXd& x() const { return about.x; }
};

/// The numbers of greatest evidence and their intervals: first those that the models linear about the matches have, by
/// turns of matches and numbers (M. Lindstrom and D. Bates 1990), from a few widths of the kernel and levels of noise;
/// from the best of these by Newton's method on the evidence, Laplace's and what draws add to it, with the linear
/// models and what differences of the evidence show that these lack as its model.
/// @param also matches from which they are sought, too; null: none
Found find_numbers(const CohortModel& cohort, const Matches* also = nullptr);

/// The first of these alone.
Found find_numbers_roughly(const CohortModel& cohort);

/// Matches with one number held at a place, the others from a few widths of the kernel. None where some shape has no
/// path.
std::optional<Matches> find_matches_at(const CohortModel& cohort, Eigen::Index held, double place);

/// The same from matches that are near.
Found find_numbers_near(const CohortModel& cohort, const Matches& near);

}  // namespace pulson::compare
