#pragma once

#include <vector>

#include "audit.hpp"
#include "landmark_law.hpp"

namespace pulson::audit {

/// A shape as it is judged.
struct Judged {
  Points points;              ///< d×N as given, NaN where missing
  bool is_in_order = true;    ///< its landmarks are one outline, which may begin elsewhere or run the other way round
  bool has_others = false;    ///< the law is that of other shapes, not of a pair
  double relative_distance = 1;  ///< from the mean, over that of the others' median
};

/// Takes the most probable finding, mends it and goes on, until none is probable enough.
std::vector<Finding> judge(LandmarkLaw law, const Judged& shape, double shapes_per_error);

}  // namespace pulson::audit
