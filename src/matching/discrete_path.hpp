#pragma once

#include <optional>
#include <vector>

#include "cometric.hpp"
#include "pulson/core/time_grid.hpp"

namespace pulson::matching {

/// What moves landmarks in the steps of a path: fields v_k(x) = Σ_b K(x − c_b) p_b, the controls of the noise, and what
/// each landmark does by itself.
struct StepFields {
  std::vector<Points> centres;            ///< K, d×M
  std::vector<Points> momenta;            ///< K, d×M
  std::vector<Eigen::VectorXd> controls;  ///< K, C numbers: u
  std::vector<Points> own;                ///< K, d×N: see own_velocities(); or none
};

/// A path of landmarks in midpoint steps, with the momenta of least energy that move them along it: with q̄_k =
/// ½(q_k + q_{k+1}),
///
///     (q_{k+1} − q_k)/Δt = A(q̄_k) p_k,    ∫H_tot dt = Σ_k Δt ½ p_k·A(q̄_k) p_k.
///
/// That is the midpoint rule's discrete Lagrangian: a path that is stationary for its sum and an end cost is one of
/// MidpointIntegrator's.
struct DiscretePath {
  TimeGrid grid;
  std::vector<Points> nodes;               ///< K + 1, d×N
  std::vector<PhaseState> middles;         ///< K: q̄_k, p_k
  std::vector<Cometric> cometrics;         ///< K
  std::vector<Eigen::MatrixXd> gradients;  ///< K: ∂v/∂x of its fields at the landmarks, see discrete_path.cpp; or 0
  double energy = 0;                       ///< Σ Δt H_tot

  /// Whether a model of it lets landmarks keep their velocities where they move, rather than the fields: on a line
  /// where many have noise of their own. Where they change their order, slopes of the fields are greater than steps
  /// resolve.
  bool keeps_velocities = false;

  const Points& end() const { return nodes.back(); }
};

/// Whether each of so many landmarks on a line has noise that sweeps solve: see keeps_velocities.
bool searched_by_sweeps(const KernelOperator& kernel, const NoiseCometric& noise, const Points& q);

/// The momenta of a path that is given by its nodes; empty where the cometric of a step is singular, or where its
/// fields nearly turn space over in a step, so that the midpoint rule soon has no single root.
/// @param constant of noise that is additive, where it is known already
/// @param keeps_velocities of the path; that of sweeps along a line where each landmark has noise does in any case
std::optional<DiscretePath> along(const EffectiveHamiltonian& system, const TimeGrid& grid, std::vector<Points> nodes,
                                  const NoiseCometric* constant = nullptr, bool keeps_velocities = false);

/// What momenta make each landmark do by itself: εK(0)p, see regularisation(), and where noise moves a landmark by
/// where others are, so that it has no field over space, what the controls λh(q, p) make it do.
Points own_velocities(const EffectiveHamiltonian& system, const PhaseState& at);

/// The nodes of the same path in `steps` steps, by cubic interpolation in time.
std::vector<Points> resampled(const std::vector<Points>& nodes, int steps);

/// The fields of a path.
StepFields fields_of(const EffectiveHamiltonian& system, const DiscretePath& path);

/// Where the fields of step k carry landmarks from `start`; empty where the midpoint step has no root near the guess.
/// @param guess of the change of the landmarks, d×N
std::optional<Points> carried_by_step(const StochasticSystem& system, const TimeGrid& grid, const StepFields& fields,
                                      std::size_t k, const Points& start, const Points& guess);

/// The nodes of landmarks that are carried by fields; empty where a midpoint step has no root near the guess.
/// @param guess K + 1 nodes nearby
std::optional<std::vector<Points>> carried(const StochasticSystem& system, const TimeGrid& grid, const Points& source,
                                           const StepFields& fields, const std::vector<Points>& guess);

}  // namespace pulson::matching
