#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/name_table.hpp"
#include "pulson/core/time_grid.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

/// No unique solution of a step could be had, or the state left the range of numbers. The message names the step, its
/// size and the remedy.
class StepError : public InputError {
 public:
  StepError(int step, const TimeGrid& grid, const std::string& reason);

  int step() const { return step_; }

 private:
  int step_;
};

/// The states of one sample path at the times of its grid, and what the steps met.
struct Trajectory {
  TimeGrid grid;
  std::vector<PhaseState> states;   ///< K+1 adapted states (q, p̂)
  double contraction_bound = 0;     ///< largest κ of the steps, see contraction_bound()
  double contraction_measured = 0;  ///< largest ratio of successive corrections in the steps' fixed-point iterations
  int continuation_steps = 0;  ///< steps whose root was followed from Δt = 0 because the iteration did not contract

  const PhaseState& initial() const { return states.front(); }
  const PhaseState& final() const { return states.back(); }
};

/// Derivatives of the end point with respect to what a path depends on.
struct PathGradient {
  Points q0_bar;                   ///< d×N
  Points p0_bar;                   ///< d×N
  Eigen::MatrixXd increments_bar;  ///< C×K
};

/// The linear map from (p0, ΔW) to q(T), one row per coordinate of q(T) (index a·d + axis).
struct EndpointJacobian {
  Eigen::MatrixXd momenta;     ///< dN×dN, ∂q(T)/∂p0
  Eigen::MatrixXd increments;  ///< dN×CK, ∂q(T)/∂ΔW, channel fastest
};

/// How far an implicit step goes to find its root.
enum class RootSearch {
  kThorough,     ///< the root is followed from Δt = 0 where the fixed-point iteration does not contract
  kContracting,  ///< only steps whose iteration contracts are taken: cheap, and well away from where the root ends
};

/// A one-step method for the stochastic Hamiltonian system (11), with its exact discrete tangent and adjoint.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// The name in integrator_table().
  virtual std::string name() const = 0;

  /// A sample path. @param increments ΔW, C×K, column k over step k @throws StepError
  virtual Trajectory integrate(const StochasticSystem& system, const PhaseState& initial, const TimeGrid& grid,
                               const Eigen::MatrixXd& increments, RootSearch search = RootSearch::kThorough) const = 0;

  /// The change of the final state along a change of the initial state and of the increments, to first order.
  virtual PhaseState tangent(const StochasticSystem& system, const Trajectory& path, const PhaseState& initial_change,
                             const Eigen::MatrixXd& increments_change) const = 0;

  /// The transpose of `tangent`: given ∂f/∂(q,p)(T), returns ∂f/∂q0, ∂f/∂p0, ∂f/∂ΔW.
  virtual PathGradient adjoint(const StochasticSystem& system, const Trajectory& path,
                               const PhaseState& final_bar) const = 0;

  /// All rows of the derivative of q(T) at once. Cost O(K (dN)³), memory O((dN)² + dN·CK).
  virtual EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const = 0;
};

using MakeIntegrator = std::unique_ptr<const Integrator> (*)();

/// Integrators by name; see `pulson info integrators`.
const NameTable<MakeIntegrator>& integrator_table();

/// @throws InputError for a name that is not in the table
std::unique_ptr<const Integrator> make_integrator(std::string_view name);

/// w_k = ½(ΔW_{k−1} + ΔW_k) with ΔW_{−1} = 0: the increments that act in step k of (20). @return C×K
Eigen::MatrixXd acting_increments(const Eigen::MatrixXd& increments);

/// The transpose of acting_increments.
Eigen::MatrixXd acting_increments_transposed(const Eigen::MatrixXd& acting_bar);

}  // namespace pulson
