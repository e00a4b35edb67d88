#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// Points of a file in the coordinates of the shape that a map starts from, and back from those of the shape that it
/// leads to: axes and units of length, the direction of y, units per pixel. Where the file does not say how high its
/// picture is, that is the picture of the registered shape.
class PointsFrame {
 public:
  PointsFrame(const Landmarks& from, const Landmarks& to) : from_(from), to_(to) {}

  /// @throws InputError as in_frame_of
  Landmarks enter(Landmarks shape, std::vector<std::string>& notes) const;
  /// With y and units per pixel as the file has them. @param own the frame that the file has
  void leave(Landmarks& shape, const Frame& own) const;

 private:
  const Landmarks& from_;
  const Landmarks& to_;
};

}  // namespace pulson
