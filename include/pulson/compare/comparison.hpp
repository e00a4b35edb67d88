#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/prediction.hpp"
#include "pulson/core/estimate.hpp"

namespace pulson {

/// Shapes as they were given, and what they are compared with.
struct CohortShapes {
  std::optional<Landmarks> source{};  ///< none: their Procrustes mean
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;

  /// The cohort of some of the targets, all where the list is empty, about the source or the mean of these.
  Cohort cohort(const std::vector<int>& chosen = {}) const;
};

/// Takes landmarks at one place in the source as one where they are so in every target, too, such as the first and
/// last point of a closed outline; without a source, those at one place in all shapes. A note is added for each.
/// @param merge whether landmarks that a target has apart become one as well, at the mean of both
/// @throws InputError where a target has such landmarks apart and `merge` is false
void merge_coincident(CohortShapes& shapes, bool merge, std::vector<std::string>& notes);

struct CompareOptions {
  CohortSettings settings{};
  int folds = 5;              ///< of the predictive scores; 0: none
  int forward_samples = 400;  ///< from each model
  bool maps = true;           ///< whether folded areas are measured
  /// Called before each model is fitted, for progress.
  std::function<void(int model, const std::string& noise)> on_model{};
};

/// One model of a comparison. Standard errors are over the shapes; NaN where there is one shape.
struct ComparedModel {
  std::string noise;  ///< as it was given
  CohortFit fit;
  Estimate energy, action, total, rms;  ///< mean of a shape
  Estimate sampled_log_evidence;        ///< by importance sampling, of all shapes; its Monte Carlo error
  double effective_part = 0;            ///< the least effective part of these samples over the shapes
  std::optional<Prediction> prediction{};
  Estimate order_inversions, flipped_triangles, folded_fraction;  ///< mean of a shape; NaN where not asked or defined
  double score = 0;                                               ///< CohortFit::score()
  Estimate difference;        ///< of the score from that of the best; its standard error is that of a sum over shapes
  double weight = 0;          ///< e^score over the sum of all models'
  Eigen::VectorXd spectrum;   ///< N: variance of a coordinate of the displacements along each eigenvector, predicted
  Eigen::VectorXd noise_way;  ///< N: root mean square over the shapes of what the noise moved each landmark
  int lost_samples = 0;       ///< forward samples without a path
  double seconds = 0;
};

/// Which noise do these shapes call for?
struct Comparison {
  Cohort cohort;
  CohortSettings settings;            ///< its kernel and σ are numbers
  std::vector<ComparedModel> models;  ///< in the order of the question
  std::size_t best = 0;               ///< of greatest score
  Eigen::VectorXd eigenvalues;        ///< N: of K(q0), falling
  /// N: mean square over shapes and axes of the displacements y − q0 along each eigenvector, and its standard error; of
  /// the complete shapes.
  Eigen::VectorXd observed, observed_error;
  std::vector<std::string> notes;  ///< what a user should know, a line each
};

/// Fits every noise model to the same shapes with the same kernel and σ, and ranks them by score(): the log-evidence
/// less (k/2) log n for k fitted numbers and n coordinates. The scores predict held-out shapes by models that were
/// fitted to the others (k-fold; the mean shape is of the others, too).
/// @throws InputError where a model cannot be fitted; the message names it
Comparison compare_models(const CohortShapes& shapes, const std::vector<NoiseChoice>& noises,
                          const CompareOptions& options = {});

}  // namespace pulson
