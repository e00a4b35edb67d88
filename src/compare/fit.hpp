#pragma once

#include "cohort_model.hpp"

namespace pulson::compare {

/// fit_cohort() of a model, its settings checked. A model with no noise as its limit is that limit, to the bits of its
/// numbers and evidence, where its noise vanishes or its evidence is not greater. (That it had to be greater by more
/// than the error of both made 47 of 100 amplitudes 0 in place of 35; of linear models 22 are.)
/// @param none the fit of that limit; null: the model has none
CohortFit fit_model(const CohortModel& cohort, const CohortFit* none = nullptr);

/// The same without intervals, at the greatest evidence of the models linear about the matches: numbers that only
/// choose the time steps need be no better.
CohortFit fit_roughly(const CohortModel& cohort);

/// The same from the numbers and matches of a fit to more shapes, for cross-validation.
/// @param shapes of that fit, which these are
CohortFit fit_again(const CohortModel& cohort, const CohortFit& before, const std::vector<int>& shapes);

}  // namespace pulson::compare
