#pragma once

#include <string>
#include <string_view>

namespace pulson::warp {

/// Which sheet is on top where several cover a sample.
enum class SheetOrder {
  kLeastStretched,  ///< orientation-preserving before reversing, then the smallest largest singular value of the
                    ///< triangle's affine map, then the first
  kAverage,         ///< all sheets
  kFirst,           ///< the first triangle, row by row
  kPriority         ///< the largest priority of the cell, then the least stretched
};

/// @throws InputError that lists the valid names: least-stretched, average, first, label-order
SheetOrder parse_over(std::string_view name);
std::string over_name(SheetOrder over);

}  // namespace pulson::warp
