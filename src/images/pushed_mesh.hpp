#pragma once

#include <span>
#include <vector>

#include "images/push_forward.hpp"
#include "pulson/images/warp_image.hpp"

namespace pulson::images {

/// Priorities of a mesh's cells for SheetOrder::kPriority: the rank of the nearest landmark where one is no further
/// than landmarks are from each other (the median distance to the nearest other); -1, beneath all, elsewhere.
/// @param landmarks in pixels of the image @throws InputError unless each has a rank
std::vector<float> label_order(const Image& image, const Points& landmarks, const std::vector<int>& ranks);

/// Pages of one size pushed forward, with the mesh's folds. `reversed_in_cell`: flipped triangles at each pixel of the
/// image.
struct PushedMesh {
  PushedImage pushed;
  warp::MeshFolds folds;
  double min_jacobian = 1;
  double map_error = 0;
};
PushedMesh push_image(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options);

}  // namespace pulson::images
