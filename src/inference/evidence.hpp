#pragma once

#include "chain.hpp"

namespace pulson::inference {

/// log E[w] over the reference by bridge sampling (Meng and Wong 1996) with the optimal bridge, iterated to
/// convergence, from log w of the posterior's draws and of as many independent draws of the reference; standard error
/// as S. Frühwirth-Schnatter (2004), with the effective sample size of the posterior's draws.
Estimate bridge_log_evidence(const ChainSetting& setting, const PosteriorDraws& draws);

/// The same of given numbers. @param effective sample size of the posterior's draws; NaN: as many as there are
Estimate bridge(const Eigen::VectorXd& posterior, const Eigen::VectorXd& reference,
                const std::function<double(const Eigen::VectorXd&)>& effective);

}  // namespace pulson::inference
