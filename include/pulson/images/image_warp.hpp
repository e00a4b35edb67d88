#pragma once

#include <array>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson {

/// Where the pixels of an image are in the coordinates of landmarks: the centre of pixel (x, y) is at
///
///     (origin_x + spacing_x x,  origin_y + spacing_y y),   or with y_up  (…,  origin_y + spacing_y (height − y))
///
/// as in tps files, whose y counts upwards from the lower edge.
struct PixelFrame {
  std::array<double, 2> origin{0, 0};
  std::array<double, 2> spacing{1, 1};
  bool y_up = false;
  double height = 0;  ///< pixels, for y_up

  Points to_landmarks(const Points& pixels) const;
  Points to_pixels(const Points& landmarks) const;
  /// ∂landmarks/∂pixels, a diagonal.
  Eigen::Vector2d scale() const;
};

/// The whole map from pixels of a source image to pixels of a target image, by the source's frame, the alignment, the
/// flow and the target's frame, with gradients in pixels. Thread-safe.
class ImageWarp {
 public:
  /// Holds a reference to the flow. @throws InputError unless it is of the plane
  ImageWarp(const MaterialFlow& flow, Alignment alignment, const PixelFrame& source, const PixelFrame& target);

  MovedPoints forward(const Points& pixels) const;
  /// @throws InputError where the flow is not a diffeomorphism
  MovedPoints backward(const Points& pixels) const;
  /// Where the alignment alone takes pixels of the source, in pixels of the target.
  Points aligned(const Points& pixels) const;
  /// Places at every time of the flow, in pixels of the target.
  std::vector<Points> paths(const Points& pixels) const;

  const MaterialFlow& flow() const { return flow_; }
  const PixelFrame& source() const { return source_; }
  const PixelFrame& target() const { return target_; }
  /// In pixels.
  double landmark_error() const;
  /// −1 where the alignment and the frames mirror the plane, so that a negative Jacobian is not a fold; else 1.
  int orientation() const;

  /// The landmarks' labels in pixels of the source, and their paths in pixels of the target.
  Points label_pixels() const;
  std::vector<Points> landmark_paths() const;

 private:
  const MaterialFlow& flow_;
  Alignment alignment_;
  PixelFrame source_;
  PixelFrame target_;
};

}  // namespace pulson
