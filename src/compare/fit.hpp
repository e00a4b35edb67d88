#pragma once

#include "cohort_model.hpp"

namespace pulson::compare {

/// fit_cohort() of a model, its settings checked.
CohortFit fit_model(const CohortModel& cohort);

/// The same without intervals, at the greatest evidence of the models linear about the matches: numbers that only
/// choose the time steps need be no better.
CohortFit fit_roughly(const CohortModel& cohort);

/// The same from the numbers of a fit to more shapes, for cross-validation.
CohortFit fit_again(const CohortModel& cohort, const CohortFit& before);

}  // namespace pulson::compare
