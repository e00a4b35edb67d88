#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/cohort.hpp"
#include "pulson/core/length.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {

/// What all models of a comparison share.
struct CohortSettings {
  KernelChoice kernel = "gaussian:alpha=auto";
  TimeGrid grid{};
  std::string integrator = "variational";
  Length sigma =
      Length::percent(1);  ///< standard deviation of an observed coordinate, or per cent of the source's diameter
  std::optional<double> lambda{};  ///< weight of the energy, 1/variance of the momenta; none: fitted
  int importance_samples = 200;    ///< for each shape, with which the evidence is checked
  std::uint64_t seed = 1;          ///< of these
  /// Called after each match of a shape, for progress; from several threads.
  std::function<void()> on_match{};
};

/// A number of a model that was fitted.
struct FittedNumber {
  std::string name;          ///< `lambda`, `beta`, …
  double value = 0;          ///< where it vanishes, so small, of λ so large, that no data would show it
  double log_deviation = 0;  ///< standard deviation of its logarithm; NaN where it vanishes or the data do not tell it
  bool vanishes = false;     ///< the greatest evidence is at amplitude 0, of λ at infinity
  /// Correlation with the logarithm of σ, were σ fitted too and all other numbers known, from Fisher's information: ±1
  /// where the data cannot tell the two apart. NaN where it vanishes.
  double correlation_with_sigma = 0;
};

/// A model's match of one shape: the maximum of its posterior, and Laplace's approximation there.
struct ShapeFit {
  Points momenta;              ///< p0, d×N
  Eigen::MatrixXd increments;  ///< ΔW, C×K
  Points end;                  ///< q(T), d×N
  Points flow_end;             ///< q(T) of the same momenta without the noise; empty where that has no path
  MatchingCost cost;           ///< its data over the directions that the alignment leaves
  double rms = 0;              ///< root mean square distance of q(T) to the target, a landmark
  double log_evidence = 0;
  /// The same by importance sampling from Laplace's approximation, with the variance of that logarithm and the
  /// effective number of samples; NaN and 0 where none were asked for.
  double sampled_log_evidence = 0;
  double sampled_variance = 0;
  double effective_samples = 0;
  int coordinates = 0;  ///< n: those observed, less the directions of the alignment
  bool converged = false;
};

/// A model fitted to a cohort.
struct CohortFit {
  std::string kernel;
  std::string noise;  ///< specification with the fitted numbers
  /// The noise with these, where it is not one that make_noise() makes of `noise`; else null.
  std::shared_ptr<const NoiseModel> own_noise{};
  double lambda = 0;
  std::vector<FittedNumber> fitted;
  std::vector<ShapeFit> shapes;
  double log_evidence = 0;  ///< summed over the shapes
  int coordinates = 0;      ///< the same of n
  int rounds = 0;
  bool converged = false;
  /// Part of the variance of the end points, linear about the matches, that the noise has: tr Σ_noise/(tr Σ_noise + tr
  /// Σ_momenta).
  double noise_share = 0;

  /// Schwarz's criterion, halved and with its sign turned: log_evidence − (k/2) log n for k fitted numbers.
  double score() const;
};

/// Fits a noise model to a cohort: the shapes are independent draws from
///
///     y = q(T) + N(0, σ²),   p0 ~ N(0, (λK(q0))⁻¹),   ΔW ~ N(0, Δt),
///
/// observed but for the motions that the alignment took out (motion_directions()), whose amplitudes have a flat prior.
/// Numbers that the specification of the noise must have and has not, as `beta` of `ch-sd`, are fitted, and λ unless it
/// is given, so as to maximise the sum of the shapes' log-evidences by Laplace's approximation. For one shape, with the
/// match z* in whitened unknowns, r its residual over σ and J the derivative of q(T) over σ, both in the n coordinates
/// observed,
///
///     t = r + Jz*,  C = I + JJᵀ,   log p(y) ≈ −½ tᵀC⁻¹t − ½ log det C − n log(√(2π) σ),
///
/// which is the evidence of the model linear about z*, and equal to log_evidence() where z* is the minimum of all
/// unknowns. In terms of variances v_g of momenta and channels C = I + Σ_g v_g M_g, so that for matches held fixed the
/// v_g of greatest evidence are found by Fisher scoring at no further path; matches and v_g are found in turn, until
/// they rest (M. Lindstrom and D. Bates 1990). Numbers that are no amplitudes (`gamma`) are searched for around that.
/// @param noise a specification, numbers that are to be fitted left out, or a model, whose numbers are all kept; "none"
/// is the geodesic
/// @throws InputError where an option is wrong or a number that must be fitted has no start
CohortFit fit_cohort(const Cohort& cohort, const NoiseChoice& noise, const CohortSettings& settings);

/// Whether the specification of a noise lacks no number that it must have.
bool is_complete(const NoiseChoice& noise, const Landmarks& shape);

/// The problem of one target of the cohort with the numbers of a fit.
MatchingProblem shape_problem(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings, int target);

}  // namespace pulson
