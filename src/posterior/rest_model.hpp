#pragma once

#include <memory>

#include "linear_model.hpp"

namespace pulson::posterior {

/// The models of a specimen linear about rest, at any θ. Where the noise gives landmarks at rest no momentum, what it
/// does to their ends does not depend on the kernel: it is found once, as a LinearModel is exact in amplitudes, and
/// anew only where other numbers of the noise differ. Thread-safe.
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
  Eigen::VectorXd lengths_;                           ///< the numbers of its noise, amplitudes as 0
};

}  // namespace pulson::posterior
