#pragma once

#include "pulson/matching/registration.hpp"

namespace pulson {

/// What an accurate integrator makes of a registration's momenta and increments.
struct AccurateShot {
  double end_error = 0;   ///< root mean square distance of its end to the recorded one, in diameters of the source
  double cost = 0;        ///< J of its path
  double step_error = 0;  ///< what halving its steps moved its end by, as end_error; NaN above 500 landmarks
};

/// Solves
///
///     dq = K(q)p dt + Σ_i h_i,p u_i dt,   dp = −H_q dt − Σ_i h_i,q u_i dt,   u_i = ΔW_i,k/Δt in step k,
///
/// or, in mode `metamorphosis`, u_i = λh_i(q, p), as p0 alone determines them, by the classical Runge–Kutta method with
/// at least 400 steps, doubled until the end moves by less than 1e-6 diameters or there are 3200. It shares no kernel
/// sum and no integrator with the library; nor the noise where that is `ch-sd` on all landmarks. J has the energy λ∫H
/// dt in mode `metamorphosis`, else (λ/2) p0ᵀK(q0)p0.
/// @param registration one whose data are landmarks, each with the standard deviation σ
AccurateShot shoot_accurately(const matching::Registration& registration);

/// J of two landmarks on a line, one apart, that change places, as σ → 0 and Δt → 0 in mode `metamorphosis`: with the
/// Gaussian kernel of α = 1 and `ch-sd` on both it is (∫₀¹ dr/√((1 − K(r))/λ + β²))².
double swap_closed_form(double lambda, double beta);

}  // namespace pulson
