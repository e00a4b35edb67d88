#pragma once

#include <string>
#include <vector>

#include "pulson/compare/comparison.hpp"
#include "pulson/matching/robust_loss.hpp"

namespace pulson {

/// Weighs the landmarks of the shapes by their distances from what the others of their shape, and the other shapes,
/// predict (cohort::make_atlas() with a loss). Those of little weight count as missing, and a note names them.
/// @throws InputError for fewer than three shapes
void weigh(const matching::RobustLoss& loss, compare::CohortShapes& shapes, std::vector<std::string>& notes);

}  // namespace pulson
