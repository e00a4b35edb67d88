#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson::inference {

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
                                const matching::RegistrationOptions& options, const FitOptions& fit);

}  // namespace pulson::inference
