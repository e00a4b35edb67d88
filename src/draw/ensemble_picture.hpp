#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// All that the picture of an ensemble in the plane or in space shows. d = 2 or 3; N landmarks; R ≥ 2 records.
struct EnsemblePicture {
  Landmarks start;                           ///< d×N, where every path starts; its groups are outlined one by one
  std::vector<double> times;                 ///< R times, increasing
  std::vector<Points> mean;                  ///< R entries d×N: mean positions at `times`
  std::vector<Eigen::MatrixXd> covariances;  ///< N of d×d, of the positions at the last time
  std::vector<std::vector<Points>> paths{};  ///< [path][step]: positions d×N of some paths; may be empty
  std::string title;                         ///< one line, may be empty
  std::string subtitle;                      ///< one line, may be empty
};

/// The part of a normal distribution in the plane that is within its ellipses.
inline constexpr double kEllipsePart = 0.9;

/// The ellipse of each landmark in the plane of two axes, as a closed line d×M.
std::vector<Points> ellipses(const EnsemblePicture& picture, int row_x, int row_y);

/// Draws the mean shape at the end, around each landmark the ellipse that holds nine tenths of a normal distribution of
/// its covariance, the mean paths coloured by time, and faintly the paths given, as far as they are within the panel;
/// as a PNG 1200 to 1600 pixels wide and an SVG of the same layout. d = 3: the projections xy, xz and yz. Lengths keep
/// one scale on all axes; in the plane y points down where `start.frame.y_down` says so.
///
/// @throws InputError on a value that is not finite or larger than 1e300, on sizes that disagree, and where a
/// folder does not exist; no file is then written. Safe to call from several threads.
void write_ensemble_picture(const EnsemblePicture& picture, const PictureFiles& files);

}  // namespace pulson::draw
