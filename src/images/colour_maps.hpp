#pragma once

#include <optional>
#include <vector>

#include "pulson/images/image.hpp"

namespace pulson::images {

/// Values as colours of viridis (Smith, van der Walt and Firing, 2015): dark violet at `low`, by green, to yellow at
/// `high`, and so beyond. @param values width·height, row by row; NaN becomes transparent @return 8-bit with alpha
/// @throws InputError unless low < high, both finite
Image viridis(const std::vector<float>& values, int width, int height, double low, double high);

/// The scale of signed values: white at `centre`, blue to `centre - reach` and red to `centre + reach`, and so beyond.
struct DivergingScale {
  double centre = 0;
  double reach = 1;
  /// Values less than this are yellow, which the scale has nowhere else: 0 shows where a Jacobian determinant says that
  /// the map folds.
  std::optional<double> marked_below = std::nullopt;
};

/// Values as colours of ColorBrewer's RdBu (Harrower and Brewer, 2003), reversed. @param values width·height, row by
/// row; NaN becomes transparent @return 8-bit with alpha @throws InputError unless reach > 0, all finite
Image diverging(const std::vector<float>& values, int width, int height, const DivergingScale& scale);

}  // namespace pulson::images
