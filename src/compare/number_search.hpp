#pragma once

#include <optional>

#include "cohort_model.hpp"
#include "evidence_maximum.hpp"

namespace pulson::compare {

/// The numbers of a model that were found, and the matches about which they were.
struct Found {
  Matches about;
  std::optional<EvidenceMaximum> maximum{};  ///< of the evidence itself; none: of that of the linear models
  bool sampled = false;                      ///< whether that is by draws, or Laplace's approximation
  bool converged = false;
  std::optional<LocalEvidence> local{};  ///< the evidence about that maximum
  Intervals intervals{};

  Eigen::VectorXd x() const { return maximum ? maximum->x : about.x; }
};

/// The numbers of greatest evidence and their intervals: first those that the models linear about the matches have, by
/// turns of matches and numbers (M. Lindstrom and D. Bates 1990), from a few widths of the kernel and levels of noise;
/// from the best of these by Newton's method on the evidence: Laplace's and what draws add to it, to first order.
/// @param also matches from which they are sought, too; null: none
Found find_numbers(const CohortModel& cohort, const Matches* also = nullptr);

/// The first of these alone.
Found find_numbers_roughly(const CohortModel& cohort);

/// Fisher's information with eigenvalues of at least that of a deviation of 2, for steps of numbers that are hardly
/// determined.
Eigen::MatrixXd metric_of(const Eigen::MatrixXd& information);

/// Matches with one number held at a place, the others from a few widths of the kernel. None where some shape has no
/// path.
std::optional<Matches> find_matches_at(const CohortModel& cohort, Eigen::Index held, double place);

/// The same from matches that are near.
Found find_numbers_near(const CohortModel& cohort, const Matches& near);

/// The evidence at matches by as many draws as the search takes; none where they do not determine it, or the settings
/// have none.
std::optional<double> evidence_by_draws(const CohortModel& cohort, const Matches& about);

}  // namespace pulson::compare
