#pragma once

#include <memory>

#include "linear_model.hpp"

namespace pulson::posterior {

/// The models of a specimen linear about rest. Where the noise gives landmarks at rest no momentum only the velocities
/// K(q0)p0 depend on θ, but for amplitudes of the noise, in which a LinearModel is exact, and its lengths: what noise
/// does to the ends is then found once. Thread-safe.
class RestModel {
 public:
  /// @param model some θ, of which no amplitude of the noise is 0
  RestModel(Specimen specimen, const Specimen::Model& model);

  const Specimen& specimen() const { return *specimen_; }

  /// Whether what noise does is found once.
  bool is_of_any_kernel() const { return of_any_kernel_ != nullptr; }

  /// @throws NumericalError where the noise leaves rest no path
  std::shared_ptr<const LinearModel> at(const Specimen::Model& model) const;

 private:
  std::shared_ptr<const Specimen> specimen_;
  std::shared_ptr<const LinearModel> of_any_kernel_;  ///< null where there is none
  Eigen::VectorXd lengths_;                           ///< numbers of its noise, amplitudes being 0
};

}  // namespace pulson::posterior
