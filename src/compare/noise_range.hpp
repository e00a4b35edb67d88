#pragma once

#include <vector>

#include "cohort_model.hpp"

namespace pulson::compare {

/// What noise and momenta share of the variance of the end points, tr Σ_noise/(tr Σ_noise + tr Σ_momenta), by the model
/// linear at rest; 0 where both together are not detectable. (Of matches, the squares of slopes have means above the
/// variance, of what moves landmarks far more than of what does not: of ovals of 12 landmarks whose noise alone makes
/// 0.444 of the variance they say 0.41, rest 0.437.)
double noise_share(const CohortModel& cohort, const Eigen::VectorXd& x);

/// What the shapes do not exclude of noise.
struct NoiseRange {
  double greatest_share = 0;
  std::vector<Eigen::VectorXd> places;  ///< that an interval of 90 % has
};

/// The greatest share that the shapes do not exclude: of all numbers at which the evidence, by draws where these
/// determine it, is at most what a one-sided interval of 90 % allows below its greatest. At places along each amplitude
/// the others are where Laplace's is greatest, and about there as the linear models have it. The greatest over the
/// amplitudes; 0 where none is fitted. At some amplitudes the others are sought anew, as fits with much noise are far
/// from the one without.
/// @param about at x of the fit
NoiseRange noise_range(const CohortModel& cohort, const Matches& about);

}  // namespace pulson::compare
