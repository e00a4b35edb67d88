#pragma once

#include <cstdint>
#include <vector>

#include "reference_weight.hpp"

namespace pulson::inference {

/// A posterior by weighted independent draws of the reference with no chain between them.
struct ImportanceEstimate {
  Estimate log_evidence{};
  double pareto_k = 0;            ///< of the weights, the greatest of the specimens where θ is held
  double effective = 0;           ///< (Σw)²/Σw², the least of the specimens
  std::vector<Estimate> numbers;  ///< means of θ (as φ), then of p0, q(T) and q(T/2) of each specimen
};

/// Importance sampling from the linear components of the reference, with which even a law that is far from all minima
/// is found where the prior comes to it: brute force, but for the part of the draws that are nearer.
///
/// With θ held each specimen has its own weights w; else w(θ) Π_s w̄_s, w̄_s the mean over the draws of the specimen at
/// one θ. Draws are shot in vector lanes where there are any.
/// @param most draws of each specimen @param accuracy of the log evidence, at which it ends
ImportanceEstimate importance_estimate(const ChainSetting& setting, std::int64_t most, double accuracy);

}  // namespace pulson::inference
