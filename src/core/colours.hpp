#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace pulson {

using Rgb = std::array<std::uint8_t, 3>;

/// The published colours of viridis (Smith, van der Walt and Firing, 2015) at 0, 1/8, …, 1.
inline constexpr std::array<Rgb, 9> kViridis{{{68, 1, 84},
                                              {71, 45, 123},
                                              {59, 82, 139},
                                              {44, 114, 142},
                                              {33, 145, 140},
                                              {40, 174, 128},
                                              {94, 201, 98},
                                              {173, 220, 48},
                                              {253, 231, 37}}};

/// The eleven colours of ColorBrewer's RdBu (Harrower and Brewer, 2003) from blue to red, the middle one made white.
inline constexpr std::array<Rgb, 11> kBlueWhiteRed{{{0x05, 0x30, 0x61},
                                                    {0x21, 0x66, 0xAC},
                                                    {0x43, 0x93, 0xC3},
                                                    {0x92, 0xC5, 0xDE},
                                                    {0xD1, 0xE5, 0xF0},
                                                    {0xFF, 0xFF, 0xFF},
                                                    {0xFD, 0xDB, 0xC7},
                                                    {0xF4, 0xA5, 0x82},
                                                    {0xD6, 0x60, 0x4D},
                                                    {0xB2, 0x18, 0x2B},
                                                    {0x67, 0x00, 0x1F}}};

/// Colours of groups, of series and of models in their order, and of the target among them: on white paper, and on the
/// dark page. All are at least 3:1 to what they are drawn on (WCAG), and any two at least 15 apart (CIEDE2000) to those
/// who see all colours, and under deuteranopia and protanopia.
struct Palette {
  std::array<std::string_view, 6> groups;
  std::string_view target;
  std::string_view ink;  ///< of texts, and of what others are compared with
  std::string_view paper;
};
inline constexpr Palette kLightPalette{
    {"#2169D2", "#A93A56", "#35A484", "#5A2679", "#524D00", "#569CBE"}, "#D4621A", "#1F2733", "#FFFFFF"};
inline constexpr Palette kDarkPalette{
    {"#509EFF", "#FB97B0", "#519A7B", "#8361AE", "#FEE584", "#8AD4FC"}, "#F0883E", "#EEF1F5", "#1B2129"};

/// The colour at `place` in [0, 1] of equally spaced control points.
inline Rgb colour_at(std::span<const Rgb> points, double place) {
  const double position = std::clamp(place, 0.0, 1.0) * static_cast<double>(points.size() - 1);
  const std::size_t left = std::min(static_cast<std::size_t>(position), points.size() - 2);
  const double share = position - static_cast<double>(left);
  Rgb colour;
  for (std::size_t c = 0; c < colour.size(); ++c)
    colour[c] = static_cast<std::uint8_t>(std::lround((1 - share) * points[left][c] + share * points[left + 1][c]));
  return colour;
}

}  // namespace pulson
