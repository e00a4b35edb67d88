#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "view/document.hpp"
#include "view/opened_shape.hpp"
#include "warp/picture_files.hpp"

namespace pulson {

/// A shape that was opened, and its picture.
struct PlacedShape {
  view::OpenedShape opened;
  std::string picture{};  ///< path; empty: none
};

/// A shape that was placed on this picture, whose pixels may be 0; it gets the picture's name where it has none.
/// `notes` get what was found out of its place. @throws InputError as place_picture()
PlacedShape shape_on_picture(Landmarks shape, const std::string& picture, Picture pixels,
                             std::vector<std::string>& notes);

/// A shape without a picture, on an empty one that it fits.
PlacedShape shape_without_picture(Landmarks shape);

/// All shapes as further specimens of the document: landmarks correspond by their names, where all have some, else by
/// order.
void add_shapes(const std::vector<PlacedShape>& shapes, view::ViewDocument& document);

}  // namespace pulson
