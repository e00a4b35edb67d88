#pragma once

#include <array>
#include <cstdint>

#include "path_sampler.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::ensemble {

/// Channels of a pair's noise: four for noise in both positions and both momenta.
inline constexpr int kMostPairChannels = 4;

/// How the noise of a pair acts, with z = q₂ − q₁.
enum class PairNoise {
  kConstant,   ///< h_i = position_i·p + momentum_i·q, as ch-sd, constant p-sd and trouve-vialard give
  kPotential,  ///< h = β exp(−z²/γ)
  kScreened,   ///< h_i = β p_a exp(−z²/γ) for the a that channel i moves; (20) as printed, without compensation
};

/// Two landmarks on a line with a noise that lanes know.
struct PairModel {
  explicit PairModel(const KernelTerm& term = {});

  KernelTerm kernel;
  double lipschitz;  ///< sup |K'|
  double reach;      ///< the distance beyond which K counts as 0: there it is below 1e-18 K(0)
  double dt = 0.02;
  std::uint64_t seed = 1;
  bool antithetic = false;  ///< path 2j + 1 has the noise of path 2j with the other sign, and that the number j
  PairNoise noise = PairNoise::kConstant;
  int channels = 0;
  /// kConstant: h_i,p of landmarks 1 and 2. kScreened: 1 for the landmark that channel i moves, 0 for the other.
  std::array<std::array<double, 2>, kMostPairChannels> position{};
  std::array<std::array<double, 2>, kMostPairChannels> momentum{};  ///< kConstant: h_i,q
  double beta = 0;
  double gamma = 1;
  double momentum_bound = 1e8;  ///< paths beyond it stop at the next step whose number is a multiple of four
};

/// Neighbouring paths of the pair, one in each lane. The gap q₂ − q₁ is kept in place of q₂, so that tiny gaps are
/// exact.
struct alignas(64) PairBatch {
  PathLanes q1;
  PathLanes gap;
  PathLanes p1;  ///< adapted
  PathLanes p2;
  PathLanes value;  ///< K at the gap, or nearly: where the next step begins its iteration
  std::array<PathLanes, kMostPairChannels> before;  ///< normals of the last step
  PathLanes largest_momentum;                       ///< max |p_a| over time
  PathLanes smallest_side;                          ///< min over time of gap·side: not positive where it ever crossed
  std::array<LaneStatus, kPathBatch> status;
  std::array<std::uint32_t, kPathBatch> stopped;  ///< the step that could not be taken, where the status is not running
  double side;                                    ///< sign of the gap at the start
  std::uint64_t first_path;
};

/// kPathBatch paths from `first_path` on, all at one start.
PairBatch pair_batch(const PairModel& model, std::uint64_t first_path, double q1, double gap, double p1, double p2);

/// Takes steps first … last − 1 of (20) for all running lanes with the best vector target of this machine. A lane is a
/// function of its path number alone, and the same for any split of the steps into calls.
void advance_pair(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last);

/// K and K' at a gap.
void pair_kernel(const KernelTerm& kernel, double gap, double& value, double& slope);

/// The root of g = c + a (K(0) − K(g)), a = Δt (p₂ − p₁), on the branch from a = 0, for the steps with κ = |a| Lip(K) ≥
/// 1 that vectors leave. @return false where the branch ends before a
bool solve_gap(const KernelTerm& kernel, double c, double a, double& gap);

}  // namespace pulson::ensemble
