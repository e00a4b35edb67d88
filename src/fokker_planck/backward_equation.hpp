#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson::fokker_planck {

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

/// The backward Kolmogorov equation of a scaled pair: u(s, x, y) = P(x(s) < 0 from (x, y)) obeys
///
///     u_s = A u + v u_y,   A = ½ε ∂_xx + tanh(y/2) (1 − k(x)) ∂_x,   v = −k'(x),   u(0, x, y) = 1 if x < 0, ½ if x =
///     0.
///
/// One step is, with S f(x, y) = f(x, y + vΔs) by cubic interpolation along y,
///
///     (I − ½Δs A) u⁺ = S (I + ½Δs A) u.
///
/// As v does not depend on y, its steady states have A u + (2/Δs) tanh(½Δs v∂_y) u = 0: their error is (Δs v∂_y)²/12
/// whatever ε is. A symmetric splitting has terms of ε there and needs steps short against the time of diffusion
/// through the kernel, α²/β², which is what limits large β. Also, kept as w = (I + ½Δs A) u, a step takes one
/// tridiagonal solve for each y: w⁺ = 2u⁺ − S w.
///
/// The first two steps are each two of implicit Euler of half length, with the same matrices, which damp the jump of
/// u(0) (R. Rannacher, 1984). A is in central differences; x = 0 is a node, where the kink of K may be. The domain ends
/// with ∂_x u = 0, ∂_y u = 0.
class BackwardEquation {
 public:
  BackwardEquation(const ScaledPair& pair, const PairMesh& mesh);

  void step();

  /// u at the start.
  double at_start() const;

 private:
  // Where the values of one node's lines come from in S: weights on the lines j + first, … + first + 3.
  struct Shift {
    std::size_t node;
    std::ptrdiff_t first;
    std::array<double, 4> weights;
  };

  void discretise(const ScaledPair& pair);
  void factorise();
  void find_start(const ScaledPair& pair);
  std::vector<Shift> shifts(const ScaledPair& pair, double step) const;
  void advect(const std::vector<Shift>& shifts);
  void solve(double new_weight, double old_weight);
  double position(double node) const;

  PairMesh mesh_;
  std::size_t nodes_, lines_;
  double dt_;  // Δs
  int taken_ = 0;
  std::vector<double> left_, right_, drift_;  // ½Δs A: u_{i−1} (left − drift τ_j) + u_{i+1} (right + drift τ_j) − …
  std::vector<double> tau_;                   // tanh(y_j/2)
  std::vector<double> inverse_pivot_, upper_;  // LU factors of I − ½Δs A for every line, index as for u
  std::vector<Shift> half_shifts_, full_shifts_;
  std::ptrdiff_t margin_ = 0;
  std::vector<double> padded_;   // one node's lines with margins beyond both ends
  std::vector<double> u_;        // index node·lines + line
  std::vector<double> carried_;  // w, or u while damping
  std::size_t start_node_ = 0;   // of four that interpolate u at the start
  std::array<double, 4> start_weights_{};
};

}  // namespace pulson::fokker_planck
