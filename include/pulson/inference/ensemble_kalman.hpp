#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {

struct EnsembleKalmanOptions {
  int members = 100;  ///< m
  int rounds = 4;     ///< R
  /// Distance at the source from which on a landmark's data have no weight, length units; infinity: all data have the
  /// same weight; none: see automatic_localisation()
  std::optional<double> localisation{};
  int paths_kept = 400;  ///< evenly spaced
  std::uint64_t seed = 1;
  /// Called with the fraction done, for progress; from several threads.
  std::function<void(double fraction)> on_progress{};
};

/// An approximate sample of the posterior.
struct EnsembleDraws {
  PosteriorDraws draws;              ///< of one chain without parameters and evidence; a draw is a member
  std::vector<double> localisation;  ///< of each specimen, length units
  int lost = 0;                      ///< members left out, for want of a path
  double misfit = 0;                 ///< the mean of |r|²/n over members and specimens, about 1 or below where data are fitted
};

/// Samples the posterior of momenta and increments approximately, without derivatives, by the ensemble smoother with
/// multiple data assimilation (A. Emerick and A. Reynolds 2013): θ is held at its medians.
///
/// Members x_i = (v, ΔW), i = 1 … m, are drawn from the prior; v = (K(q0) + εI)p0 are the velocities at the source. In
/// each of R rounds all paths are integrated, and with h_i the predicted data, h_i = q(T) at the observed landmarks,
///
///     x_i ← x_i + C_xh (C_hh + R·Σ)⁻¹ (y + √R e_i − h_i),   e_i ~ N(0, Σ),
///
/// Σ the covariance of the data. For data linear in x the members are draws of the posterior as m → ∞; for others
/// they are an approximation without error estimate.
///
/// The covariances C are those of the other members: of ten groups each is updated by the gain of the nine others
/// (M. Buehner 2020), so that the sample does not shrink by fitting its own noise. v at a landmark, and the increments
/// of the channels that act there, are updated by the data nearby alone (local analysis: B. Hunt, E. Kostelich and
/// I. Szunyogh 2007): Σ⁻¹ is multiplied with gaspari_cohn() of the distance at the source. Channels that act over more
/// than a quarter of the radius take all data.
///
/// Cost: (R + 1)m paths, a factorisation of N×N, and O(m²n + m³) for each landmark and round, n its data. The members
/// are updated in parallel; the draws have the same bits for any number of threads.
/// @throws InputError for a tree, a problem with parameters, or an option out of its range; NumericalError where fewer
/// than half of the members have a path
EnsembleDraws sample_ensemble(const PosteriorProblem& problem, const EnsembleKalmanOptions& options);

/// The fifth-order compactly supported correlation of G. Gaspari and S. Cohn (1999, eq. 4.10): 1 at distance 0, 0 from
/// `radius` on; 1 everywhere for an infinite radius.
double gaspari_cohn(double distance, double radius);

}  // namespace pulson::inference
