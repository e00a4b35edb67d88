#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::draw {

/// A shape that looks wrong, and beside it the same without the error, each over what it is judged by. d = 2 or 3; N
/// landmarks. All are aligned; in space the two longest axes are shown.
struct CorrectionPicture {
  Landmarks reference;         ///< d×N; its groups, outlines and links are theirs
  Points shape;                ///< d×N, may miss coordinates (NaN)
  Points corrected;            ///< d×N, likewise; empty: nothing mends it, and the shape is drawn alone
  std::vector<int> concerned;  ///< landmarks that are in colour and named, with arrows to where they belong; empty:
                               ///< arrows from all that move
  std::string shape_heading, corrected_heading;
};

/// The bytes of an SVG; `narrow`: in the layout for screens as narrow as a phone's. @throws InputError where the
/// reference cannot be drawn, or sizes disagree
std::string correction_svg(const CorrectionPicture& picture, bool narrow = false);

}  // namespace pulson::draw
