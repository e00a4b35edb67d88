#pragma once

#include <array>

#include "pulson/core/time_grid.hpp"

namespace pulson {

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

}  // namespace pulson
