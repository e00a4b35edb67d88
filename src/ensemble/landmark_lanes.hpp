#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pair_lanes.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson::ensemble {

/// One entry of h_i,p or h_i,q of a noise that is constant.
struct NoiseLoad {
  std::size_t channel;
  std::size_t coordinate;  ///< landmark·d + axis
  double value;
};

/// N landmarks in R^d, d = 1, 2, 3, with any kernel and additive noise h_i = position_i·p + momentum_i·q.
///
/// Lanes compute in units of which both are powers of two, so that changing them is exact: positions in `length`, about
/// the smallest width of the kernel, and momenta in `momentum`, such that Δt K(0)·momentum is about a length. Then Δt
/// is part of the kernel, and single precision has the range for all that it is used for.
struct LandmarkModel {
  /// @throws InputError if the noise is not additive, has friction or cannot act on such shapes
  LandmarkModel(StochasticSystem system, int dimension, int count, double dt, std::uint64_t seed);

  StochasticSystem system;
  std::size_t dimension;
  std::size_t count;
  double dt;
  std::uint64_t seed;
  bool antithetic = false;  ///< path 2j + 1 has the noise of path 2j with the other sign, and that the number j
  std::size_t channels;
  std::vector<NoiseLoad> position;  ///< h_i,p, without its zeros
  std::vector<NoiseLoad> momentum;  ///< h_i,q
  double length_unit;
  double momentum_unit;
  std::vector<KernelTerm> terms;  ///< Δt K in these units
  double at_zero;                 ///< Δt K(0) in these units
  double lipschitz;               ///< of Δt K in these units
};

/// Memory for the vectors, aligned as the widest of them needs.
template <class Number>
class LaneStore {
 public:
  /// Room for so many numbers, of any content.
  Number* reserve(std::size_t size) {
    constexpr std::size_t kNumbers = 64 / sizeof(Number);
    if (lines_.size() * kNumbers < size) lines_.resize((size + kNumbers - 1) / kNumbers);
    return lines_.data()->numbers.data();
  }

 private:
  struct alignas(64) Line {
    std::array<Number, 64 / sizeof(Number)> numbers;
  };
  std::vector<Line> lines_;
};

/// Neighbouring paths, one in each lane. Coordinate i = landmark·d + axis of path l is at i·kPathBatch + l.
struct LandmarkBatch {
  std::vector<double> q;
  std::vector<double> p;       ///< adapted
  std::vector<double> moved;   ///< Δt K(q)p of the last step: where the next step begins its iteration
  std::vector<double> before;  ///< normals of the last step, channel·kPathBatch + l
  PathLanes largest_momentum;  ///< max |p_a| over landmarks and time
  PathLanes smallest_side;  ///< d = 1: min over time and neighbours at the start of their gap: ≤ 0 where order changed
  std::vector<std::size_t> order;  ///< d = 1: landmarks from left to right at the start
  std::array<LaneStatus, kPathBatch> status;
  std::array<std::uint32_t, kPathBatch> stopped;  ///< the step that could not be taken, where the status is not running
  std::uint64_t first_path;
  LaneStore<double> wide;  ///< working memory of a few paths
  LaneStore<float> narrow;
};

/// kPathBatch paths from `first_path` on, all at one start, of noise with so many channels.
LandmarkBatch landmark_batch(std::size_t channels, std::uint64_t first_path, const PhaseState& start);

/// Adds what is not 0 of a gradient of channel `channel` to `loads`.
void add_loads(const Points& gradient, std::size_t channel, std::vector<NoiseLoad>& loads);

/// Takes steps first … last − 1 of (20) for all running lanes with the best vector target of this machine. A lane is a
/// function of its path number alone, and the same for any split of the steps into calls. Not thread-safe in `batch`.
void advance_landmarks(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last);

/// One lane among vectors: its coordinate i is at i·stride.
struct LaneStep {
  const double *c, *m;  ///< positions and momenta after the noise of the step
  double *q, *p;        ///< at its end
  std::size_t stride;
};

/// One step of (20) after its noise, in the units of the model: from (c, m) to q = c + Δt K(q)m and p = m − Δt H_q(q,
/// m), by the integrator's thorough search. @return false where it finds no root
bool solve_landmarks(const LandmarkModel& model, const LaneStep& lane);

}  // namespace pulson::ensemble
