#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {

struct EnsembleKalmanOptions {
  int members = 100;  ///< m, at least 20
  int rounds = 8;     ///< R, at least
  /// Radius of gaspari_cohn(), length units; infinity: all data have the weight 1. Automatic, where none is given: from
  /// the predictions of the first round the radius where the members resolve m/8 directions of the data near a
  /// landmark, tr G(G + I)⁻¹ with G their weighted covariance over that of the errors, or as many as the data of two
  /// landmarks where that is more.
  std::optional<double> localisation{};
  int paths_kept = 400;  ///< at most, evenly spaced
  std::uint64_t seed = 1;
  /// Called with the fraction of the data that is assimilated, for progress.
  std::function<void(double fraction)> on_progress{};
};

/// An approximate sample of the posterior.
struct EnsembleDraws {
  PosteriorDraws draws;              ///< one chain, a draw for each member; no parameters, weights or evidence
  std::vector<double> localisation;  ///< radius of each specimen, length units
  int lost = 0;                      ///< members that were dropped
  int rounds = 0;                    ///< of the specimen that took most
  double misfit = 0;                 ///< mean of |r|²/n over members and specimens; about 1 or less in the posterior
};

/// Samples the posterior of momenta and increments approximately and without derivatives, by the ensemble smoother with
/// multiple data assimilation (A. Emerick and A. Reynolds, Computers & Geosciences 55, 2013, §2.2). θ is held at its
/// medians.
///
/// The members x_i = (v, ΔW), i = 1 … m, are drawn from the prior, with v = (K(q0) + εI)p0. In each round the paths
/// of all members are integrated, and with h_i = q(T) at the observed coordinates
///
///     x_i ← x_i + C_xh (C_hh + αΣ)⁻¹ (y + √α e_i − h_i),   e_i ~ N(0, Σ),
///
/// Σ the covariance of the data, C the covariances of the members, until the sum of 1/α is 1. Where h is linear, the
/// members are draws of the posterior in the limit m → ∞. 1/α is at most 1/R, and at most the greater of n/E|r|² and
/// √(2n/Var|r|²) over the members, n the number of data and r the residuals in standard deviations, so that updates are
/// small where the members are far from the data (M. Iglesias and Y. Yang, Inverse Problems 37, 2021, §3.1). The
/// increments have to be updated with the momenta: rounds that each take them as unknown again would count data with
/// noise as often.
///
/// Localisation (B. Hunt, E. Kostelich and I. Szunyogh, Physica D 230, 2007): v at a landmark, and the increments of
/// the channels that act about it, are updated by the data nearby, with Σ⁻¹ times gaspari_cohn() of the distance at the
/// source. Channels that act over more than a quarter of the radius take all data, with one weight that is less than 1
/// where more than m/8 directions are resolved. The numbers are drawn so that priors and errors have the mean 0 over
/// the members.
///
/// A member without a path, or whose path goes ten times as far as the median one, is dropped. Cost: m paths for each
/// round and at the end, a factorisation of N×N, and O(m²n + m³) for each landmark and round, n the number of data
/// within the radius. Members and landmarks are worked on in parallel; the draws have the same bits for any number of
/// threads.
/// @throws InputError for a tree, a problem with parameters, or an option out of its range; NumericalError where more
/// than half of the members, or all but 19, are dropped, or R + 200 rounds do not suffice
EnsembleDraws sample_ensemble(const PosteriorProblem& problem, const EnsembleKalmanOptions& options);

/// The compactly supported correlation function of G. Gaspari and S. Cohn (Q. J. R. Meteorol. Soc. 125, 1999,
/// eq. 4.10): 1 at distance 0, 0 from `radius` on; 1 everywhere for an infinite radius.
double gaspari_cohn(double distance, double radius);

}  // namespace pulson::inference
