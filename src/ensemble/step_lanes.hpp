#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "landmark_lanes.hpp"
#include "noise/bump_fields.hpp"
#include "noise/pair_noises.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::ensemble {

/// Constant h_i,p and h_i,q, without their zeros.
struct NoiseLoads {
  std::vector<NoiseLoad> position;
  std::vector<NoiseLoad> momentum;
};

struct LaneBumps {
  double beta;
  double width;
  BumpTicks ticks;
};

/// A noise that lanes know, from one of its channels on.
struct LaneNoise {
  std::size_t first_channel = 0;
  std::variant<NoiseLoads, ScreenedPairs, KunitaPairs, LaneBumps> formula;
};

/// The equations of a step that lanes know.
enum class LaneScheme { kHeun, kMidpoint, kVariational, kVariational2 };

/// N landmarks in R^d, d = 1, 2, 3, with any kernel and a sum of noises whose formulas are known, by any integrator.
struct StepModel {
  /// @throws InputError where the noise refuses the shape or knows() is false
  StepModel(StochasticSystem system, const std::string& integrator, int dimension, int count, double dt,
            std::uint64_t seed);

  static bool knows(const StochasticSystem& system, const std::string& integrator, int dimension);

  StochasticSystem system;
  std::shared_ptr<const Integrator> integrator;
  LaneScheme scheme;
  NoiseTraits traits;
  bool compensates;  ///< G is part of the flow
  std::size_t dimension;
  std::size_t count;
  double dt;
  std::uint64_t seed;
  bool antithetic = false;
  std::size_t channels;
  std::vector<LaneNoise> noises;
  double flow_time;               ///< of a part of the step: Δt, or half of it
  std::vector<KernelTerm> terms;  ///< flow_time·K
  double at_zero;                 ///< flow_time·K(0)
  double lipschitz;               ///< of flow_time·K
};

/// Takes steps first … last − 1 for all running lanes, with the same steps as Integrator::integrate() to round-off: a
/// lane whose iteration does not contract as the integrator's must is left to the integrator in that step. A lane is a
/// function of its path number alone, and the same for any split of the steps into calls. Not thread-safe in `batch`.
void advance_steps(const StepModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last);

/// One step by the integrator from (q, p) under the increments of one lane, each array dN or C numbers at this stride.
/// @return false where it finds no root
bool take_hard_step(const StepModel& model, double* q, double* p, const double* w, std::size_t stride);

}  // namespace pulson::ensemble
