#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson {

struct FitOptions {
  std::vector<std::string> names;  ///< what is fitted, see fit_parameters()
  double tolerance = 1e-3;         ///< relative, of each value
  int max_evaluations = 200;       ///< of the search; each takes one match for every target
  /// Called after each evaluation, for progress; log_evidence is −∞ where it failed.
  std::function<void(int evaluation, const Eigen::VectorXd& values, double log_evidence)> on_evaluation{};
};

/// Parameters θ of greatest evidence, and the models that have them.
struct FittedParameters {
  std::vector<std::string> names;
  Eigen::VectorXd values;  ///< θ; of a name in several terms of a sum: in the first of them
  /// Standard deviations of log θ: roots of the diagonal of (−∇² log p)⁻¹ in log θ at the maximum, by central
  /// differences. NaN where −∇² log p is not positive definite or a value is at the end of the search; the others are
  /// then those with that value held.
  Eigen::VectorXd log_deviations;
  double log_evidence = 0;  ///< summed over the targets
  int evaluations = 0;      ///< of the search and of the differences
  bool converged = false;   ///< the search, and every match at its end
  std::string kernel;       ///< specification
  std::string noise;        ///< specification
  double sigma = 0;         ///< of the observations, length units
  double lambda = 0;
  std::string note{};  ///< what there is to know about the result, in words; empty: nothing
};

/// Fits parameters of the kernel, of the noise and of the observations to one or more targets, taken for independent
/// draws from the model: maximises
///
///     Σ_targets log p(y | θ)
///
/// with Laplace's approximation log_evidence() of each, over log θ within a factor 100 of the start, by BOBYQA (M.
/// Powell 2009; no derivatives). It starts at the options; where these are automatic (alpha=auto, no lambda), at what
/// they are for the source when aligned with the first target, and that is then the same for all targets.
///
/// Names: `alpha` and `weight` of the kernel, the parameters of the noise (`beta`, `gamma`, `width`, …; of
/// trouve-vialard and langevin `sigma`), `data-sigma` for the deviation of the observations, and `lambda`. A name that
/// occurs in several terms of a sum is a common factor on all of them, which keep their ratios; `ch-sd.beta` is that of
/// one term, `ch-sd#2.beta` of the second of that name. Without noise, `weight` of a kernel of one term and 1/`lambda`
/// say the same and cannot be fitted together.
///
/// A match that cannot be computed counts as a very low evidence. The targets are shared out over threads; the result
/// does not depend on their number.
/// @throws InputError where the shapes do not fit together, an option is wrong, a parameter is none of these models
/// (the message lists theirs), given twice or not positive at the start, or the evidence cannot be computed there
FittedParameters fit_parameters(const Landmarks& source, const std::vector<Landmarks>& targets,
                                const RegistrationOptions& options, const FitOptions& fit);

/// The match of a pair with noise of one amplitude.
struct HomotopyStep {
  double beta = 0;  ///< of the noise; of a sum that of its first term: all are scaled alike
  MatchingCost cost;
  double rms = 0;  ///< length units
  bool matched = false;
  bool converged = false;
  int iterations = 0;

  /// The fraction by which J would grow if β were halved, to first order: dJ/d ln β = −2·action.
  double growth() const;
};

/// How far from diffeomorphic a pair is: J(β) in mode metamorphosis while β is halved ten times, each search over paths
/// beginning with the last one's path. J grows as β falls: where a diffeomorphism matches, to that of LDDMM; else
/// without bound, or until the match is lost. (design: mathematics §4.1)
/// @param registration what register_shapes() made of the other arguments
/// @throws InputError where the mode is not metamorphosis
std::vector<HomotopyStep> follow_homotopy(const Landmarks& source, const Landmarks& target,
                                          const RegistrationOptions& options, const Registration& registration);

/// @throws InputError where follow_homotopy() would
void require_homotopy(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options);

/// The last step before the first that is not matched; the end where the first is not.
std::vector<HomotopyStep>::const_iterator least_needed(const std::vector<HomotopyStep>& steps);

/// Whether all of them match, and J hardly grows any more at the end.
bool reaches_diffeomorphism(const std::vector<HomotopyStep>& steps);

/// The contribution of flow and noise to each landmark's displacement, and its share of the cost.
struct LandmarkShares {
  /// d×N: displacement by the flow of the same momenta without noise; empty where its steps have no root.
  Points flow;
  /// d×N: displacement by the noise, q(T) − q0 − flow; empty where `flow` is.
  Points noise;
  Eigen::VectorXd energy;  ///< N, (λ/2) p_a·v_a: the energy is their sum
  /// N, ½ Σ_k |ΔW_k|²/Δt over the channels that move this landmark; empty where a channel moves several, or there is no
  /// action.
  Eigen::VectorXd action;
  Eigen::VectorXd data;  ///< N, the landmark's share of D; empty for curves
};

LandmarkShares landmark_shares(const Registration& registration);

/// The fraction of the displacement due to the noise: Σ_a noise_a·(q_a(T) − q_a(0)) / Σ_a |q_a(T) − q_a(0)|²; none if
/// nothing moves.
std::optional<double> noise_fraction(const Registration& registration, const LandmarkShares& shares);

}  // namespace pulson
