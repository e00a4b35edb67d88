#pragma once

#include <vector>

#include "draw/view.hpp"

namespace pulson::picture {

/// The line 2×M with each height brought into the range: where it leaves the range, it runs along the border.
Points clamped(const Points& line, const Interval& heights);

/// The parts of the line 2×M whose heights lie in the range.
std::vector<Points> parts_within(const Points& line, const Interval& heights);

/// The line 2×M cut into dashes. Cut here and not by gnuplot, whose terminals do not agree on the length of a dash.
std::vector<Points> dashes_of(const Points& line, double dash, double gap);

}  // namespace pulson::picture
