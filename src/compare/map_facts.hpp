#pragma once

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {

/// Sets the crossings, turned triangles and folded part of the fitted maps of a model, mean of a shape.
void measure_maps(const Cohort& cohort, const CompareOptions& options, ComparedModel& model);

}  // namespace pulson::compare
