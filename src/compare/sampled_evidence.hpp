#pragma once

#include "pulson/compare/cohort_fit.hpp"

namespace pulson::compare {

/// Of the model with the numbers of `fit`: for each shape two Markov chains in Gauss–Newton coordinates, and bridge
/// sampling between their draws and those of the reference (inference::sample_posterior()). The data are the end points
/// projected onto the directions that the alignment leaves.
SampledEvidence sample_evidence(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings);

}  // namespace pulson::compare
