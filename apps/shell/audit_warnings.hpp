#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Prints a warning where landmarks of `shape` look wrong beside those of `reference`, which correspond in their order.
/// That it looks mirrored is left to the notes of the match.
void warn_of_pair(const Landmarks& reference, const Landmarks& shape);

/// Prints a warning for each of the shapes whose landmarks look wrong beside those of the others, as audit_cohort()
/// finds; of many the first, and how many more. Shapes with other numbers of landmarks than the first are left out.
void warn_of_cohort(std::vector<Landmarks> shapes);

}  // namespace pulson
