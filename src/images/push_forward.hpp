#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pulson/images/image_warp.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::images {

struct PushOptions {
  Interpolation interpolation = Interpolation::kLinear;  ///< between pixels of the source
  /// Of what is not covered, in units and order of the source's channels, 0 where it ends; none: transparent, and the
  /// result has alpha.
  std::optional<std::vector<double>> fill = std::vector<double>();
};

struct PushedImage {
  Image image;
  std::vector<Image> more;                 ///< the other pages
  std::vector<std::uint8_t> multiplicity;  ///< most sheets over MeshRaster::for_counts(), row by row
  std::vector<bool> uncovered;             ///< pixels without any sheet
  warp::Coverage coverage;                 ///< its sheets are those of `multiplicity`
};

/// The picture carried along by a map that may fold: the deformed mesh of its pixels, in the order of sheets that the
/// options ask for. A pixel whose samples lie on one sheet and cover about one pixel of the source shows the source at
/// their mean position, as a pull-back would, so that nothing is blurred; else it is the mean of its samples: at edges
/// of sheets, at holes, and where the map shrinks.
/// @param mesh of the source's pixel corners, (width+1)×(height+1) vertices
/// @param priority see MeshRaster
/// @throws InputError where the mesh does not fit a page, and as MeshRaster
PushedImage push_forward(std::span<const Image* const> pages, warp::DeformedMesh mesh,
                         const warp::RasterOptions& raster, const PushOptions& options = {},
                         std::vector<float> priority = {});
/// The same of one page.
PushedImage push_forward(const Image& source, warp::DeformedMesh mesh, const warp::RasterOptions& raster,
                         const PushOptions& options = {}, std::vector<float> priority = {});

}  // namespace pulson::images
