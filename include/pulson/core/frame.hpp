#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace pulson {

/// Which pixels landmarks were placed on: the rows that the picture's file stores, or the picture as programs display
/// it, turned and mirrored as the file's EXIF or TIFF orientation says.
enum class Orientation : std::uint8_t { kStored, kDisplayed };

/// How coordinates in the plane lie on a picture: the centre of the pixel in column x and row y, counted from 0 at the
/// top left, is at
///
///     (origin_x + unit_x x,  origin_y + unit_y y)   or, with y upwards,   (…,  origin_y + unit_y (height − y)),
///
/// as in tps files, whose y counts upwards from the lower edge.
struct Frame {
  std::array<double, 2> origin{0, 0};
  std::array<double, 2> unit_per_pixel{1, 1};  ///< units of the coordinates
  bool y_down = true;
  int height = 0;           ///< of the picture, pixels, as the landmarks were placed on it; 0: not known
  int width = 0;            ///< the same
  bool says_y = false;      ///< whether the direction of y is what a file or an option says, and no default
  bool says_units = false;  ///< the same of unit_per_pixel and origin
  Orientation orientation = Orientation::kStored;

  /// Positions of pixels, 2×N, in coordinates, and back. With y upwards the height must be known.
  Eigen::MatrixXd to_landmarks(const Eigen::MatrixXd& pixels) const;
  Eigen::MatrixXd to_pixels(const Eigen::MatrixXd& landmarks) const;
  /// ∂landmarks/∂pixels, a diagonal.
  Eigen::Vector2d scale() const;
};

}  // namespace pulson
