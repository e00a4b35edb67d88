#include "points_frame.hpp"

#include <fmt/format.h>

#include "core/shape_frames.hpp"
#include "pulson/core/errors.hpp"
#include "shell/picture_sizes.hpp"

namespace pulson {
namespace {

// Coordinates whose file does not say their unit are pixels.
bool differ_in_units(const Frame& a, const Frame& b) {
  return (a.says_units || b.says_units) && (a.unit_per_pixel != b.unit_per_pixel || a.origin != b.origin);
}

void require_same_picture(const Landmarks& from, const Landmarks& shape) {
  const Frame &a = from.frame, &b = shape.frame;
  const bool are_known = a.width > 0 && a.height > 0 && b.width > 0 && b.height > 0;
  if (!are_known || (a.width == b.width && a.height == b.height)) return;
  throw InputError(fmt::format("{} was placed on a picture of {} x {} pixels, {} on one of {} x {}: {}", shape.source,
                               b.width, b.height, from.source, a.width, a.height,
                               a.width == b.height && a.height == b.width
                                   ? "the one is turned against the other, as EXIF says; turn the points"
                                   : "points have to lie on the picture of the registration"));
}

// The same pixels in other units; y keeps its direction.
void change_units(Landmarks& shape, const Frame& units) {
  const Frame before = shape.frame;
  shape.frame.unit_per_pixel = units.unit_per_pixel;
  shape.frame.origin = units.origin;
  change_points(shape, [&](Points& points) {
    if (points.rows() == 2) points = shape.frame.to_landmarks(before.to_pixels(points));
  });
}

}  // namespace

Landmarks PointsFrame::enter(Landmarks shape, std::vector<std::string>& notes) const {
  if (shape.dimension() == 2) {
    if (shape.frame.y_down != from_.frame.y_down) find_picture_size(shape);
    require_same_picture(from_, shape);
    if (shape.frame.height == 0) {
      shape.frame.height = from_.frame.height;
      shape.frame.width = from_.frame.width;
    }
  }
  shape = in_frame_of(from_, shape, notes);
  if (shape.dimension() == 2 && differ_in_units(shape.frame, from_.frame)) {
    notes.push_back(fmt::format("{} has {:.4g} units per pixel{}, {} {:.4g}; converted", shape.source,
                                shape.frame.unit_per_pixel[0],
                                shape.frame.says_units ? "" : " (assumed: the file does not say)", from_.source,
                                from_.frame.unit_per_pixel[0]));
    change_units(shape, from_.frame);
  }
  return shape;
}

void PointsFrame::leave(Landmarks& shape, const Frame& own) const {
  if (shape.dimension() != 2) return;
  shape.frame = to_.frame;
  if (differ_in_units(shape.frame, own)) change_units(shape, own);
  if (shape.frame.y_down != own.y_down) {
    if (shape.frame.height == 0) {  // then pictures of both are taken to be of one size
      shape.frame.height = from_.frame.height > 0 ? from_.frame.height : own.height;
      shape.frame.width = from_.frame.width > 0 ? from_.frame.width : own.width;
    }
    mirror_y(shape);
  }
  shape.frame.says_y = own.says_y;
  shape.frame.says_units = own.says_units;
}

}  // namespace pulson
