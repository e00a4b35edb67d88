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

/// Where a map folds, by its Jacobian at the pixels of the image.
struct ImageFolds {
  std::vector<bool> folded;    ///< row by row
  double folded_fraction = 0;  ///< of the pixels
  double min_jacobian = 1;
};

/// Pages of one size pushed forward, and where the map folds.
struct PushedMesh {
  PushedImage pushed;
  ImageFolds folds;
  double map_error = 0;
};
PushedMesh push_image(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options);

}  // namespace pulson::images
