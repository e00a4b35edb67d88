#pragma once

#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// The match of a pair with noise of one amplitude.
struct HomotopyStep {
  double beta = 0;  ///< of the noise; of a sum that of its first term: all are scaled alike
  MatchingCost cost;
  double rms = 0;  ///< length units
  bool matched = false;
  bool converged = false;
  int iterations = 0;

  /// The fraction by which J would grow if β were halved, to first order: dJ/d ln β = −2·action.
  double growth() const;
};

/// How far from diffeomorphic a pair is: J(β) in mode metamorphosis while β is halved ten times, each search over paths
/// beginning with the last one's path. J grows as β falls: where a diffeomorphism matches, to that of LDDMM; else
/// without bound, or until the match is lost. (design: mathematics §4.1)
/// @param registration what register_shapes() made of the other arguments
/// @throws InputError where the mode is not metamorphosis
std::vector<HomotopyStep> follow_homotopy(const Landmarks& source, const Landmarks& target,
                                          const RegistrationOptions& options, const Registration& registration);

/// @throws InputError where follow_homotopy() would
void require_homotopy(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options);

/// The last step before the first that is not matched; the end where the first is not.
std::vector<HomotopyStep>::const_iterator least_needed(const std::vector<HomotopyStep>& steps);

/// Whether all of them match, and J hardly grows any more at the end.
bool reaches_diffeomorphism(const std::vector<HomotopyStep>& steps);

}  // namespace pulson::matching
