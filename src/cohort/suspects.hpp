#pragma once

#include <vector>

#include "posed_shapes.hpp"

namespace pulson::cohort {

/// Landmarks of a cohort that the others of their shape, and the law, contradict: of each shape at most one, the worst,
/// since a wrong landmark makes the others around it look wrong; −1: none. For a landmark a of shape i
///
///     t_ia² = (Pr)_aᵀ(P_aa)⁻¹(Pr)_a
///
/// is the squared distance from its prediction (PosedShapes::Conditional::information is P), in units of the larger of
/// the medians of all t² and of the t_ia² of this landmark over that of χ² with d degrees of freedom: some landmarks
/// vary more than a stationary kernel says, and wrong ones raise no median. One to which Tukey's loss gives no weight
/// is a suspect.
/// @param placed d×N, near the mean's pose; missing landmarks are NaN
std::vector<int> find_suspects(const PosedShapes& law, const std::vector<Points>& placed);

}  // namespace pulson::cohort
