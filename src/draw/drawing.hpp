#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/colours.hpp"
#include "pulson/core/landmarks.hpp"
#include "surface.hpp"

namespace pulson::draw {

/// A colour and how opaque it is, 0 to 1.
struct Colour {
  Rgb rgb{};
  double opacity = 1;

  Colour() = default;
  constexpr Colour(const Rgb& opaque, double part = 1) : rgb(opaque), opacity(part) {}
  /// #RRGGBB; black where it is none.
  template <std::convertible_to<std::string_view> Text>
  constexpr Colour(const Text& hex, double part = 1) : opacity(part) {
    const std::string_view digits = hex;
    for (std::size_t i = 0; i < 3 && digits.size() == 7; ++i)
      rgb[i] = static_cast<std::uint8_t>(16 * value_of(digits[2 * i + 1]) + value_of(digits[2 * i + 2]));
  }

 private:
  static constexpr int value_of(char digit) {
    return digit <= '9' ? digit - '0' : (digit <= 'F' ? digit - 'A' : digit - 'a') + 10;
  }
};

namespace colour {
inline constexpr Colour kSource{kLightPalette.groups[0]};
inline constexpr Colour kTarget{kLightPalette.target};
inline constexpr Colour kResult{kLightPalette.ink};
inline constexpr Colour kMomentum{"#B03A63"};
inline constexpr Colour kGrid{"#A9B1BC", 0.62};
inline constexpr Colour kFrame{"#C9CED6"};
inline constexpr Colour kReference{"#AEB5BF"};
inline constexpr Colour kTitle{kLightPalette.ink};
inline constexpr Colour kText{"#5B6470"};
inline constexpr Colour kTicText{"#868E99"};
inline constexpr Colour kPaper{kLightPalette.paper};
}  // namespace colour

/// Colour of s in [0, 1] on the palette viridis (S. van der Walt and N. Smith), cut before its yellow end, which white
/// paper would swallow.
inline Colour time_colour(double s) {
  constexpr double kViridisEnd = 0.8;
  return colour_at(kViridis, std::clamp(s, 0.0, 1.0) * kViridisEnd);
}

inline constexpr int kTimeColours = 48;  // that pictures tell apart

/// The same colour, transparent to the given part in [0, 1].
constexpr Colour faded(const Colour& opaque, double transparency) { return {opaque.rgb, 1 - transparency}; }

struct Stroke {
  Colour colour;
  double width;                      // pixels
  std::span<const double> dashes{};  // lengths of dash, gap, dash, gap, … over and over; none: whole
};

enum class Align { kLeft, kCentre, kRight };

/// A rectangle of the canvas, in pixels.
struct Box {
  double left;
  double bottom;
  double width;
  double height;

  double right() const { return left + width; }
  double top() const { return bottom + height; }
  Eigen::Vector2d middle() const { return {left + width / 2, bottom + height / 2}; }
  bool operator==(const Box&) const = default;
  Box grown(double by) const { return {left - by, bottom - by, width + 2 * by, height + 2 * by}; }
};

// What a drawing is made of, in pixels; heights are counted upwards. What one of them holds does not darken itself
// where it overlaps.

/// Lines 2×M each with round ends and corners, broken where a coordinate is not finite.
struct Lines {
  std::vector<Points> lines;
  Stroke stroke;
};

/// Areas 2×M each; the last vertex is joined to the first.
struct Areas {
  std::vector<Points> outlines;
  Colour colour;
};

/// Circles around the columns of `centres` (2×M): discs, or rings of the width.
struct Circles {
  Points centres;
  double radius;
  Colour colour;
  double ring = 0;  // 0: filled
};

/// Pixels, stretched over the box.
struct Picture {
  Raster raster;
  Box box;
};

/// One line of text in kFontFamily, its middle at height y.
struct Text {
  double x, y;
  std::string text;
  double size;
  Colour colour;
  Align align;
  double width;   // as it is drawn
  double margin;  // of paper around its letters; may be 0
};

struct Layer {
  std::variant<Lines, Areas, Circles, Picture> shape;
  std::optional<Box> window;  // what lies outside of it is not seen
};

/// A drawing from height `bottom` up to `top`: its layers one above the other, and the texts above all of them.
struct Drawing {
  double width, bottom, top;
  std::vector<Layer> layers;
  std::vector<Text> texts;

  double height() const { return top - bottom; }
};

/// What lies further out is drawn there, in pixels: cairo counts up to 8 million.
inline constexpr double kFarAway = 1e5;

/// The middle of a text above its baseline, in font sizes: half the height of digits and capitals.
inline constexpr double kTextMiddle = 0.36;

/// The drawing as a file, in memory, so many times as large. @throws InputError if it is too large for the format
std::string png_of(const Drawing& drawing, double scale);
std::string pdf_of(const Drawing& drawing, double scale);  // a pixel is 1/96 inch
/// Texts stay texts, circles circles, and pictures are embedded.
std::string svg_of(const Drawing& drawing, double scale);

/// @param bytes_of_pixel 3 (red, green, blue) or 4 (and opacity)
std::string encode_png(int width, int height, int bytes_of_pixel, const std::vector<std::uint8_t>& pixels);

}  // namespace pulson::draw
