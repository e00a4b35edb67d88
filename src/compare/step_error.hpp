#pragma once

#include "pulson/compare/cohort_fit.hpp"

namespace pulson::compare {

/// The log evidence of a fit with more steps less that with the steps it has.
struct StepChange {
  std::vector<double> shapes, laplace;  ///< of each shape; NaN where its match does not converge with more steps
  double of_own_mean = 0;
  Estimate total;  ///< of the shapes and of_own_mean, with the error of the samples
};

/// At the fitted numbers, from the matches found, by the samples or by Laplace's approximation as log_evidence is of
/// each shape: the samples have the same Brownian paths.
/// @param doublings of the number of steps
StepChange change_of_finer_steps(const Cohort& cohort, const NoiseChoice& noise, CohortSettings settings,
                                 const CohortFit& fit, int doublings = 1);

/// Adds to the evidences of a fit what they lack of the limit of fine steps: of an integrator of order p 2ᵖ/(2ᵖ − 1) of
/// their change with twice as many.
void correct_for_steps(const StepChange& change, const CohortSettings& settings, CohortFit& fit);

}  // namespace pulson::compare
