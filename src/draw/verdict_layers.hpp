#pragma once

#include <vector>

#include "layers.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// Where the flow has its energy and the noise its action, below the landmarks at `pixels` (2×N): a disc around each
/// whose area is its part of it, and triangles the darker, the more their corners have of it, in the mean. Nothing
/// where there is none.
void draw_energy(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture);
void draw_action(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture);

/// A ▲ above each landmark that is doubted, at `pixels` (2×N). @param gap from the landmark, pixels
void draw_doubts(Canvas& canvas, const Points& pixels, const std::vector<int>& doubted, double gap);

/// The entries of what these draw.
std::vector<LegendEntry> legend_of_verdicts(const RegistrationPicture& picture);

}  // namespace pulson::draw
