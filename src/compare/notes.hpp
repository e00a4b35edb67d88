#pragma once

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {

/// Shapes of which too few importance samples are effective.
int without_samples(const ComparedModel& model);

/// What a comparison cannot say, and what its numbers rest on.
void add_notes(Comparison& comparison, const CompareOptions& options);

}  // namespace pulson::compare
