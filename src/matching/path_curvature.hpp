#pragma once

#include <cstdint>

#include "path_model.hpp"

namespace pulson::matching {

/// The least curvature of the cost of a path, in the norm of its Gauss–Newton model M.
struct Curvature {
  double least = 0;         ///< μ, the least eigenvalue of Hx = μMx, H the Hessian
  double rounding = 0;      ///< of it
  PathDirection direction;  ///< its eigenvector, of norm 1; empty unless μ is negative

  bool is_negative() const { return least < -rounding; }
};

/// By Lanczos' method from a random covector. It ends at the first negative μ, or where one is overlooked with a chance
/// below 1 %.
Curvature least_curvature(const PathModel& model, const Points& source, int steps, std::uint64_t seed);

}  // namespace pulson::matching
