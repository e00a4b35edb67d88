#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// Whether sessions (or observers) place landmarks elsewhere on the same specimens.
struct SessionBias {
  int sessions = 0, specimens = 0;  ///< specimens that have all sessions
  Eigen::VectorXd
      distances;        ///< of each landmark: root mean square of its sessions' means from their mean, length units
  double distance = 0;  ///< the same over all landmarks
  double p = 1;         ///< how often sessions shuffled within specimens differ as much
  int permutations = 0;
};

/// The error of digitising, from specimens digitised more than once.
struct Repeatability {
  int specimens = 0, shapes = 0;  ///< that were digitised more than once, and how many shapes those are
  double sigma = 0;               ///< standard deviation of a coordinate, length units
  Eigen::VectorXd sigmas;         ///< the same of each landmark's coordinates
  std::vector<Eigen::MatrixXd>
      covariances;                  ///< of each landmark, d×d, length units squared, axes of the first specimen
  std::optional<SessionBias> bias;  ///< where some specimens have the same number of sessions
};

/// Repeats of a specimen are aligned with their mean by a rigid motion, so that each may have its own pose, and their
/// scatter S_a about it is summed over the specimens in the pose of the cohort's mean: the covariance of landmark a is
///
///     Σ_a = c Σ_i Σ_k r_aik r_aikᵀ / Σ_i (k_i − 1),   c = dN/(dN − r),
///
/// c for the r coordinates that each alignment takes out of the errors, as if equally out of all. The bias of sessions,
/// the k-th shape of each specimen being of session k, is Σ_k |m_k − m|² of the sessions' means; its null distribution
/// comes from the sessions' order shuffled within specimens.
/// @param specimens the specimen that each shape is of, as many as shapes @throws InputError where none repeats
Repeatability repeatability(const std::vector<Landmarks>& shapes, const std::vector<std::string>& specimens,
                            int permutations = 999, std::uint64_t seed = 1);

}  // namespace pulson::audit
