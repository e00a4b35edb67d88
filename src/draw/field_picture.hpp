#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// The velocity field of a landmark path, d = 1 or 2, at K+1 times.
struct FieldPicture {
  Landmarks start;                    ///< d×N
  std::vector<double> times;          ///< K+1, increasing; K ≥ 1
  std::vector<Points> positions;      ///< q at each time, d×N
  std::vector<Points> momenta;        ///< p at each time, d×N
  std::vector<Eigen::VectorXd> axes;  ///< increasing coordinates of a grid along each axis
  std::vector<Points> velocities;     ///< u at each time, d×M, the last axis fastest
  std::string title;                  ///< one line, may be empty
  std::string subtitle;               ///< one line, may be empty
};

/// d = 1: u as a colour over time and space with the paths of the landmarks, and beside it u and the momenta over space
/// at the last time. d = 2: at the first, the middle and the last time the speed as a colour, u as arrows and the
/// landmarks. Values between grid points and times are interpolated linearly.
///
/// @throws InputError on a value that is not finite, on sizes that disagree, and where a file cannot be written; no
/// file is then written
void write_field_picture(const FieldPicture& picture, const PictureFiles& files);

/// A frame of the motion as the bytes of a png: the same at the time of index k, with a mark at it on a line, and in
/// the plane one panel. All frames have one size and one scale.
std::string field_frame_png(const FieldPicture& picture, std::size_t k, const PictureFiles& look);

}  // namespace pulson::draw
