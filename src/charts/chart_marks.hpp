#pragma once

#include <cstddef>
#include <vector>

#include "chart_layout.hpp"
#include "draw/canvas.hpp"
#include "pulson/charts/chart.hpp"

namespace pulson::picture {

/// The series of the panel within its frame. colours: one for each series; vertices: of each line, at most.
void draw_all_series(Canvas& canvas, const ChartFrame& frame, const std::vector<Colour>& colours, std::size_t vertices);

}  // namespace pulson::picture
