#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pulson/core/landmarks.hpp"

namespace pulson::view {

/// A shape of a landmark file, and where its coordinates are on the picture as the page shows it. In a document it is
/// without its landmarks, which the document holds.
struct OpenedShape {
  Landmarks shape;      ///< its frame is the one that an exported file says
  Frame frame;          ///< pixels of the stored picture in its coordinates; width and height are known
  int orientation = 1;  ///< of the picture, where coordinates are of its stored rows; 1: of what is displayed

  int width() const { return orientation > 4 ? frame.height : frame.width; }  ///< as displayed, pixels
  int height() const { return orientation > 4 ? frame.width : frame.height; }
  Points to_page(const Points& coordinates) const;
  /// Coordinates in the fewest digits that are at these pixels, to the bit: those that were not moved are as their file
  /// has them, where it has them in fewer than 17 digits.
  Points from_page(const Points& pixels) const;
};

/// Pixels of a picture that is stored so, as it is displayed, and back. @param width, height as displayed
Points displayed_pixels(const Points& stored, int orientation, int width, int height);
Points stored_pixels(const Points& displayed, int orientation, int width, int height);

/// All of it but the shape's address.
nlohmann::ordered_json json_of_opened(const OpenedShape& opened);
/// @param file what messages call the file
OpenedShape opened_of_json(const nlohmann::json& json, const std::string& file);

}  // namespace pulson::view
