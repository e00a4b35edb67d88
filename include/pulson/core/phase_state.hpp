#pragma once

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// A point (q, p) of phase space: positions and momenta of N landmarks, both d×N.
struct PhaseState {
  Points q;
  Points p;
};

}  // namespace pulson
