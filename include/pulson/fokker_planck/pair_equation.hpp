#pragma once

#include <array>
#include <vector>

#include "pulson/core/time_grid.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::fokker_planck {

/// A normal distribution on the line.
struct NormalLaw {
  double mean = 0;
  double variance = 1;

  double density(double x) const;

  /// P(X ≤ x)
  double cdf(double x) const;
};

/// A single pulson on the line, or one far from all others: dq = K(0)p dt + β dW, dp = 0, from h = βp.
struct FreePulson {
  double q = 0;
  double p = 0;
  double beta = 1;
  double at_zero = 1;  ///< K(0)
};

/// Where a free pulson is at a time t > 0: the position's factor of (15), normal with mean q + K(0)p t and variance
/// β²t. The momentum's factor is δ(p − p̄). @throws InputError if a number is not finite, or β, K(0) or t not positive
NormalLaw position_law(const FreePulson& pulson, double time);

/// The same after the last step of (20), exactly: normal with variance β²(T − ¾Δt), as w_k = ½(ΔW_{k−1} + ΔW_k) with
/// ΔW_{−1} = 0 leaves half of the last increment to a step that is not taken. @throws InputError as position_law, or if
/// there is no step
NormalLaw position_law_of_scheme(const FreePulson& pulson, const TimeGrid& grid);

/// The marginals of q₁ and q₂ given by the two terms of (18). As a function, (18) is their sum; the joint density
/// of two distant pulsons is their product. @throws InputError as position_law
std::array<NormalLaw, 2> pair_marginals(const FreePulson& first, const FreePulson& second, double time);

/// The gap q₂ − q₁ of two pulsons that stay far apart, with independent noises: NormalLaw::cdf(0) is then the
/// probability that the second is left of the first. @throws InputError as position_law
NormalLaw gap_law(const FreePulson& first, const FreePulson& second, double time);

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
  double tolerance = 1e-2;  ///< grids are refined until the stated error is below this part of the probability
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

  bool converged = false;  ///< error ≤ tolerance · probability, or of the size of rounding
  std::vector<double>
      grids;  ///< the probability on each grid, each of half the spacing and time step of the one before

  std::vector<double> times;       ///< 0 … T, equally spaced
  std::vector<double> curve;       ///< the probability at each time
  std::vector<double> fine_curve;  ///< the same after each of the finest grid's `steps`, from 0; empty for β = 0
  double curve_error = 0;          ///< the largest change of the curve between the two finest grids

  int gap_points = 0;  ///< the finest grid's number of nodes in r
  int momentum_lines = 0;
  int steps = 0;
  double seconds = 0;  ///< time taken by all grids
};

/// P(q₂(t) < q₁(t)) for q₁(0) < q₂(0) (or with both signs reversed) for all t up to T, without sampling: the backward
/// Kolmogorov equation of the pair on a grid in (r, y).
///
/// K is any kernel, kinks included; momenta are both positive or both negative. For β = 0 the answer is 0, as landmarks
/// of the deterministic equation cannot pass each other. Small probabilities take more grids: of the paper's pair with
/// β = 0.75, 0.5 and 0.25 (p = 0.055, 0.0081, 1.9e-6) the error is 1, 9 and 116 % on three grids, 0.2, 2 and 72 % on
/// four, 0.05, 0.5 and 24 % on five.
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

}  // namespace pulson::fokker_planck
