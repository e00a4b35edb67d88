#pragma once

#include <vector>

#include <Eigen/Core>

namespace pulson::compare {

/// The data of one shape on the variances of a linear model: t − Σ_g (e^{u_g} − 1) d_g ~ N(0, I + F + Σ_g e^{u_g} M_g).
struct VarianceData {
  Eigen::VectorXd innovation;           ///< t
  Eigen::MatrixXd fixed;                ///< I + F
  std::vector<Eigen::MatrixXd> groups;  ///< M_g
  std::vector<Eigen::VectorXd> drifts;  ///< d_g: noise whose strength depends on position also shifts the mean
};

/// Variance, of σ² in the mean over coordinates, that no data would show.
inline constexpr double kNegligible = 1e-6;

/// The logarithms u_g of greatest likelihood.
struct VarianceFit {
  Eigen::VectorXd u;
  Eigen::MatrixXd information;        ///< Fisher's, of u, and last of log σ², of which everything here is in units
  Eigen::MatrixXd first_information;  ///< the same at u = 0
  double log_likelihood = 0;          ///< but for the constant
  Eigen::VectorXd least;              ///< of u: e^{u_g} M_g is then negligible
};

/// By Fisher scoring from u = 0, steps halved until the likelihood rises.
VarianceFit fit_variances(const std::vector<VarianceData>& shapes, Eigen::Index groups);

}  // namespace pulson::compare
