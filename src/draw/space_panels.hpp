#pragma once

#include <vector>

#include "layers.hpp"
#include "layout.hpp"

namespace pulson::draw {

/// Arranges the three coordinate planes, of one scale, in two rows, like the faces of a box that is unfolded: with a,
/// b, c the axes from the longest range to the shortest, (a, c) and (b, c) above, (a, b) and the view from the side
/// below; or, where they are stacked, each below the other. `tallest` and `all_numbered` of the arrangement are used
/// there alone.
Plan arrange_space(const Titles& titles, const std::vector<Interval>& ranges, const Arrangement& arrangement = {});

/// The surface in a panel, below what is drawn after it; what was drawn before shines through. Nothing where it has no
/// triangles.
void draw_surface(Canvas& canvas, const View& view, const SurfaceParts& surface);

/// Which of the points, 3×N, the surface hides in a panel; none where it has no triangles.
std::vector<int> hidden_points(const View& view, const SurfaceParts& surface, const Points& points);

/// The figure without the marks of these landmarks, and with theirs alone.
struct SplitFigure {
  Figure seen;
  Figure hidden;
};
SplitFigure split(const Figure& figure, const std::vector<int>& hidden, Eigen::Index count);

/// Draws the landmarks, seen from the side, with arrows of their displacements, which are magnified where they are
/// small: by 1, 2 or 5 times a power of ten, so that the longest is at most a fifth of the diagonal of the shape. The
/// heading says by how much. The surface lies below them, or, where it has no triangles, the box around them.
/// @param from, to 3×N
void draw_displacements(Canvas& canvas, const Box& box, const Points& from, const Points& to, const Figure& figure,
                        const SurfaceParts& surface = kNoSurface);

}  // namespace pulson::draw
