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

/// Importance sampling. Where θ is held and a specimen has few data its proposals are mixtures that are fitted to the
/// posteriors of one power of the likelihood after the other, from draws of the prior on (O. Cappé, R. Douc, A.
/// Guillin, J.-M. Marin and C. Robert 2008), for as many paths as are given or some seconds: they find minima and tails
/// that no search has found. Others are the linear components of the reference, half of them wide.
///
/// With θ held each specimen has its own weights w; else w(θ) Π_s w̄_s, w̄_s the mean over the draws of the specimen at
/// one θ. Draws are shot in vector lanes where there are any.
/// @param most draws of each specimen @param accuracy of the log evidence, at which it ends
ImportanceEstimate importance_estimate(const ChainSetting& setting, std::int64_t most, double accuracy);

}  // namespace pulson::inference
