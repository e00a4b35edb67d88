#pragma once

#include <memory>
#include <vector>

#include "posterior/rest_model.hpp"

namespace pulson::compare {

/// What the likelihood of shapes about their own mean lacks where the mean is taken for given. Integrated over the mean
/// μ with a flat prior, to first order about rest, it is that at the estimate times
///
///     (2π)^{m/2} det(Bᵀ Σ_s P_sᵀC_s⁻¹P_s B)^{-1/2},   C_s = P_s V P_sᵀ + σ²I,
///
/// the restricted likelihood (REML; H. Patterson and R. Thompson 1971): V is the covariance of q(T) at rest, dN×dN, P_s
/// what is observed of shape s but for the directions of its alignment, and B an orthonormal basis, dN×m, of all that
/// the shapes determine of μ. Of S complete shapes it is ½ log det C, so that S − 1 shapes are counted. Thread-safe.
class OwnMean {
 public:
  /// @param whole a specimen at the source with all coordinates observed, of the σ of the specimens' data, without a
  /// pose
  OwnMean(const std::vector<posterior::Specimen>& specimens, posterior::RestModel whole);

  /// The model linear at rest. @throws NumericalError where the noise leaves rest no path
  std::shared_ptr<const posterior::LinearModel> at_rest(const posterior::Specimen::Model& model) const {
    return whole_.at(model);
  }

  /// The logarithm of that factor at other numbers.
  double log_factor(const posterior::LinearModel& at_rest, const posterior::Specimen::Model& model) const;

 private:
  struct Alike {
    Eigen::MatrixXd observed;  ///< σ P, n×dN, σ that of the data
    int shapes = 0;
  };

  posterior::RestModel whole_;
  std::vector<Alike> groups_;  ///< of shapes that lack the same
  Eigen::MatrixXd basis_;      ///< B
};

}  // namespace pulson::compare
