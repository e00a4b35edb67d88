#pragma once

#include <vector>

#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson {

/// A pair problem without units: x = r/ℓ with ℓ the kernel's smallest width, s = tPK(0)/ℓ, k(x) = K(ℓx)/K(0),
///
///     dx = tanh(y/2) (1 − k(x)) ds + √ε dW,   dy = −k'(x) ds,   ε = β²/(ℓPK(0)).
///
/// It starts at x > 0 and asks for P(x(s) < 0): exchanging the labels of the pulsons maps (x, y) to (−x, −y), mirroring
/// the line maps x to −x and the momenta to −p.
struct ScaledPair {
  const KernelOperator* kernel;
  double length;     ///< ℓ
  double diffusion;  ///< ε
  double end;        ///< s at T
  double x;
  double y;
  double lipschitz;  ///< sup |k'|

  double drop(double at) const;   ///< 1 − k
  double slope(double at) const;  ///< k'
};

/// @throws InputError as crossing_probability. For β = 0 there is no mesh.
ScaledPair scaled_pair(const PairEquation& pair);

/// Nodes x_i = a sinh(iΔξ), i = −half … half, dense about the kernel's middle and ever coarser outside; y_j = y + (j −
/// start_line)Δy, so that the start lies on a line: far out the solution can be steep in y. Equal steps in s.
struct PairMesh {
  double scale;    ///< a
  double spacing;  ///< Δξ
  int half;
  double line_spacing;  ///< Δy
  int lines;
  int start_line;
  int steps;  ///< a multiple of kCurveIntervals

  int nodes() const { return 2 * half + 1; }
  double work() const { return static_cast<double>(nodes()) * lines * steps; }
};

/// Intervals between the times at which the solution is recorded.
inline constexpr int kCurveIntervals = 100;

/// The mesh whose spacings are 2^−level of the coarsest's.
PairMesh pair_mesh(const ScaledPair& pair, int level);

}  // namespace pulson
