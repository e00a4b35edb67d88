#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drawing.hpp"
#include "pulson/draw/pictures.hpp"
#include "typeface.hpp"

namespace pulson::draw {

/// A drawing in pixels, the origin in the lower left corner; what is added lies above what is there, and texts lie
/// above all else.
class Canvas {
 public:
  Canvas(double width, double height) : drawing_{width, 0, height, {}, {}} {}

  double width() const { return drawing_.width; }
  double height() const { return drawing_.top; }

  /// More room below what is there, at negative heights.
  void extend_below(double height) { drawing_.bottom -= height; }

  /// What is added from now on, but for texts, is seen within the window alone, or everywhere.
  void look_through(const std::optional<Box>& window) { window_ = window; }

  /// Lines 2×M each, in one stroke.
  void lines(std::vector<Points> lines, const Stroke& stroke);

  /// Areas 2×M each, filled; the last vertex is joined to the first.
  void areas(std::vector<Points> outlines, const Colour& colour);

  /// A straight line between each column of `from` and that of `to` (2×M).
  void segments(const Points& from, const Points& to, const Stroke& stroke);

  /// An arrow from each column of `from` to that of `to` (2×M).
  void arrows(const Points& from, const Points& to, const Stroke& stroke);

  /// Filled discs around the columns of `centres` (2×M).
  void dots(const Points& centres, double radius, const Colour& colour);

  /// Circles around the columns of `centres` (2×M).
  void rings(const Points& centres, double radius, const Stroke& stroke);

  /// The pixels, stretched over the box.
  void raster(Raster raster, const Box& box);

  /// One line of text, its middle at height y; made smaller, and at last cut, where it would be wider than `max_width`
  /// or than the canvas.
  void text(double x, double y, std::string_view text, double size, const Colour& colour, Align align = Align::kLeft,
            double max_width = 1e9);

  /// The same from the left, on a narrow white margin, so that it is legible on an image and on lines.
  void text_on_image(double x, double y, std::string_view text, double size, const Colour& colour);

  /// Writes the files once all of them are drawn. @throws InputError if one is too large or cannot be written
  void write(const PictureFiles& files) const;

  /// The bytes of an svg of its own size. @throws InputError if it is too large
  std::string svg() const;

  /// The bytes of a png of that width and resolution. @throws InputError if it is too large
  std::string png(const std::optional<double>& width, double dpi) const;

 private:
  double scale_of(const std::optional<double>& width) const;
  void add(decltype(Layer::shape) shape) { drawing_.layers.push_back({std::move(shape), window_}); }

  Drawing drawing_;
  std::optional<Box> window_;
};

}  // namespace pulson::draw
