#pragma once

#include <memory>

#include "pulson/dynamics/hamiltonian.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// The stochastic Hamiltonian system (11): H of a kernel, and the potentials of a noise model.
struct StochasticSystem {
  KernelOperator kernel;
  std::shared_ptr<const NoiseModel> noise;
};

}  // namespace pulson
