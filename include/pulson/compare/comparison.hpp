#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/prediction.hpp"
#include "pulson/core/estimate.hpp"

namespace pulson {

/// The shapes as given, and the source that they are compared with.
struct CohortShapes {
  std::optional<Landmarks> source{};  ///< none: their Procrustes mean
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;

  /// The cohort of some of the targets, all where the list is empty, about the source or the mean of these.
  Cohort cohort(const std::vector<int>& chosen = {}) const;
};

/// Merges landmarks that are at the same position in the source and in every target, such as the first and last point
/// of a closed outline; without a source, those at the same position in all shapes. A note is added for each.
/// @param merge whether to merge landmarks that differ in a target as well, at the mean of both
/// @throws InputError where such landmarks differ in a target and `merge` is false
void merge_coincident(CohortShapes& shapes, bool merge, std::vector<std::string>& notes);

struct CompareOptions {
  CohortSettings settings{};
  int folds = 5;              ///< of the predictive scores; 0: none
  int forward_samples = 400;  ///< from each model
  bool maps = true;           ///< whether folded areas are measured
  int bootstrap = 0;          ///< cohorts drawn without noise for each p-value; 0: from its limit for many shapes
  /// Called before each model is fitted, for progress.
  std::function<void(int model, const std::string& noise)> on_model{};
};

/// One model of a comparison. Standard errors are over the shapes; NaN where there is one shape.
struct ComparedModel {
  std::string noise;  ///< as it was given
  CohortFit fit;
  Estimate energy, action, total, rms;  ///< mean of a shape
  std::optional<Prediction> prediction{};
  Estimate order_inversions, flipped_triangles, folded_fraction;  ///< mean of a shape; NaN where not asked or defined
  double score = 0;                                               ///< CohortFit::score()
  Estimate difference;  ///< of the score from that of the best; its standard error is that of a sum over shapes
  double weight = 0;    ///< e^score over the sum of all models'
  /// Probability that the evidence gains as much over that of `none` where there is no noise; NaN where `none` was not
  /// compared or this model fits no number more. From how many cohorts: 0, the mean of χ² of no and of one degree.
  double p_value = std::numeric_limits<double>::quiet_NaN();
  int bootstrapped = 0;
  Eigen::VectorXd spectrum;  ///< N: variance of a coordinate of the displacements along each eigenvector, predicted
  Eigen::VectorXd
      noise_displacement;  ///< N: displacement of each landmark by the noise, root mean square over the shapes
  int lost_samples = 0;    ///< forward samples without a path
  double seconds = 0;
};

/// Which noise model best explains these shapes?
struct Comparison {
  Cohort cohort;
  CohortSettings settings;            ///< its kernel and σ are numbers
  std::vector<ComparedModel> models;  ///< in the order given
  std::size_t best = 0;               ///< of greatest score
  Eigen::VectorXd eigenvalues;        ///< N: of K(q0), in descending order
  /// N: mean square over shapes and axes of the displacements y − q0 along each eigenvector, and its standard error; of
  /// the complete shapes.
  Eigen::VectorXd observed, observed_error;
  std::vector<std::string> notes;  ///< what a user should know, a line each
};

/// Fits every noise model to the same shapes with the same kernel and σ, and ranks them by score(): the log-evidence
/// less (k/2) log n for k fitted numbers and n shapes. The scores predict held-out shapes by models that were
/// fitted to the others (k-fold; the mean shape is of the others, too).
/// @throws InputError where a model cannot be fitted; the message names it
Comparison compare_models(const CohortShapes& shapes, const std::vector<NoiseChoice>& noises,
                          const CompareOptions& options = {});

}  // namespace pulson
