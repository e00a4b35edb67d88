#pragma once

#include <string>
#include <vector>

#include "audit/audit.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// The warning where landmarks of `shape` look wrong beside those of `reference`, which correspond in their order; else
/// empty. That it looks mirrored is left to the notes of the match, from which a reversed order takes such a note.
std::string pair_warning(const Landmarks& reference, const Landmarks& shape, std::vector<std::string>& notes);

/// Prints a warning for each of the shapes whose landmarks look wrong beside those of the others, as audit_cohort()
/// finds; of many the first, and how many more. Shapes with other numbers of landmarks than the first are left out.
void warn_of_cohort(std::vector<Landmarks> shapes);

/// The same of what an audit of these shapes found.
void warn_of_findings(const std::vector<Landmarks>& shapes, const audit::Audit& audit);

}  // namespace pulson
