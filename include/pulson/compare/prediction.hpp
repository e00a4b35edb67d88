#pragma once

#include <cstdint>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"

namespace pulson {

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
Eigen::MatrixXd aligned_samples(const Cohort& cohort, const MatchingProblem& model, int count, std::uint64_t seed);

/// Of the targets of `held`, by a model that was fitted to others.
/// @param samples of that model, aligned onto the source of `held`
std::vector<ShapePrediction> predict(const Cohort& held, const Eigen::MatrixXd& samples);

Prediction summary(std::vector<ShapePrediction> shapes);

}  // namespace pulson
