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

/// What became of the cohorts of one model.
struct RecoveryRow {
  TrueModel truth;
  std::vector<int> chosen;  ///< how often each candidate had the greatest score
  int unfit = 0;            ///< cohorts that no candidate could be fitted to
  /// Part of the variance of the displacements from the source that the noise has: 1 − that without it over that with
  /// it, by 1000 forward samples.
  double noise_share = 0;
  double displacement = 0;  ///< root mean square of a coordinate of the displacements, length units
};

/// Draws cohorts from each of some models and fits all candidates to each: how often would the right one be chosen,
/// with so many shapes? The candidates' numbers that are left open are fitted each time.
/// @throws InputError where a model is incomplete or draws no shapes
std::vector<RecoveryRow> study_recovery(const Landmarks& source, const std::vector<TrueModel>& truths,
                                        const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options);

}  // namespace pulson
