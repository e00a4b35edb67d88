#pragma once

#include "layers.hpp"
#include "layout.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// From how many landmarks on a line on a picture shows their map, beside which paths over time say little.
inline constexpr int kManyOnLine = 16;

/// Draws into the box, which is that of both frames, the registration of landmarks on a line as a map: target and
/// result over the source, and beside it, or below where they are stacked, the displacements, with the curve on which
/// points between the landmarks go.
void draw_map_panels(Canvas& canvas, const Box& box, bool stacked, const RegistrationPicture& picture,
                     const Figure& figure);

}  // namespace pulson::draw
