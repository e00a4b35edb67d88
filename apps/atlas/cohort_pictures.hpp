#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/cohort/atlas.hpp"
#include "pulson/images/image.hpp"

namespace pulson {

/// The pictures of a cohort on its template: pixel x of each is that of the specimen's picture at φ(x), where φ is the
/// geodesic from the template to the specimen.
struct CohortPictures {
  Eigen::Vector2d low{0, 0}, high{0, 0};           ///< corners of the box about the template that they cover
  images::Image mean;                              ///< of all, where they are; RGBA
  std::vector<std::optional<images::Image>> each;  ///< S, smaller; none where the picture is not known
  int count = 0;                                   ///< how many are
};

/// Of the pictures that the shapes' files name and that are beside them. None where the plane is not that of the
/// shapes, or no picture is known; a line of `notes` for each that cannot be used.
/// @param shapes as they were given, in the order of the specimens
std::optional<CohortPictures> cohort_pictures(const cohort::Atlas& atlas, const std::vector<Landmarks>& shapes,
                                              std::vector<std::string>& notes);

/// The mean picture as the geodesic with these momenta carries it, on the box about the template that it covers; none
/// where the map has no inverse.
std::optional<images::Image> carried_picture(const CohortPictures& pictures, const cohort::Atlas& atlas,
                                             const Trajectory& path);

}  // namespace pulson
