#pragma once

#include <optional>

#include "linear_model.hpp"

namespace pulson::inference {

/// Randomise then optimise (J. Bardsley, A. Solonen, H. Haario and M. Laine 2014). With r(z) the residual, J its
/// derivative in the linear model and S = I + JJᵀ, a draw of standard normal numbers (ζ, ε) is the z of
///
///     z = ζ − Jᵀv,   v = ε + r(z),
///
/// which fits its perturbed data however much the path bends; where r is linear it is LinearAt::draw(). Found by chord
/// iterations with S, and else by Newton's method; none where neither leads to a root.
/// @param accuracy of the norm of ε + r(z) − v, in standard deviations of the data
std::optional<Eigen::VectorXd> fitted_draw(const Specimen& specimen, const Specimen::Model& model,
                                           const LinearAt& linear, const Eigen::VectorXd& normals, double accuracy);

/// The logarithm of the density of these draws relative to N(0, I),
///
///     N(η; 0, I + JᵀJ) |det(I + J(z)Jᵀ)| / N(z; 0, I),   η = z + Jᵀr(z).
double fitted_log_density(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                          const Eigen::VectorXd& z, const Specimen::Shot& shot);

/// About the derivative by (ζ, ε) of the logarithm of N(z; 0, I) p(y | z) over this density: of −½ bᵀS⁻¹b, b = r(z) −
/// Jz, which is that but for the determinant, with dz as the linear model has it. It takes one adjoint.
Eigen::VectorXd fitted_kick(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                            const Eigen::VectorXd& z, const Specimen::Shot& shot);

}  // namespace pulson::inference
