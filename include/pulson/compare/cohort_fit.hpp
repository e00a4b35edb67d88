#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/estimate.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::compare {

/// A source shape and its targets, all in the coordinates of the source.
struct Cohort {
  Landmarks source;
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;  ///< of each target onto the source
  /// Of the landmarks of each target, N: σ²/w is the variance of their error, in every model, and 0 as if they were
  /// missing. Empty: all 1.
  std::vector<Eigen::VectorXd> weights{};
  /// Whether the source is the mean of the targets: then their likelihood is the restricted one, see fit_cohort().
  bool about_own_mean = false;

  /// Of one target; of no size where all are 1.
  Eigen::VectorXd weights_of(std::size_t target) const { return weights.empty() ? Eigen::VectorXd() : weights[target]; }
};

/// Aligns every target with the source by a transformation of the given kind (see align()), by these weights;
/// landmarks with a missing coordinate are ignored. @throws InputError where there is no target, numbers of landmarks
/// or dimensions differ, or the source has a missing coordinate
Cohort make_cohort(const Landmarks& source, const std::vector<Landmarks>& targets, AlignmentKind alignment,
                   std::vector<Eigen::VectorXd> weights = {});

/// The settings that all models of a comparison share.
struct CohortSettings {
  KernelChoice kernel = "gaussian:alpha=auto";
  bool fit_width = false;  ///< whether the width α of the kernel is fitted, from there; of a sum all by one factor
  TimeGrid grid{1, 10};
  std::string integrator = "heun";
  Length sigma =
      Length::percent(1);  ///< standard deviation of an observed coordinate, or per cent of the source's diameter
  bool fit_sigma = false;  ///< whether σ is fitted too, from there
  std::optional<double> lambda{};  ///< weight of the energy, 1/variance of the momenta; none: fitted
  int importance_samples = 50;     ///< for each shape at most, with which the evidence is corrected; 0: Laplace's
  double sampling_error = 0.1;     ///< standard error of the cohort's log evidence at which fewer will do
  std::uint64_t seed = 1;          ///< of these
  bool upper_ends = true;          ///< whether CohortFit::greatest_noise_share is found; else it is the fit's
  /// Called after each match of a shape, for progress; from several threads.
  std::function<void()> on_match{};
};

/// A fitted parameter of a model.
struct FittedNumber {
  std::string name;          ///< `lambda`, `beta`, …
  double value = 0;          ///< if it vanishes, too small (λ: too large) to be detected in any data
  double log_deviation = 0;  ///< standard deviation of its logarithm: half of the interval of 90 % over 1.645 (from the
                             ///< curvature where there is none); NaN where it vanishes or is not determined by the data
  bool vanishes = false;     ///< the evidence is greatest at amplitude 0, or at λ = ∞
  /// Correlation with the logarithm of σ if σ were fitted too and all other parameters known, from Fisher's
  /// information: ±1 where the data cannot distinguish the two.
  double correlation_with_sigma = 0;
  /// Whether the data hardly tell a number of the noise from σ: beyond a correlation of 0.9 less than a fifth of the
  /// information on it is left where σ is fitted, too (1 − 0.9²).
  bool acts_as_sigma() const { return name != "lambda" && std::abs(correlation_with_sigma) > 0.9; }
  /// Interval of 90 %: where the evidence, maximised over the other numbers, is at most 1.35 nats below its maximum,
  /// less near a bound; wider by what the samples leave uncertain. Infinite, or that of the number's least place, where
  /// the evidence does not fall so far; NaN where none was found.
  double low = 0, high = 0;
  bool scales_noise = false;  ///< an amplitude of the noise
};

/// A model's match of one shape: the maximum of its posterior, and Laplace's approximation there.
struct ShapeFit {
  Points momenta;               ///< p0, d×N
  Eigen::MatrixXd increments;   ///< ΔW, C×K
  Points end;                   ///< q(T), d×N
  Points flow_end;              ///< q(T) of the same momenta without the noise; empty where that has no path
  matching::MatchingCost cost;  ///< its data over the directions that the alignment leaves
  double rms = 0;               ///< root mean square distance of q(T) to the target, a landmark
  double log_evidence = 0;      ///< by importance sampling, or Laplace's where no samples were drawn
  double laplace = 0;           ///< by Laplace's approximation
  double variance = 0;          ///< of log_evidence, by the samples
  Eigen::VectorXd log_sets;     ///< of the samples: log of the mean weight of each set that differs in signs alone
  int samples = 0;
  double effective_samples = 0;
  int lost_samples = 0;  ///< those without a path, of weight 0
  double distant = 0;    ///< part of the evidence where draws about the match do not come, found by others
  int coordinates = 0;   ///< n: those observed, less the directions of the alignment
  bool converged = false;
};

/// The evidence of a model with its fitted numbers, by Markov chains and bridge sampling for each shape.
struct SampledEvidence {
  std::vector<Estimate> shapes;  ///< NaN where undetermined
  Estimate total;                ///< their sum
  double worst_rhat = 1;         ///< of the log likelihood, over the shapes
};

/// A model fitted to a cohort.
struct CohortFit {
  std::string kernel;
  std::string noise;  ///< specification with the fitted numbers
  /// The noise with these, where it is not one that make_noise() makes of `noise`; else null.
  std::shared_ptr<const NoiseModel> own_noise{};
  double lambda = 0;
  double sigma = 0;  ///< of an observed coordinate, length units
  std::vector<FittedNumber> fitted;
  std::vector<ShapeFit> shapes;
  double log_evidence = 0, laplace = 0;      ///< summed over the shapes, and of_own_mean
  double of_own_mean = 0;                    ///< what integrating over the mean adds, where the source is that
  double sampling_error = 0;                 ///< standard error of the first by the samples
  Estimate step_error{};                     ///< what a comparison added for the limit of fine steps
  double effective_part = 1;                 ///< smallest effective fraction of the samples over the shapes
  std::optional<SampledEvidence> sampled{};  ///< where it was asked for: then log_evidence is that
  int coordinates = 0;                       ///< n, summed over the shapes
  bool converged = false;
  /// Fraction of the variance of the end points, linearised at rest, due to the noise: tr Σ_noise/(tr Σ_noise +
  /// tr Σ_momenta); 0 where the sum is below a millionth of σ² per coordinate, and nothing but σ is detectable.
  double noise_share = 0;
  /// The upper end of its interval of 90 %: the greatest share over all numbers that the shapes do not exclude, and
  /// over the amplitudes; 0 where none is fitted.
  double greatest_noise_share = 0;

  /// Minus half of Schwarz's criterion: log_evidence − (k/2) log n for k fitted numbers and n shapes, which are the
  /// independent units.
  double score() const;
  /// Of each shape.
  Eigen::VectorXd log_evidences() const;
  /// Whether amplitudes of the noise are fitted, and all of them vanish: of a sum no term is left.
  bool noise_vanishes() const;
  /// Whether momenta are fitted, and there are none.
  bool momenta_vanish() const;
};

/// Fits a noise model to a cohort: the shapes are independent draws from
///
///     y = q(T) + N(0, σ²),   p0 ~ N(0, (λK(q0))⁻¹),   ΔW ~ N(0, Δt),
///
/// observed but for the motions that the alignment took out (motion_directions()), whose amplitudes have a flat prior.
/// Required parameters that the specification of the noise leaves out, such as `beta` of `ch-sd`, are fitted, and so is
/// λ unless it is given, to maximise the sum of the shapes' log evidences. In Laplace's approximation, for one shape
/// with the match z* in whitened unknowns, r its residual over σ and J the derivative of q(T) over σ, both in the n
/// coordinates observed,
///
///     t = r + Jz*,  C = I + JJᵀ,   log p(y) ≈ −½ tᵀC⁻¹t − ½ log det C − n log(√(2π) σ),
///
/// which is the evidence of the model linear about z*. Of shapes about their own mean, of which S − 1 are independent,
/// the evidence is integrated over the mean with a flat prior, to first order: restricted likelihood (REML; H.
/// Patterson and R. Thompson 1971), of S complete shapes ½ log det C at rest more. J is rescaled exactly in λ, σ and
/// amplitudes, so that for matches held fixed their values of greatest evidence are found at no further path; matches
/// and numbers are updated in turn until they converge (M. Lindstrom and D. Bates 1990). From there, and from some
/// levels of noise, Newton's method maximises the evidence itself: that of draws which fit perturbed data, with the
/// same random numbers at any place (J. Bardsley et al. 2014), or Laplace's where fewer than three shapes are given or
/// the draws vary too much.
/// @param noise a specification without the parameters to be fitted, or a model, whose parameters are all kept; "none"
/// is the geodesic
/// A noise whose amplitudes are all fitted has `none` as its limit: it is searched for from there, too, and unless its
/// evidence is greater than that of `none` by more than the standard error of both, the fit is that of `none`.
/// @param none the fit of "none" with the same settings, where it is known
/// @throws InputError where an option is wrong or a parameter to be fitted has no initial value
CohortFit fit_cohort(const Cohort& cohort, const NoiseChoice& noise, const CohortSettings& settings,
                     const CohortFit* none = nullptr);

/// The least of 5, 10, 20, 40 and 80 time steps with which the ends of the geodesics that match the shapes are exact to
/// a tenth of σ, root mean square over the coordinates of each shape, beside those shot with twice the steps, and the
/// matches converge; and with which 98 of 100 geodesics drawn from the fit have a path.
int sufficient_steps(const Cohort& cohort, CohortSettings settings);

/// Whether the specification of a noise model has all required parameters.
bool is_complete(const NoiseChoice& noise, const Landmarks& shape);

/// The matching problem of one target of the cohort with the fitted parameters.
matching::MatchingProblem shape_problem(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings,
                                        int target);

}  // namespace pulson::compare
