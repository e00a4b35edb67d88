#pragma once

#include <limits>
#include <vector>

#include "audit.hpp"
#include "landmark_law.hpp"

namespace pulson::audit {

/// Log odds of what is exactly so, and therefore not by chance.
inline constexpr double kLogCertain = std::numeric_limits<double>::infinity();

/// A shape as it is judged.
struct Judged {
  Points points;            ///< d×N as given, NaN where missing
  bool is_in_order = true;  ///< its landmarks are one outline, which may begin elsewhere or run the other way round
  bool has_others = false;  ///< the law is that of other shapes, not of a pair
  double typical_distance =
      0;  ///< root mean square of landmarks of the other shapes from their mean, of the law's size
};

struct Odds {
  double shapes_per_error = 50;  ///< prior: one shape in so many has an error, all kinds and places alike
  double least_log = 0;          ///< of what is found
};

/// Takes the most probable finding, mends it and goes on, until none is probable enough. Where what is then left of a
/// cohort's shape is not one of its kind, that alone is said of it.
/// @param law of all landmarks that the others have
std::vector<Finding> judge(const LandmarkLaw& law, const Judged& shape, const Odds& odds);

}  // namespace pulson::audit
