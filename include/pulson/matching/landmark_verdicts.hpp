#pragma once

#include <optional>
#include <vector>

#include "pulson/matching/landmark_predictions.hpp"

namespace pulson::matching {

/// What can be said of the prediction of a match.
enum class PredictionWord {
  kUndetermined,  ///< fewer than 8 landmarks, curves, or no model can be fitted
  kNoCommonPart,  ///< the others predict landmarks, those doubted apart, no better than the alignment, which leaves >
                  ///< 3σ
  kDoubted,       ///< some landmarks are beyond what the largest of so many may be
  kPredicted      ///< all landmarks are where the others predict them; their order may still be wrong
};

/// A match judged landmark by landmark.
struct LandmarkVerdicts {
  Eigen::VectorXd residual;      ///< N, Registration::residuals_over_sigma()
  Eigen::VectorXd predicted;     ///< N, LandmarkPredictions::over_sigma(); empty where it is undetermined
  Eigen::VectorXd action_share;  ///< N, fraction of the action; empty where LandmarkShares::action is, or is zero
  Eigen::VectorXd weight;        ///< N, that of the loss, else that which was given; empty where there is neither
  std::optional<PredictionOfMatch> prediction{};
  PredictionWord word = PredictionWord::kUndetermined;
  /// Whether displacements without a common part are as large as the spacing of the landmarks, as those of landmarks in
  /// a wrong order are: each is then at the place of another one.
  bool may_be_unordered = false;
  /// The fewest landmarks that have 90 % of the action between them, where that is at most a third of all and the noise
  /// moves landmarks by more than σ, root mean square. Were all increments alike, it would take 43 % of the landmarks
  /// in 1D, 57 % in 2D and 65 % in 3D (squares of χ_1, χ_2, χ_3).
  std::vector<int> concentrated{};

  const std::vector<int>& doubted() const;  ///< landmarks that prediction doubts
  double concentrated_share() const;        ///< of the action, of the landmarks that are `concentrated`
};

/// O(n²N), n ≤ 512 of the landmarks.
LandmarkVerdicts judge_landmarks(const Registration& registration, const LandmarkShares& shares);

}  // namespace pulson::matching
