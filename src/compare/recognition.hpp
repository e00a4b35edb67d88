#pragma once

#include <vector>

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {

/// How often cohorts of as many shapes would reveal each model: drawn from the models linear at rest, in which a cohort
/// is S or, about its own mean, S − 1 normal vectors of covariance C(θ), and fitted by the same models, λ, width, σ and
/// amplitudes as in the cohort's fits. A model is drawn at its fitted numbers where its noise makes a tenth of the
/// variance, else with noise of a third of the variance beside the λ, width and σ of `none`. Path-dependent signs of
/// noise, such as landmarks that change order, are not seen.
/// @param comparison with `none` among its models @param noises of these
/// @return of each model; none where `none` is not among them
std::vector<std::optional<Recognition>> find_recognitions(const Comparison& comparison,
                                                          const std::vector<NoiseChoice>& noises);

}  // namespace pulson::compare
