#pragma once

#include <vector>

#include "shot_batch.hpp"

namespace pulson::posterior {

/// Draws of z, a column each, and the residuals r(z) there.
struct FittedDraws {
  Eigen::MatrixXd z;
  Eigen::MatrixXd residuals;
  Eigen::MatrixXd v;        ///< ε + r(z): where the iteration ended
  std::vector<char> found;  ///< without which a column says nothing
};

/// Randomise then optimise (J. Bardsley, A. Solonen, H. Haario and M. Laine 2014). With r(z) the residual, J its
/// derivative in the linear model and S = I + JJᵀ, a draw of standard normal numbers (ζ, ε) is the z of
///
///     z = ζ − Jᵀv,   v = ε + r(z),
///
/// which fits its perturbed data however much the path bends; where r is linear it is LinearAt::draw(). All draws are
/// found at once, by chord iterations with S and secants, and those that these do not lead to by Newton's method.
/// @param shots with `linear` as their chord @param normals (ζ, ε), a column each
/// @param accuracy of the norm of ε + r(z) − v, in standard deviations of the data
/// @param begin v where each begins, a column each, NaN for where the linear model has it; empty: all there
FittedDraws fitted_draws(const ShotBatch& shots, const LinearAt& linear, const Eigen::MatrixXd& normals,
                         double accuracy, const Eigen::MatrixXd& begin = {});

/// The logarithm of the density of these draws relative to N(0, I), of each,
///
///     N(η; 0, I + JᵀJ) |det(I + J(z)Jᵀ)| / N(z; 0, I),   η = z + Jᵀr(z);
///
/// where are_fitted_draws(); NaN where there is no path.
Eigen::VectorXd fitted_log_densities(const ShotBatch& shots, const LinearAt& linear, const Eigen::MatrixXd& z,
                                     const Eigen::MatrixXd& residuals);

/// Whether z, a column each, are draws: whether the search for the draw of η = z + Jᵀr(z), on which alone it depends,
/// ends there. Where the path bends strongly several z have the same η; the search finds one of them, and the density
/// of draws is 0 at the others.
/// @param residuals r(z) @param accuracy of the search, as of fitted_draws()
std::vector<char> are_fitted_draws(const ShotBatch& shots, const LinearAt& linear, const Eigen::MatrixXd& z,
                                   const Eigen::MatrixXd& residuals, double accuracy);

/// About the derivative by (ζ, ε) of the logarithm of N(z; 0, I) p(y | z) over this density: of −½ bᵀS⁻¹b, b = r(z) −
/// Jz, which is that but for the determinant, with dz as the linear model has it. It takes one adjoint.
Eigen::VectorXd fitted_kick(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                            const Eigen::VectorXd& z, const Specimen::Shot& shot);

}  // namespace pulson::posterior
