#pragma once

#include <cstdint>
#include <vector>

#include "cohort_model.hpp"

namespace pulson::compare {

/// Fraction of effective samples of a shape below which their evidence is uncertain: 50 draws of which 5 count have an
/// error of about half a nat.
inline constexpr double kFewEffective = 0.1;

inline bool are_enough(double effective_samples, int samples) {
  return samples > 0 && effective_samples >= kFewEffective * samples;
}
inline bool is_sampled(const ShapeFit& shape) { return are_enough(shape.effective_samples, shape.samples); }

/// The evidence of one shape by importance sampling, see sample_shape().
struct ImportanceEstimate {
  double log_evidence = 0;  ///< of the mean weight, and half of its variance, which the logarithm takes off
  double variance = 0;      ///< of that logarithm
  int samples = 0;
  double effective_samples = 0;  ///< (Σw)²/Σw²
  int lost = 0;                  ///< draws without a path, of weight 0
  Eigen::VectorXd log_sets;      ///< log of the mean weight of each set of draws that differ in signs alone
};

/// Draws of a set: as many samples are asked for, and half of that are drawn without noise.
inline constexpr Eigen::Index kMostOfOneSet = 4;

/// What the iterations of a shape's draws ended at, with which they begin for other numbers: v, a column each, NaN
/// where none is known.
using DrawStarts = Eigen::MatrixXd;

/// The evidence of one shape at x, by draws that fit their perturbed data about its match elsewhere (see
/// posterior::fitted_draws()): each is weighed with its density, so that the mean weight is the evidence for whatever
/// numbers and match the draws are made with. They are functions of the same normal numbers for all x, so that the
/// estimate is smooth in x, up to what the iterations leave. Draws come in sets that differ in signs alone: ±(ζ, ε),
/// which takes the odd terms out of the sum, and the same with the other sign of the noise. The latter makes the sum
/// even in the amplitudes, as the evidence is: otherwise it has a slope at β = 0 that is an error of the draws, and a
/// maximum beside it.
/// @param samples at most, rounded up to whole sets, and half of that without noise @param enough the variance of the
/// logarithm at which fewer will do @param refinements how often the steps of the draws were halved since these were
/// drawn with other steps: the same Brownian paths
ImportanceEstimate sample_shape(const CohortModel& cohort, int shape, const posterior::Specimen::Model& model,
                                const posterior::LinearModel& chord, int samples, double enough, DrawStarts& starts,
                                int refinements = 0);

/// The evidence of all shapes with the same random numbers at any x.
struct SampledCohort {
  double log_evidence = 0;
  double variance = 0;
  std::vector<Eigen::VectorXd> log_sets;  ///< of each shape
  bool enough = true;  ///< whether the draws of a shape vary so little that numbers can be found by them
};

/// @param chords whose linear models the draws are made with @param samples of each shape
/// @param starts of each shape
SampledCohort sample_cohort(const CohortModel& cohort, const Eigen::VectorXd& x, const Matches& chords, int samples,
                            std::vector<DrawStarts>& starts);

/// Shapes that are drawn before the rest is, which is not where none of these has enough samples.
inline constexpr int kShapesAtOnce = 8;

inline constexpr int kDrawGroups = 8;  ///< of draws, of which one may be left out

/// Σ_s log of the mean over sets of draws of e^log, and half of the variance that the logarithm takes off.
/// @param left_out the sets of that group are left out; −1: none. Set i of shape s with n sets is in group
/// (i + ns) mod kDrawGroups, so that each group has as many where shapes have few sets.
double sum_of_log_means(const std::vector<Eigen::VectorXd>& log_sets, int left_out = -1);

/// The part of the evidence where no draw of sample_shape() comes, as its iteration ends elsewhere, in units of the
/// linear model's evidence, and the variance of that: from draws of which half are from the prior and half from that
/// Gaussian, twice as wide, each weighed by the mean of both densities.
struct DistantEvidence {
  double part = 0, variance = 0;
};
DistantEvidence sample_distant(const CohortModel& cohort, int shape, const Matches& matches, int samples);

}  // namespace pulson::compare
