#pragma once

#include "figures.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The result of one warp of an image.
struct WarpedImage {
  images::Image image;
  std::vector<std::uint8_t> multiplicity;  ///< of the result's pixels
  std::vector<bool> holes;
  WarpFigures figures;
  std::vector<float> displacements;  ///< where a field is asked for
  bool pulled = false;
  std::vector<float> deviations;          ///< of samples, of the result's pixels
  std::vector<float> fold_probabilities;  ///< of samples, of the image's pixels
};

/// The image carried by the map, by the method asked for. @throws InputError, StepError
WarpedImage warp_image(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                       const WarpArguments& arguments);

/// The map's Jacobian at the pixels of the image, positive where it is no more than mirrored. @return width·height
/// numbers
std::vector<float> jacobians_on_image(const images::Image& image, const images::ImageWarp& warp,
                                      const WarpArguments& arguments);

/// How far each pixel of the image moves after the alignment, landmark units. @return width·height numbers
std::vector<float> displacements_on_image(const images::Image& image, const images::ImageWarp& warp,
                                          const WarpArguments& arguments);

/// Priorities of a mesh's cells for SheetOrder::kPriority: the rank of the nearest landmark where one is no further
/// than landmarks are from each other (the median distance to the nearest other); -1, beneath all, elsewhere.
std::vector<float> label_order(const images::Image& image, const Points& landmarks, const std::vector<int>& ranks);

/// The image pushed forward, with the mesh's folds; for warps of the source. `folded`: flipped fraction of each pixel.
struct PushedMesh {
  images::PushedImage pushed;
  warp::MeshFolds folds;
  double min_jacobian = 1;
  double map_error = 0;
};
PushedMesh push_image(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                      const WarpArguments& arguments);

/// Landmarks carried along, in any dimension; marks that have a missing coordinate stay missing. @throws InputError
WarpFigures warp_points(const warp::MaterialFlow& flow, const matching::Registration& registration,
                        const WarpArguments& arguments);

/// The mean of the warped image over samples of the noise with the fitted momenta, the deviation from it and the
/// probability of folds. @throws InputError where there is no noise or no sample has a path
WarpedImage warp_samples(const images::Image& image, const matching::Registration& registration,
                         const WarpFrames& frames, const WarpArguments& arguments);

}  // namespace pulson
