#pragma once

#include <string>
#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson {

/// Where a search begins. All are of problems whose data are landmarks.
struct Start {
  std::string name;
  Eigen::VectorXd z;
  int iterations = 0;  ///< of Gauss–Newton in the velocity fields, see flow_start()
};

/// A flow without noise by way number `way`: 0 straight on, from 1 on by halfway().
Start start_by_flow(const MatchingObjective& objective, int way, std::uint64_t seed);

/// Landmarks at rest that equal increments in all steps move straight to their targets, as far as the noise can.
Start start_by_noise(const MatchingObjective& objective);

/// z of momenta `p`, d×N, without noise.
Eigen::VectorXd without_noise(const MatchingObjective& objective, const Points& p);

/// Of 4000 landmarks or more, with no noise channels, 1000 to stand for all: those of the start by flows, and others in
/// even steps through those observed. Empty else.
std::vector<Eigen::Index> representatives(const MatchingObjective& objective);

}  // namespace pulson
