#pragma once

#include <optional>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::cohort {

/// What is given of the model of a cohort's displacements; what is not is fitted.
struct CohortFitOptions {
  std::optional<KernelOperator> kernel{};  ///< none: matern32 of a fitted width
  std::optional<double> lambda{};
  std::optional<double> sigma{};  ///< length units, 0 or greater
  AlignmentKind alignment = AlignmentKind::kNone;
};

/// To first order in the momenta, the displacements of all specimens from their mean are independent draws of
/// N(0, K/λ + σ²) on each axis, but for the directions of the alignment.
struct CohortDisplacements {
  KernelOperator kernel;
  double lambda = 1;
  double sigma = 0;
  double log_likelihood = 0;  ///< restricted, up to a constant
};

/// The greatest restricted likelihood (REML; H. Patterson and R. Thompson 1971) of a cohort, mean and alignment being
/// integrated out: with n specimens, V = K/λ + σ² and r_i their distances from the mean,
///
///     −½ [(n − 1)(log det V + log det ZᵀV⁻¹Z) + Σ_i r_iᵀPr_i],   P = V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹.
///
/// Widths are 0.1 to 0.4 diameters, as in fit_displacements(), and λσ² at least 1e-6: less is no noise. Of more than
/// 128 landmarks every few are taken.
/// @param shapes n ≥ 2 of them, d×N, complete or with expected positions, aligned with one another
/// @param uncertain dN×dN, added to Σ_i r_ir_iᵀ: the sum of the covariances of expected positions (EM); empty: none
/// Cost O(n·min(N, 128)) and O(min(N, 128)³) for each of some 60 places.
CohortDisplacements fit_cohort_displacements(const std::vector<Points>& shapes, const Eigen::MatrixXd& uncertain,
                                             const CohortFitOptions& options);

/// How far two fits of a cohort with this mean differ: the largest of |log λ'/λ|, |log σ'/σ| and the change of K, of
/// its size. That of K/λ + σ² would not show a σ that is small.
double difference(const CohortDisplacements& first, const CohortDisplacements& second, const Points& mean);

/// K/λ + σ² on each axis, dN×dN, regular.
Eigen::MatrixXd displacement_covariance(const KernelOperator& kernel, double lambda, double sigma, const Points& mean);

}  // namespace pulson::cohort
