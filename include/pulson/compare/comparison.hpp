#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/predictive_checks.hpp"
#include "pulson/compare/sigma_profile.hpp"
#include "pulson/core/estimate.hpp"

namespace pulson::compare {

/// How well a model predicts one shape.
struct ShapePrediction {
  double energy_score = 0;  ///< length units per landmark, see energy_score(); lower is better
  double coverage = 0;      ///< fraction of the coordinates within the central 90 % of the samples
};

/// Of held-out shapes.
struct Prediction {
  double energy_score = 0, energy_score_error = 0;  ///< mean and its standard error
  double coverage = 0, coverage_error = 0;
  std::vector<ShapePrediction> shapes;
};

/// The energy score of samples X_i for the outcome y (T. Gneiting, A. Raftery 2007, (21)), unbiased:
///
///     (1/M) Σ_i |X_i − y| − 1/(2M(M−1)) Σ_ij |X_i − X_j|
///
/// over the observed coordinates of y. Zero only for the distribution concentrated at y.
/// @param samples n×M @param outcome n, NaN where unknown @throws InputError for fewer than two samples
double energy_score(const Eigen::MatrixXd& samples, const Eigen::VectorXd& outcome);

/// The fraction of the known coordinates of an outcome within the central `part` of the samples: at least as high as
/// quantile (1 − part)/2 and at most as high as (1 + part)/2, by linear interpolation.
double coverage(const Eigen::MatrixXd& samples, const Eigen::VectorXd& outcome, double part);

/// Samples drawn from a model, with errors of observation, and aligned as the cohort's shapes are: dN×M.
Eigen::MatrixXd aligned_samples(const Cohort& cohort, const matching::MatchingProblem& model, int count,
                                std::uint64_t seed);

/// Of the targets of `held`, by a model that was fitted to others.
/// @param samples of that model, aligned onto the source of `held`
std::vector<ShapePrediction> predict(const Cohort& held, const Eigen::MatrixXd& samples);

Prediction summary(std::vector<ShapePrediction> shapes);

/// The shapes as given, and the source that they are compared with.
struct CohortShapes {
  std::optional<Landmarks> source{};  ///< none: their Procrustes mean
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;
  std::vector<Eigen::VectorXd> weights{};  ///< Cohort::weights

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
  bool maps = true;           ///< whether folded areas are measured, and paths of least cost are searched
  bool sampled_evidence =
      false;          ///< whether models are ranked by the evidence of Markov chains at their fitted numbers
  int bootstrap = 0;  ///< cohorts drawn without noise for each p-value; 0: from its limit for many shapes
  /// Whether the best model is checked by the cohorts that it draws, the others where it fails, and the verdict over σ,
  /// and how often each model would be recognised; of four shapes or more.
  bool checks = true;
  /// Called before each model is fitted, for progress, from the thread that fits it: several are fitted at a time.
  std::function<void(int model, const std::string& noise)> on_model{};
};

/// The paths that match the shapes at the least cost with a model's fitted numbers: metamorphoses, whose energy λ∫H dt
/// is paid along the path (mode `metamorphosis` of a registration), geodesics where there is no noise. A mean is of a
/// shape; NaN where the search failed for some, or where not defined.
struct LeastCostPaths {
  Estimate total, action, rms;
  Estimate order_inversions, flipped_triangles;
  int matched = 0;    ///< shapes whose rms is at most 3σ
  int converged = 0;  ///< shapes whose search did
};

/// How often cohorts of as many shapes, drawn from a model, would reveal it: its score is the greatest, and more than 3
/// above that of `none`; of `none`, no other's is. By the models linear at rest.
struct Recognition {
  double noise_share = 0;  ///< of the variance of what was drawn: as fitted, or a third where less than a tenth was
  double part = 0;         ///< of the cohorts
  int cohorts = 0;
};

/// One model of a comparison. Standard errors are over the shapes; NaN where there is one shape.
struct ComparedModel {
  std::string noise;  ///< as it was given
  CohortFit fit;
  Estimate energy, action, total, rms;    ///< mean of a shape
  int matched = 0;                        ///< shapes whose rms is at most 3σ
  std::optional<LeastCostPaths> paths{};  ///< where the noise is linear in p or there is none, and it was asked
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
  std::optional<PredictiveChecks> checks{};  ///< of the best model, of the others where that fails
  std::optional<Recognition> recognition{};  ///< where `none` was compared, too
  int lost_samples = 0;                      ///< forward samples without a path
  double seconds = 0;

  /// Whether the difference from the best is decisive: more than 3 nats and two standard errors.
  bool is_behind() const;
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
  std::optional<SigmaProfile> profile{};

  /// CohortFit::step_error of a model less that of the best, which the difference of their scores has been corrected
  /// by.
  double step_error(const ComparedModel& model) const;
  /// With how many steps the corrections would be small enough to be right, and what they may leave, half of
  /// step_error(), would not change which model is the best and which are behind; none where these do.
  std::optional<int> steps_wanted() const;
};

/// Fits every noise model to the same shapes with the same kernel and σ, and ranks them by score(): the log-evidence
/// less (k/2) log n for k fitted numbers and n shapes. The scores predict held-out shapes by models that were
/// fitted to the others (k-fold; the mean shape is of the others, too).
/// @throws InputError where a model cannot be fitted; the message names it
Comparison compare_models(const CohortShapes& shapes, const std::vector<NoiseChoice>& noises,
                          const CompareOptions& options = {});

/// A model that shapes are drawn from.
struct TrueModel {
  NoiseChoice noise = "none";  ///< complete
  double lambda = 0;           ///< 1/variance of the momenta: must be given
  std::string kernel{};        ///< empty: that of the settings
  double sigma = 0;            ///< of an observed coordinate, length units; 0: that of the settings
};

struct RecoveryOptions {
  CohortSettings settings{};  ///< kernel, σ and grid of all models; its λ, where given, is held in every fit
  int cohorts = 20;           ///< from each model
  int shapes = 20;            ///< in each cohort
  AlignmentKind alignment = AlignmentKind::kNone;
  std::uint64_t seed = 1;
  /// Called after each cohort, for progress; from one thread at a time.
  std::function<void(int done, int all)> on_cohort{};
  bool about_own_mean = false;  ///< whether each cohort is compared with its own mean, and not with the source
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

/// What the candidates made of one cohort.
struct RecoveredCohort {
  std::vector<RecoveredFit> fits;  ///< of each candidate
  int chosen = -1;                 ///< the candidate with the greatest score; −1: none could be fitted
};

/// Draws cohorts from several models and fits all candidates to each: how often would the right one be chosen with this
/// sample size? Parameters that a candidate leaves open are fitted each time.
/// @throws InputError where a model is incomplete or draws no shapes
std::vector<RecoveryRow> study_recovery(const Landmarks& source, const std::vector<TrueModel>& truths,
                                        const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options);

/// The cohorts of study_recovery() one by one, to be shared out among processes: each depends on the seed and its
/// number alone.
class RecoveryStudy {
 public:
  /// @throws InputError where a model is incomplete or draws no shapes
  RecoveryStudy(const Landmarks& source, const std::vector<TrueModel>& truths,
                const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options);

  /// RecoveryOptions::cohorts from each model.
  int cohorts() const { return static_cast<int>(rows_.size()) * options_.cohorts; }
  /// Draws cohort 0 … cohorts() − 1 and fits the candidates to it. Thread-safe. @throws NumericalError
  RecoveredCohort cohort(int index) const;
  /// What study_recovery() makes of all cohorts.
  std::vector<RecoveryRow> rows(const std::vector<RecoveredCohort>& cohorts) const;

 private:
  Landmarks source_;
  std::vector<NoiseChoice> candidates_;
  RecoveryOptions options_;
  std::vector<matching::MatchingProblem> problems_;  // of each true model
  std::vector<RecoveryRow> rows_;                    // without cohorts
};

}  // namespace pulson::compare
