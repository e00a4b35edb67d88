#pragma once

#include <utility>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson {

inline constexpr int kMaterialPaths = 41;  ///< of a line's material points, in pictures

/// The box of all that is drawn of a registration, with a margin, as {lower corner, upper corner}.
std::pair<Eigen::VectorXd, Eigen::VectorXd> drawn_box(const Registration& registration);

/// Lines of a square grid over a box in the plane, each 2×M. @param cells along the larger side
std::vector<Points> grid_lines(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int cells, int points_per_cell);

/// The points of all lines, one line after the other; and back, with as many points for each as `lines` have.
Points joined_lines(const std::vector<Points>& lines);
std::vector<Points> split_lines(const Points& points, const std::vector<Points>& lines);

}  // namespace pulson
