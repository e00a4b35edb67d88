#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"

namespace pulson {

/// A model that shapes are drawn from.
struct TrueModel {
  NoiseChoice noise = "none";  ///< complete
  double lambda = 0;           ///< 1/variance of the momenta: must be given
  std::string kernel{};        ///< empty: that of the settings
};

struct RecoveryOptions {
  CohortSettings settings{};  ///< kernel, σ and grid of all models; its λ, where given, is held in every fit
  int cohorts = 20;           ///< from each model
  int shapes = 20;            ///< in each cohort
  AlignmentKind alignment = AlignmentKind::kNone;
  std::uint64_t seed = 1;
  /// Called after each cohort, for progress; from one thread at a time.
  std::function<void(int done, int all)> on_cohort{};
};

/// What one candidate made of one cohort.
struct RecoveredFit {
  std::vector<FittedNumber> numbers;
  double log_evidence = 0;  ///< NaN where it cannot be fitted
};

/// How the cohorts drawn from one model were classified.
struct RecoveryRow {
  TrueModel truth;
  std::vector<int> chosen;                      ///< how often each candidate had the greatest score
  std::vector<std::vector<RecoveredFit>> fits;  ///< [cohort][candidate]
  int unfit = 0;                                ///< cohorts to which no candidate could be fitted
  /// Fraction of the variance of the displacements from the source due to the noise: 1 − variance without noise over
  /// variance with noise, from 1000 forward samples.
  double noise_share = 0;
  double displacement = 0;  ///< root mean square of a coordinate of the displacements, length units
};

/// Draws cohorts from several models and fits all candidates to each: how often would the right one be chosen with this
/// sample size? Parameters that a candidate leaves open are fitted each time.
/// @throws InputError where a model is incomplete or draws no shapes
std::vector<RecoveryRow> study_recovery(const Landmarks& source, const std::vector<TrueModel>& truths,
                                        const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options);

}  // namespace pulson
