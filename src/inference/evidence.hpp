#pragma once

#include "chain.hpp"

namespace pulson::inference {

/// log E[w] over the reference by bridge sampling (Meng and Wong 1996) with the optimal bridge, iterated to
/// convergence, from log w of the posterior's draws and of independent draws of the reference; standard error
/// as S. Frühwirth-Schnatter (2004), with the effective sample size of the posterior's draws.
struct BridgedEvidence {
  Estimate log_evidence;
  double pareto_k = 0;        ///< of the reference's draws
  double chain_pareto_k = 0;  ///< of the posterior's: k/(1 − k) is the shape of their weights' tail
};
BridgedEvidence bridge_log_evidence(const ChainSetting& setting, const PosteriorDraws& draws);

/// Effective sample size of numbers along the chains; NaN: as many as there are.
using Effective = std::function<double(const Eigen::VectorXd&)>;

/// The same of given numbers; NaN where fewer than 4 draws of the one law come to where those of the other are: nothing
/// is known then of the ratio, nor of its error. @param parts of the draws of the reference, of mean 1: those that are
/// drawn more often than they weigh @param size of functions of the posterior's draws
Estimate bridge(const Eigen::VectorXd& posterior, const Eigen::VectorXd& reference, const Eigen::VectorXd& parts,
                const Effective& size);

/// The same from the draws of all powers: the sum over neighbouring powers of the logarithms of the ratios of their
/// normalising constants, each by bridge sampling.
Estimate tempered_log_evidence(const PosteriorDraws& draws);

}  // namespace pulson::inference
