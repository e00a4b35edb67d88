#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

inline constexpr int kMaterialPaths = 41;  ///< of a line's material points, in pictures

/// The box of all that is drawn of a registration, with a margin, as {lower corner, upper corner}.
std::pair<Eigen::VectorXd, Eigen::VectorXd> drawn_box(const matching::Registration& registration);

/// Lines of a square grid over a box in the plane, each 2×M. @param cells along the larger side
std::vector<Points> grid_lines(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int cells, int points_per_cell);

/// The points of all lines, one line after the other; and back, with as many points for each as `lines` have.
Points joined_lines(const std::vector<Points>& lines);
std::vector<Points> split_lines(const Points& points, const std::vector<Points>& lines);

/// What the picture of a registration shows: its path, and the grid that the flow carries along.
draw::RegistrationPicture make_registration_picture(const matching::Registration& registration, const Trajectory& path);

/// What pictures call a shape: its name; where that is a mere number or LJSON, the file's name and the number.
std::string short_name(const Landmarks& shape);

/// Adds to it where the noise acts, and which landmarks prediction doubts.
void add_verdicts(const records::RegistrationFacts& facts, draw::RegistrationPicture& picture);

/// A picture below landmarks that move, and the corners of the box that it covers.
struct PageImage {
  html::EncodedPicture picture;
  Eigen::Vector2d low;
  Eigen::Vector2d high;
};

/// Where the material of a motion is at the start, and the image below it.
struct MaterialBox {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  std::optional<PageImage> below = std::nullopt;
};

/// Adds to a motion in 1D or 2D the material between its landmarks, at these steps of the path. None where the plane
/// between the landmarks has no path though they have one, and of very many landmarks; the more landmarks, the coarser.
void add_material(const StochasticSystem& system, const Trajectory& path, const std::vector<int>& steps,
                  const MaterialBox& box, html::ReportMotion& motion);

/// What the report of a registration plays: its landmarks at no more than 41 times of the path, and in 1D and 2D the
/// material that goes with them. The more landmarks, the fewer times and the coarser the grid. The image `below` goes
/// with the grid. None where the numbers are too large to be drawn.
std::optional<html::ReportMotion> registration_motion(const matching::Registration& registration,
                                                      const Trajectory& path, const std::vector<int>& outliers,
                                                      const std::optional<PageImage>& below = std::nullopt);

}  // namespace pulson
