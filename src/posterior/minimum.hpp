#pragma once

#include <memory>
#include <vector>

#include "shot_batch.hpp"

namespace pulson::posterior {

/// A minimum of one specimen's −log p(y, z | θ), and the model linear about it.
struct Minimum {
  Eigen::VectorXd z;
  Eigen::VectorXd end;  ///< q(T), of each branch
  double cost = 0;      ///< ½|z|² + ½|r|²
  double gain = 0;      ///< what the cost would still fall by, were q(T) linear
  bool converged = false;
  std::shared_ptr<const LinearModel> linear;
};

/// How closely minima are sought.
struct MinimumOptions {
  /// Of the cost, nats: what a further step would still gain. An error of z by its root, 3e-3, changes the evidence by
  /// some 1e-4 nats.
  double tolerance = 1e-5;
  int most_steps = 60;       ///< linear convergence takes less than ten, of paths that are strongly bent some tens
  int most_corrections = 3;  ///< of a step
};

/// Minima of several specimens of one source at one θ, each from the start of least cost, or from rest where none has a
/// path: Levenberg and Marquardt's steps in the space of the data, continued by secants where the cost falls so. All
/// advance together, in vector lanes where there are some.
/// @param starts of each specimen
/// @throws NumericalError where even landmarks at rest have no path
std::vector<Minimum> find_minima(const std::vector<const Specimen*>& specimens, const Specimen::Model& model,
                                 const std::vector<std::vector<Eigen::VectorXd>>& starts,
                                 const MinimumOptions& options = {});

}  // namespace pulson::posterior
