#pragma once

#include <vector>

#include "chart_axis.hpp"
#include "pulson/charts/chart.hpp"

namespace pulson::picture {

/// Width of each bar of the panel's bar series, in places on its horizontal axis.
double bar_width(const ChartPanel& panel, const ChartAxis& x);

/// The horizontal axis of panels one above the other, all of them with names below or none: all of their x, with a
/// margin where marks would touch the frame.
ChartAxis horizontal_axis(const std::vector<const ChartPanel*>& column);

/// The vertical axis of panels that share it: the ranges that are asked for or, where there are none, all that is
/// drawn.
ChartAxis vertical_axis(const std::vector<const ChartPanel*>& panels);

}  // namespace pulson::picture
