#pragma once

namespace pulson {

/// K equal steps over [0, T]: t_k = kΔt, Δt = T/K.
struct TimeGrid {
  double time = 1;
  int steps = 20;

  double dt() const { return time / steps; }
  double at(int k) const { return k == steps ? time : k * dt(); }
};

}  // namespace pulson
