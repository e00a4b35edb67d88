#pragma once

#include <cstdint>
#include <vector>

#include "warp/mesh_raster.hpp"

namespace pulson {

/// How a band, or the sum of several, is covered.
struct Coverage {
  int max_multiplicity = 0;
  std::int64_t samples = 0;
  std::int64_t uncovered = 0;

  /// Samples without any sheet over all samples.
  double uncovered_fraction() const;
  Coverage& operator+=(const Coverage& other);
};

Coverage coverage(const RasterBand& band);

/// The pixels of a band none of whose samples is covered, row by row.
std::vector<bool> uncovered_pixels(const RasterBand& band);

/// The pixels of `mask` that are not 4-connected to the border within the mask:
/// the holes, where `mask` is what is uncovered. @param mask width·height, row by row @throws InputError if it is not
/// so
std::vector<bool> enclosed(const std::vector<bool>& mask, int width, int height);

}  // namespace pulson
