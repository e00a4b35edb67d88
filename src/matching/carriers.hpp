#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// Few landmarks whose momenta carry all. Where a change of their flow moves their ends by δ, it moves the others' by
/// nearly Wδ, W = K(q0, c)(K(c, c) + εK(0))⁻¹, the interpolation of least energy.
class Carriers {
 public:
  /// @param places which landmarks of the problem, whose data are landmarks
  Carriers(const MatchingProblem& problem, std::vector<Eigen::Index> places);

  /// The problem of the carriers alone; the cost of the data as a function of their ends, if all end at `all`, d×N,
  /// where these end at `ends`.
  MatchingProblem problem(const Points& ends, const Points& all) const;

  /// Of all landmarks the carriers.
  Points of(const Points& all) const { return all(Eigen::all, places_); }

  /// W of a change of the carriers' ends, d×M: what it changes of all, d×N.
  Points carried(const Points& change) const { return change * weights_.transpose(); }

  /// Momenta of the carriers and none of the others, d×N.
  Points momenta(const Points& of_carriers) const;

 private:
  const MatchingProblem& problem_;
  std::vector<Eigen::Index> places_;
  Eigen::MatrixXd weights_;    ///< W, N×M
  Eigen::VectorXd precision_;  ///< of the coordinates of each landmark, N
  QuadraticForm form_;         ///< Wᵀ diag(precision) W, M×M
};

/// The landmarks that carry the others in a problem without noise: those that a MomentumBasis takes and others
/// distributed between them. Empty where these are most of all, or where a landmark is observed more precisely along
/// one axis.
std::optional<Carriers> find_carriers(const MatchingProblem& problem);

}  // namespace pulson::matching
