#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace pulson::compare {

struct Cohort;
struct CohortFit;
struct CohortSettings;
struct CohortShapes;

/// A statistic of a cohort beside its distribution in cohorts drawn from a model.
struct PredictiveCheck {
  double observed = 0;
  double low = 0, high = 0;  ///< the central 90 % of the cohorts drawn
  double p_value = 1;        ///< of two sides: twice the smaller part of the cohorts beyond; NaN where undefined

  bool is_outside() const { return observed < low || observed > high; }
};

/// Whether a fitted model could have drawn these shapes. Cohorts of as many shapes are drawn from it at its fitted
/// numbers, miss the same landmarks, and are aligned as the data were, about their own mean where the data are. The
/// numbers are fitted to the data themselves, so that p is conservative: of a true model larger than uniform (A.
/// Gelman, X.-L. Meng and H. Stern 1996).
struct PredictiveChecks {
  int cohorts = 0;
  std::vector<PredictiveCheck> variances;  ///< N: of a coordinate of each landmark about the source
  int outside = 0;                         ///< landmarks whose variance is outside the central 90 %
  /// Of all variances together: part of the cohorts, this one included, with as large a sum over landmarks of squared
  /// deviations of log variance from its mean over the cohorts drawn, in standard deviations.
  double variances_p = 1;
  PredictiveCheck share;     ///< of the first eigenvalue in the variance
  PredictiveCheck energy;    ///< mean energy score of the shapes by the model, see energy_score()
  PredictiveCheck distance;  ///< largest between two shapes, root mean square of a landmark

  /// The statistics that the model does not explain, at 5 % over the four together (Bonferroni), in words: "the
  /// variances of 12 of 19 landmarks".
  std::vector<std::string> unexplained() const;
};

/// @param shapes of which `cohort` was made @param cohorts 199: p in steps of 1/100 @throws NumericalError where the
/// model draws too few shapes
PredictiveChecks check_predictions(const CohortShapes& shapes, const Cohort& cohort, const CohortFit& fit,
                                   const CohortSettings& settings, int cohorts = 199);

}  // namespace pulson::compare
