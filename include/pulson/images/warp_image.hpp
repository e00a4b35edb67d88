#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pulson/images/image.hpp"
#include "pulson/images/image_warp.hpp"
#include "pulson/warp/sheet_order.hpp"

namespace pulson::images {

/// Which way an image is carried: every pixel of the result looks up where it comes from (pull), or the mesh of the
/// image's pixels is moved and drawn (push), or the first of these that the map allows.
enum class WarpMethod : std::uint8_t { kAuto, kPull, kPush };

struct WarpImageOptions {
  int width = 0;  ///< of the result, pixels
  int height = 0;
  WarpMethod method = WarpMethod::kAuto;
  bool inverse = false;  ///< from target to source: the image is of the target
  Interpolation interpolation = Interpolation::kLinear;
  Border border = Border::kTransparent;  ///< beyond the image; where it is pushed, all but transparent are the fill
  std::vector<double> fill{};            ///< in units and order of the image's channels; 0 where it ends
  warp::SheetOrder over = warp::SheetOrder::kLeastStretched;  ///< where the map folds
  std::vector<int> label_ranks{};                             ///< for SheetOrder::kPriority: of each landmark
  int supersampling = 2;                                      ///< samples of a push per pixel and axis, 1 to 8
  double tolerance = 0.05;                                    ///< largest error of the interpolated map, pixels
  bool with_displacements = false;
  std::int64_t max_pixels = kMaxPixels;  ///< of the result
};

/// What a map does to an image.
struct MapFigures {
  /// Of the image's pixels those where the map folds (warp::is_fold); where pulled, of the result's pixels that show
  /// the image.
  double folded_fraction = 0;
  double min_jacobian = 1;   ///< at them, of the map from source to target, positive where it is no more than mirrored
  int max_multiplicity = 1;  ///< most points of the image that land on one pixel
  double uncovered_fraction = 0;
  double hole_fraction = 0;
  double map_error = 0;  ///< pixels
};

struct WarpedImage {
  Image image;                             ///< width × height
  std::vector<Image> more = {};            ///< the other pages
  bool pulled = false;                     ///< else pushed
  std::string reason;                      ///< of that, as in "the map folds"
  std::vector<std::uint8_t> multiplicity;  ///< points of the image that land on each pixel of the result
  std::vector<bool> holes;                 ///< pixels of the result that nothing covers, with something all around
  /// Landmark units, two numbers a pixel: where pulled from each pixel of the result to where it comes from, where
  /// pushed from each pixel of the image to where it goes. Empty unless asked for.
  std::vector<float> displacements;
  MapFigures figures;
};

/// The image carried by a map: image'(φ(x)) = image(x), φ = warp.forward. With kAuto it is pulled where φ is a
/// diffeomorphism whose steps have an inverse, so that no pixel is blurred, and else pushed, which shows folds and
/// holes as they are. With `inverse` image'(x) = image(φ(x)), which is always pulled.
/// @param warp from pixels of the source to pixels of the target: with `inverse` those of the result come first
/// @throws InputError where `method` cannot be had, where the result has more than max_pixels, and as MeshRaster for
/// `supersampling`; StepError where a step of the flow is too long Runs on all threads; memory: see push_forward.
WarpedImage warp_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options);
/// All pages of a picture by one map. @throws InputError also unless all are of one size
WarpedImage warp_image(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options);

/// The Jacobian determinant of φ, or with `inverse` of its inverse, at the pixels of the image, positive where the map
/// is no more than mirrored. @return width·height numbers, row by row @throws InputError with `inverse` where the map
/// has none
std::vector<float> jacobians_on_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options);

/// How far each pixel of the image moves after the alignment, landmark units. @return, @throws as jacobians_on_image
std::vector<float> displacements_on_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options);

}  // namespace pulson::images
