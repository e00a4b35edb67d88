#pragma once

namespace pulson::picture {

// Of the marks of a chart, the same in its panels and in its legend; in pixels.
inline constexpr double kLineWidth = 2.2;
inline constexpr double kDenseLineWidth = 1.8;  // of a line so long that it is noise at this scale
inline constexpr double kDash = 9;
inline constexpr double kDashGap = 8;
inline constexpr double kSideWidth = 1.6;  // of bins and of bars
inline constexpr double kErrorWidth = 1.8;
inline constexpr double kMostCap = 5;  // half the width of an error bar's ends
inline constexpr double kMostDot = 5.2;
inline constexpr double kMostDotWithError = 3.8;  // lest it hide a short error bar
inline constexpr double kLeastDot = 1.6;
inline constexpr double kDotMargin = 1.4;  // of paper, around a dot

// Transparency of areas.
inline constexpr double kBandFade = 0.8;
inline constexpr double kStepFade = 0.84;
inline constexpr double kBarFade = 0.55;

}  // namespace pulson::picture
