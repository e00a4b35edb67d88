#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "charts/chart.hpp"

namespace pulson::charts {

/// Ten values of a wave, with an edge more for steps.
inline Series wave(const std::string& name, SeriesStyle style = SeriesStyle::kLine) {
  Series series{.name = name, .x = {}, .y = {}, .style = style};
  for (int i = 0; i < 10; ++i) {
    series.x.push_back(0.5 + i);
    series.y.push_back(1.5 + std::sin(i));
  }
  if (style == SeriesStyle::kSteps) series.x.push_back(10.5);
  return series;
}

inline Series with_error(Series series, double error) {
  series.error.assign(series.y.size(), error);
  return series;
}

inline Series with_band(Series series, double half) {
  for (const double value : series.y) {
    series.low.push_back(value - half);
    series.high.push_back(value + half);
  }
  return series;
}

}  // namespace pulson::charts
