#pragma once

#include "cohort_model.hpp"

namespace pulson::compare {

/// What noise and momenta share of the variance of the end points, tr Σ_noise/(tr Σ_noise + tr Σ_momenta), by the
/// models linear about the matches at another place x; 0 where both together are not detectable.
double noise_share(const CohortModel& cohort, const Matches& about, const Eigen::VectorXd& x);

/// The upper end of the interval of 90 % of that share: where the evidence of the linear models, with an amplitude held
/// and the other numbers at their best, has fallen by drop_of_ninety(). The greatest over the amplitudes; 0 where none
/// is fitted.
double greatest_noise_share(const CohortModel& cohort, const Matches& about);

}  // namespace pulson::compare
