#pragma once

#include <Eigen/Core>

namespace pulson::inference {

/// Convergence diagnostics of Markov chains, after A. Vehtari, A. Gelman, D. Simpson, B. Carpenter and P.-C. Bürkner,
/// "Rank-normalization, folding, and localization: an improved R-hat for assessing convergence of MCMC", Bayesian
/// Analysis 16(2), 2021. Draws of one quantity are a matrix draws×chains. Values are NaN, undefined, where there are
/// fewer than 4 draws each (of ESS 12), one is not finite, or all are equal: such chains have not converged.

/// The larger of the rank-normalised split R-hat of the draws and that of their distances to the median (§4).
double rank_rhat(const Eigen::MatrixXd& draws);

/// Split-chain effective sample size of the mean of the draws as they are, by Geyer's initial monotone sequence (§3.2).
double effective_sample_size(const Eigen::MatrixXd& draws);

/// The same of the rank-normalised draws.
double bulk_ess(const Eigen::MatrixXd& draws);

/// The smaller of those of the indicators of the 5 % and the 95 % quantile.
double tail_ess(const Eigen::MatrixXd& draws);

/// The quantile of all draws, by linear interpolation between order statistics.
double quantile(const Eigen::MatrixXd& draws, double probability);

/// Summary of the draws of one quantity.
struct DrawSummary {
  double mean = 0;
  double sd = 0;
  double mcse = 0;  ///< Monte Carlo standard error of the mean, sd/√effective_sample_size
  double rhat = 0;
  double ess_bulk = 0;
  double ess_tail = 0;
  double q05 = 0, q50 = 0, q95 = 0;
};

DrawSummary summarise(const Eigen::MatrixXd& draws);

/// The shape k of the generalised Pareto law of the largest 20 %, at most 3√n, of n importance weights (A. Vehtari, D.
/// Simpson, A. Gelman, Y. Yao and J. Gabry, "Pareto smoothed importance sampling", JMLR 25(72), 2024, after J. Zhang
/// and M. Stephens 2009): weights have 1/k finite moments. 0 where all are alike; NaN where fewer than
/// 5 different ones are in the tail, or the largest is not finite. @param log_weights −∞ for a weight of 0
double pareto_k(const Eigen::VectorXd& log_weights);

/// k above which a mean of such weights, and its standard error, are not reliable (ibid.).
inline constexpr double kHighParetoK = 0.7;

/// R-hat above which chains have not converged (§1).
inline constexpr double kHighRhat = 1.01;

/// The same of one number of short chains that confirm others: the variance between them is a tenth of that within.
inline constexpr double kHighRhatOfShort = 1.05;

}  // namespace pulson::inference
