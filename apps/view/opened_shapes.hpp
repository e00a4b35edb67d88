#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "view/document.hpp"
#include "warp/picture_files.hpp"

namespace pulson {

/// A shape of a landmark file, and where its coordinates are on the picture as the page shows it.
struct OpenedShape {
  Landmarks shape;
  Frame frame;
  int orientation = 1;  ///< of the picture, where coordinates are of its stored rows; 1: of what is displayed
  int width = 0;        ///< as displayed
  int height = 0;
  std::string picture{};  ///< path; empty: none
  std::string format{};   ///< of its file

  Points to_page(const Points& coordinates) const;
  Points from_page(const Points& pixels) const;
};

/// Pixels of a picture that is stored so, as it is displayed, and back. @param width, height as displayed
Points displayed_pixels(const Points& stored, int orientation, int width, int height);
Points stored_pixels(const Points& displayed, int orientation, int width, int height);

/// A shape that was placed on this picture, whose pixels may be 0. `notes` get what was found out of its place.
/// @throws InputError as place_picture()
OpenedShape shape_on_picture(Landmarks shape, const std::string& picture, Picture pixels,
                             std::vector<std::string>& notes);

/// A shape without a picture, on an empty one that it fits.
OpenedShape shape_without_picture(Landmarks shape);

/// All shapes as specimens of one document: landmarks correspond by their names, where all have some, else by order.
void add_shapes(const std::vector<OpenedShape>& shapes, view::ViewDocument& document);

}  // namespace pulson
