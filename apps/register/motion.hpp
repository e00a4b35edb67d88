#pragma once

#include <optional>
#include <vector>

#include "pulson/html/html_report.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// What the report of a registration plays: its landmarks at no more than 41 times of the path, and in 1D and 2D the
/// material that goes with them. The more landmarks, the fewer times and the coarser the grid. None where the numbers
/// are too large to be drawn.
std::optional<ReportMotion> registration_motion(const Registration& registration, const Trajectory& path,
                                                const std::vector<int>& outliers);

}  // namespace pulson
