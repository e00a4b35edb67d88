#pragma once

#include <vector>

#include "cohort_model.hpp"

namespace pulson::compare {

/// What noise and momenta share of the variance of the end points, tr Σ_noise/(tr Σ_noise + tr Σ_momenta), by the
/// models linear about the matches at another place x; 0 where both together are not detectable.
double noise_share(const CohortModel& cohort, const Matches& about, const Eigen::VectorXd& x);

/// The same where an amplitude is at the upper end of its interval of 90 %, which is the evidence's own (that of the
/// linear models is at a quarter to nine tenths of the share, in 20 fits of ten ovals), or as great as it can be where
/// the end is not known. The greatest over the amplitudes; 0 where none is fitted.
/// @param about at x of the fit @param fitted the numbers of cohort.open()
double greatest_noise_share(const CohortModel& cohort, const Matches& about, const std::vector<FittedNumber>& fitted);

}  // namespace pulson::compare
