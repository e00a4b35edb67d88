#pragma once

#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// Whether all terms of a kernel are K(r) = P(t) exp(−t), t = cr/α, with a polynomial P: peakon and Matérn.
bool has_line_sums(const std::vector<KernelTerm>& terms);

/// From so many landmarks on, sweeps along a line cost less than a matrix: see docs/benchmarks.md.
inline constexpr Eigen::Index kFewestOnLine = 64;

/// deg P + 1 of such a profile, and c/α of a term: the Matérn kernel of order m − 1/2 has m and √(2m − 1)/α.
int line_moments(KernelProfile profile);
double line_scale(const KernelTerm& term);

/// exp(−h), and 0 from kFurthestOnLine on, where it is next to the smallest number.
inline constexpr double kFurthestOnLine = 700;
Eigen::MatrixXd line_decays(const Eigen::MatrixXd& gaps);

/// Indices of x from left to right.
std::vector<Eigen::Index> sorted_order(const Eigen::VectorXd& x);

/// Sums over sources y_j on a line with weights w_jr, at targets x_i: M×R each.
struct LineSums {
  Eigen::MatrixXd value;   ///< Σ_j K(x_i − y_j) w_jr
  Eigen::MatrixXd slope;   ///< Σ_j K'(x_i − y_j) w_jr, with K'(0) := 0
  Eigen::MatrixXd second;  ///< Σ_j K''(x_i − y_j) w_jr; of the peakon without what is at r = 0
};

/// In O(M + N) beyond sorting: a kernel P(t)e^{−t} leads from one place to the next, at a distance h (in α/c), by
///
///     s_k ← e^{−h} Σ_{l≤k} binom(k, l) h^{k−l} s_l,      s_k = Σ_{y_j < x} w_j t_j^k e^{−t_j},   k = 0 … deg P
///
/// and likewise from the right. All factors are positive and at most 1, so that nothing cancels. Sources at one place
/// are added up first.
/// @param terms of has_line_sums() @param x, y finite @param weights N×R, R = 1, 2 or 3
LineSums line_sums(const std::vector<KernelTerm>& terms, const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                   const Eigen::MatrixXd& weights);

}  // namespace pulson
