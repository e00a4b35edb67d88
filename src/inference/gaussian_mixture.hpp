#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace pulson::inference {

/// Gaussian laws about clusters of weighted points of the unknowns, a wide one of all of them as a tenth, and their
/// prior N(0, I) as another: proposals for a posterior of several minima and of bent tails.
class GaussianMixture {
 public:
  /// @param points a column each @param weights of them, not all 0; their sum is 1
  GaussianMixture(const Eigen::MatrixXd& points, const Eigen::ArrayXd& weights);

  /// @param uniforms in (0, 1), by which laws are chosen @param normals standard normal numbers, a column each
  Eigen::MatrixXd draw(const Eigen::VectorXd& uniforms, const Eigen::MatrixXd& normals) const;

  /// Of columns, relative to N(z; 0, I).
  Eigen::VectorXd log_densities(const Eigen::MatrixXd& z) const;

 private:
  struct Law {
    double log_weight;
    Eigen::VectorXd centre;
    Eigen::MatrixXd root;  ///< lower triangular L, of the covariance LLᵀ
    double log_determinant;
  };
  std::vector<Law> laws_;
};

}  // namespace pulson::inference
