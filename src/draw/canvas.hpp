#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/colours.hpp"
#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"
#include "surface.hpp"

namespace pulson::draw {

/// A colour as gnuplot writes it: #RRGGBB, or #AARRGGBB where AA = 00 is opaque and FF invisible.
using Colour = std::string;

namespace colour {
inline const Colour kSource = std::string(kLightPalette.groups[0]);
inline const Colour kTarget = std::string(kLightPalette.target);
inline const Colour kResult = std::string(kLightPalette.ink);
inline const Colour kMomentum = "#B03A63";
inline const Colour kGrid = "#74A9B1BC";
inline const Colour kFrame = "#C9CED6";
inline const Colour kReference = "#AEB5BF";
inline const Colour kTitle = std::string(kLightPalette.ink);
inline const Colour kText = "#5B6470";
inline const Colour kTicText = "#868E99";
inline const Colour kPaper = std::string(kLightPalette.paper);
}  // namespace colour

/// Colour of s in [0, 1] on the palette viridis (S. van der Walt and N. Smith), cut before its yellow end, which white
/// paper would swallow.
Colour time_colour(double s);

/// The same colour, transparent to the given part in [0, 1]. `opaque`: #RRGGBB.
Colour faded(const Colour& opaque, double transparency);

struct Stroke {
  Colour colour;
  double width;  // pixels
};

enum class Align { kLeft, kCentre, kRight };

/// Width of the text in the sans font, estimated to some percent.
double text_width(std::string_view text, double size);

/// A rectangle of the canvas, in pixels.
struct Box {
  double left;
  double bottom;
  double width;
  double height;
};

/// A drawing in pixels, the origin in the lower left corner. Everything on it, dots too, is made of stroked lines, of
/// filled areas and of text, since these look the same in gnuplot's PNG and SVG terminals; its own point symbols do
/// not.
class Canvas {
 public:
  Canvas(double width, double height) : width_(width), height_(height) {}

  double width() const { return width_; }
  double height() const { return height_; }

  /// More room below what is there, at negative heights.
  void extend_below(double height) { below_ += height; }

  /// Lines 2×M each, in one stroke.
  void lines(const std::vector<Points>& lines, const Stroke& stroke);

  /// Areas 2×M each, filled; the last vertex is joined to the first.
  void areas(const std::vector<Points>& outlines, const Colour& colour);

  /// A straight line between each column of `from` and that of `to` (2×M).
  void segments(const Points& from, const Points& to, const Stroke& stroke);

  /// An arrow from each column of `from` to that of `to` (2×M).
  void arrows(const Points& from, const Points& to, const Stroke& stroke);

  /// Filled discs around the columns of `centres` (2×M).
  void dots(const Points& centres, double radius, const Colour& colour);

  /// Circles around the columns of `centres` (2×M).
  void rings(const Points& centres, double radius, const Stroke& stroke);

  /// The pixels, stretched over the box.
  void raster(const Raster& raster, const Box& box);

  /// One line of text, its middle at height y; made smaller where it would be wider than `max_width`.
  void text(double x, double y, std::string_view text, double size, const Colour& colour, Align align = Align::kLeft,
            double max_width = 1e9);

  /// The same from the left, on a narrow white margin, so that it is legible on an image and on lines.
  void text_on_image(double x, double y, std::string_view text, double size, const Colour& colour);

  /// Writes the files. @throws InputError as Gnuplot does.
  void write(const PictureFiles& files) const;

 private:
  struct Layer {
    std::string rows;
    Stroke stroke;
    bool filled = false;
    std::string image{};  // or an image: the command that plots it
  };

  void add(const std::vector<Points>& lines, const Stroke& stroke, bool filled);

  double width_;
  double height_;
  double below_ = 0;
  std::vector<Layer> layers_;
  std::vector<std::string> labels_;
  std::vector<std::shared_ptr<std::FILE>> scratch_;  // of the pixels
};

}  // namespace pulson::draw
