#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/frame.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/images/image.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson::images {

/// How the value between pixels is made: of the nearest, or of the 2×2 (linear), 4×4 (cubic, a = -3/4) or 8×8 (lanczos)
/// nearest. Cubic and lanczos overshoot at edges. `label` is for numbers that name something, which have no mean: the
/// nearest, and where a pixel has several samples the value of most of them, so that no value is made up.
enum class Interpolation : std::uint8_t { kNearest, kLinear, kCubic, kLanczos, kLabel };

/// The values beyond the edge, here of abcd: a fill value; aaa|abcd|ddd; cba|abcd|dcb; or nothing: alpha 0, and the
/// result has an alpha channel whether or not the source has.
enum class Border : std::uint8_t { kConstant, kReplicate, kReflect, kTransparent };

/// Names and help of each: nearest, linear, cubic, lanczos, label; constant, replicate, reflect, transparent.
const NameTable<Interpolation>& interpolation_table();
const NameTable<Border>& border_table();

/// @throws InputError that lists the valid names
Interpolation parse_interpolation(std::string_view name);
Border parse_border(std::string_view name);

/// For each pixel of a result, row by row, the position in the source that it shows: the inverse of the map that moves
/// the picture.
struct PixelMap {
  int width = 0;
  int height = 0;
  /// x to the right, y downwards, in pixels of the source with pixel centres at integers; width·height of them. A place
  /// that is not finite is nowhere: there the result is the fill, or transparent where the border is.
  std::vector<std::array<float, 2>> places;
};

struct RemapOptions {
  Interpolation interpolation = Interpolation::kLinear;
  Border border = Border::kConstant;
  /// In units and order of the source's channels, for nowhere and beyond a constant border; what is not there is 0. For
  /// images with alpha the default is transparent.
  std::vector<double> fill{};
};

/// result(i) = source(map.places[i]), with the source's format (but see Border::kTransparent). A place that is a whole
/// pixel, up to rounding of float32, takes that pixel as it is, whatever its type; elsewhere means are computed in
/// float32 for numbers of up to 16 bits and float32, in float64 for others, and rounded to the type. A NaN is in a mean
/// only where it has a weight. With straight alpha, colours are mixed in proportion to their opacity; the colour of
/// what is fully transparent becomes 0, but for nearest and label. Nothing is averaged where the map shrinks: see
/// scaled_down. Runs on all threads.
Image remap(const Image& source, const PixelMap& map, const RemapOptions& options = {});

/// Places of landmarks in the plane of a picture, 2×N: those on a line, 1×N, lie in the middle of its rows.
Points in_plane(const Points& places, const Frame& frame);

/// The whole map from pixels of a source image to pixels of a target image, by the source's frame, the alignment, the
/// flow and the target's frame, with gradients in pixels. A flow on a line moves all rows of a strip alike: x by the
/// flow, and each pixel stays in its row. Thread-safe.
class ImageWarp {
 public:
  /// Holds a reference to the flow. @throws InputError unless it is of a line or the plane
  ImageWarp(const warp::MaterialFlow& flow, Alignment alignment, const Frame& source, const Frame& target);

  warp::MovedPoints forward(const Points& pixels) const;
  /// @throws InputError where the flow is not a diffeomorphism
  warp::MovedPoints backward(const Points& pixels) const;
  /// Where the alignment alone takes pixels of the source, in pixels of the target.
  Points aligned(const Points& pixels) const;
  /// Where the inverse of the alignment alone takes pixels of the target, in pixels of the source.
  Points aligned_backward(const Points& pixels) const;
  /// Places at every time of the flow, in pixels of the target.
  std::vector<Points> paths(const Points& pixels) const;

  const warp::MaterialFlow& flow() const { return flow_; }
  const Frame& source() const { return source_; }
  const Frame& target() const { return target_; }
  /// In pixels.
  double landmark_error() const;
  /// −1 where the alignment and the frames mirror the plane, so that a negative Jacobian is not a fold; else 1.
  int orientation() const;

  /// The landmarks' labels in pixels of the source, and their paths in pixels of the target.
  Points label_pixels() const;
  std::vector<Points> landmark_paths() const;

 private:
  // Labels of pixels, d×M, after the alignment; and back.
  Points labels_of(const Points& pixels) const;
  Points source_pixels(const Points& labels, const Points& rows_of) const;
  // Places, d×M, in pixels of the target; on a line in the rows of `rows_of`.
  Points target_pixels(const Points& places, const Points& rows_of) const;
  // ∂label/∂pixel and ∂place/∂pixel, on a line with 1 for the rows.
  Eigen::Matrix2d label_scale() const;
  Eigen::Vector2d place_scale() const;

  const warp::MaterialFlow& flow_;
  Alignment alignment_;
  Frame source_;
  Frame target_;
};

}  // namespace pulson::images
