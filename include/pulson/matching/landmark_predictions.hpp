#pragma once

#include <optional>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// Fewer landmarks are not judged by prediction: of N − 1 others too few say anything.
inline constexpr int kFewestPredicted = 8;

/// x with P(max of `count` independent χ_d ≤ x) = 0.999: P(χ_d ≤ x) = 0.999^{1/count}. A landmark beyond it stands out
/// among so many.
/// @throws InputError unless d is 1, 2 or 3 and count is positive
double largest_of_chi(int d, Eigen::Index count);

/// The same of √(d F) with F of Fisher's distribution for d and `degrees`, which is χ_d over a deviation that was
/// estimated from so many numbers.
double largest_of_student(int d, Eigen::Index count, double degrees);

/// How far landmarks are from where others predict them, in the model of fit_displacements().
struct LandmarkPredictions {
  Points residuals;                          ///< d×N, observed less predicted, length units; NaN where not observed
  std::vector<Eigen::MatrixXd> covariances;  ///< of each residual, d×d
  double square = 0;  ///< rᵀPr of the known landmarks: of χ² for dn − rank Z if the model holds

  /// Root mean square of |r_a| over the landmarks that are observed, but for these.
  double error(const std::vector<int>& without = {}) const;
  /// The same with weights, N; of landmarks of weight 0 nothing is needed.
  double weighted_error(const Eigen::VectorXd& weights) const;
  /// N, √(r_aᵀC_a⁻¹r_a): of χ_d if the model holds; NaN where not observed.
  Eigen::VectorXd over_sigma() const;
};

/// How well landmarks were observed.
struct DisplacementNoise {
  Eigen::VectorXd variances;                 ///< N, of each coordinate
  std::vector<Eigen::MatrixXd> covariances;  ///< N of d×d, in place of them; may be empty

  /// σ²/w_a, or R_a/w_a; of weight 0 those of weight 1, as of a landmark that takes no part.
  DisplacementNoise(double variance, const std::vector<Eigen::MatrixXd>& each, const Eigen::VectorXd& weights);

  Eigen::MatrixXd of(Eigen::Index landmark, Eigen::Index d) const;  ///< d×d
};

/// Displacements of some landmarks, from which all are predicted.
struct KnownDisplacements {
  const Points& shape;                ///< q0, d×N
  const Points& displacements;        ///< y − q0, d×N; NaN where not observed
  const Eigen::MatrixXd& directions;  ///< Z of the alignment, dN×r
  const std::vector<Eigen::Index>& known;
  const DisplacementNoise& noise;
};

/// Universal kriging: each of the known landmarks is predicted from the other known ones, exactly without refitting,
///
///     r_a = (P_aa)⁻¹(Pr)_a,   C_a = (P_aa)⁻¹,   P = V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹,   V = K + R,
///
/// with R of the noise, and every other landmark from all of the known ones. O(n²N) for n known ones; with covariances
/// d² times as much or more.
/// @param kernel none: K = 0, and the alignment alone predicts
LandmarkPredictions predict_displacements(const KnownDisplacements& from, const std::optional<KernelOperator>& kernel);

/// A landmark match as prediction sees it.
struct PredictionOfMatch {
  DisplacementModel model;  ///< fitted to the landmarks that are not doubted
  LandmarkPredictions predictions;
  LandmarkPredictions aligned;  ///< the same by the alignment alone
  double degrees = 0;           ///< of freedom that the model was fitted to: coordinates less directions
  double limit = 0;             ///< largest_of_student() of as many landmarks
  std::vector<int> doubted{};   ///< landmarks beyond it
};

/// Predicts each landmark of a match from the others, whatever kernel it was made with: the model is fitted for this
/// alone, and again without the landmarks that a variance fitted to the others would doubt, as these hide themselves by
/// widening it. Landmarks predict others by their weights; those of a loss do not excuse a landmark that is judged
/// itself. Of more than 512 landmarks every few predict all others.
/// @return none for curves, for fewer than 8 landmarks observed, and where the model cannot be fitted
std::optional<PredictionOfMatch> predict_match(const Registration& registration);

}  // namespace pulson::matching
