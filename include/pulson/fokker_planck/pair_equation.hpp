#pragma once

#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// Two pulsons on the line with noise of constant amplitude in their positions: h₁ = β₁p₁ and h₂ = β₂p₂ with
/// independent Wiener processes, of which only β = √(β₁² + β₂²) matters here. The paper's §5.2 has β₁ = 0.
///
/// With (17) the total momentum P = p₁ + p₂ is kept, and r = q₂ − q₁, y = ln(p₂/p₁) obey
///
///     dr = P tanh(y/2) (K(0) − K(r)) dt + β dW,   dy = −P K'(r) dt.
struct PairEquation {
  KernelOperator kernel;
  double beta = 1;
  double time = 100;  ///< T
  double q1 = 0;
  double q2 = 10;
  double p1 = 4;
  double p2 = 1;
};

struct PairEquationOptions {
  double tolerance = 1e-3;  ///< grids are refined until the stated error is below it
  int most_grids = 4;       ///< but no further than this; at least 2. Three are solved in any case, where allowed
};

/// Crossing probabilities and how well they are known.
struct PairCrossing {
  double probability = 0;  ///< that q₂ − q₁ has changed its sign at T, on the finest grid

  /// The change of the probability between the two finest grids where that is at most half of the change before, else
  /// the larger of both. The scheme is of second order, so this is about three times the actual error where the grids
  /// resolve the solution. Of two grids, their difference.
  double error = 0;

  /// log₂ of the ratio of the last two changes: near 2 where the grids resolve the solution; 0 if the change grew or
  /// changed sign, or there were only two grids.
  double order = 0;

  bool converged = false;  ///< error ≤ tolerance
  std::vector<double>
      grids;  ///< the probability on each grid, each of half the spacing and time step of the one before

  std::vector<double> times;  ///< 0 … T, equally spaced
  std::vector<double> curve;  ///< the probability at each time
  double curve_error = 0;     ///< the largest change of the curve between the two finest grids

  int gap_points = 0;  ///< the finest grid's number of nodes in r
  int momentum_lines = 0;
  int steps = 0;
  double seconds = 0;  ///< time taken by all grids
};

/// P(q₂(t) < q₁(t)) for q₁(0) < q₂(0) (or with both signs reversed) for all t up to T, without sampling: the backward
/// Kolmogorov equation of the pair on a grid in (r, y).
///
/// K is any kernel, kinks included; momenta are both positive or both negative. For β = 0 the answer is 0, as landmarks
/// of the deterministic equation cannot pass each other. For small β the error stays below the tolerance as the
/// probability vanishes, but is a growing fraction of it: of 0.02 a few percent, of 0.0005 a third (three grids).
///
/// Cost: three grids take 0.1 to 1 s for the paper's problems, in proportion to T P sup|K'| and eight times more for
/// each further grid. One problem is solved on one thread; the result does not depend on the number of threads.
/// Thread-safe.
/// @throws InputError if a number is not finite, β negative, T not positive, q₁ = q₂, the momenta are not of one strict
/// sign, an option is out of range, or T P sup|K'| is above 1e7, which would take long
PairCrossing crossing_probability(const PairEquation& pair, const PairEquationOptions& options = {});

/// The same for many problems, on all threads. @throws InputError as above
std::vector<PairCrossing> crossing_probabilities(const std::vector<PairEquation>& pairs,
                                                 const PairEquationOptions& options = {});

}  // namespace pulson
