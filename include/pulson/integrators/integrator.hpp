#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/time_grid.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

/// How one step moves any point X of space, as it moves landmarks: by stages j = 1..S, each with fields of the
/// landmarks' state then, u_j(x) = Σ_b K(x − q_b) p_b of the flow and η_j of the noise,
///
///     Y_i = X + Σ_{j≤i} (drift(i,j) u_j(Y_j) + noise(i,j) η_j(Y_j)),   i = 1..S + 1,   X⁺ = Y_{S+1}
///
/// Explicit where drift(i,i) = noise(i,i) = 0.
struct SpaceStep {
  std::vector<PhaseState> stages;  ///< (q, p) of the landmarks, S of them
  Eigen::MatrixXd drift;           ///< (S+1)×S, time
  Eigen::MatrixXd noise;           ///< (S+1)×S
  Eigen::VectorXd w;               ///< the increments of η
  bool compensated = false;        ///< whether G_p is part of u
};

/// A step has no unique solution, or the state left the range of numbers. The message names the step, its
/// size and the remedy.
class StepError : public NumericalError {
 public:
  StepError(int step, const TimeGrid& grid, const std::string& reason);

  int step() const { return step_; }

 private:
  int step_;
};

/// The states of one sample path at the times of its grid, and diagnostics of the steps.
struct Trajectory {
  std::string integrator;  ///< its name
  TimeGrid grid;
  Eigen::MatrixXd increments;         ///< ΔW, C×K
  std::vector<PhaseState> states;     ///< K+1 adapted states (q, p̂)
  std::vector<Points> stage_momenta;  ///< K momenta inside the steps where they differ from p̂, else empty
  double contraction_measured = 0;    ///< largest ratio of successive corrections in the steps' fixed-point iterations
  int continuation_steps = 0;  ///< steps whose root was followed from Δt = 0 because the iteration did not contract

  const PhaseState& initial() const { return states.front(); }
  const PhaseState& final() const { return states.back(); }
  /// The momenta that move the positions in step k: p of (20), p' of `variational-2`.
  const Points& step_momenta(int k) const {
    const auto i = static_cast<std::size_t>(k);
    return stage_momenta.empty() ? states[i].p : stage_momenta[i];
  }
};

/// The largest κ of the steps of a path, see contraction_bound() of a step. Each step costs about six sums of the
/// kernel, so it is taken where it is reported and not by integrate().
double contraction_bound(const KernelOperator& kernel, const Trajectory& path);

/// A change of what a path depends on.
struct PathChange {
  PhaseState initial;
  Eigen::MatrixXd increments;  ///< C×K
  Eigen::VectorXd parameters;  ///< of the noise, in the order of NoiseModel::parameters(); empty for none
};

/// Derivatives of a scalar with respect to what a path depends on.
struct PathGradient {
  Points q0_bar;                   ///< d×N
  Points p0_bar;                   ///< d×N
  Eigen::MatrixXd increments_bar;  ///< C×K
  Eigen::VectorXd parameters_bar;  ///< of the noise
};

/// The linear map from (p0, ΔW) to q(T), one row per coordinate of q(T) (index a·d + axis).
struct EndpointJacobian {
  Eigen::MatrixXd momenta;     ///< dN×dN, ∂q(T)/∂p0
  Eigen::MatrixXd increments;  ///< dN×CK, ∂q(T)/∂ΔW, channel fastest
};

/// Whether momenta stay zero: they are at the start, and the noise is linear in them.
bool is_at_rest(const StochasticSystem& system, const PhaseState& start);

/// Derivatives of numbers, a row each, by what a path depends on. States are (q, p), index a·d + axis, or q alone where
/// the path is at rest.
struct PathRows {
  Eigen::MatrixXd start;       ///< by the state at the start
  Eigen::MatrixXd increments;  ///< by ΔW, channel fastest
};

/// How far an implicit step goes to find its root.
enum class RootSearch {
  kThorough,     ///< the root is followed from Δt = 0 where the fixed-point iteration does not contract
  kContracting,  ///< only steps whose iteration contracts are taken: inexpensive, and well away from the end of the
                 ///< branch; of `heun` without noise, those that keep landmarks apart
};

/// What documentation and tests need to know of an integrator.
struct IntegratorTraits {
  bool symplectic = true;
  bool reversible = false;  ///< without noise: reversing the momenta leads back to the start
  bool noise = true;        ///< else it refuses noise
  int order = 1;            ///< without noise
};

/// A one-step method for the stochastic Hamiltonian system (11), with its exact discrete tangent and adjoint. All
/// methods are const and thread-safe.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// The name in integrator_table().
  virtual std::string name() const = 0;

  virtual IntegratorTraits traits() const = 0;

  /// A sample path. @param increments ΔW, C×K, column k over step k
  /// @throws StepError; InputError where the integrator refuses the noise
  Trajectory integrate(const StochasticSystem& system, const PhaseState& initial, const TimeGrid& grid,
                       const Eigen::MatrixXd& increments, RootSearch search = RootSearch::kThorough) const;

  /// The change of the final state along a change of what the path depends on, to first order.
  PhaseState tangent(const StochasticSystem& system, const Trajectory& path, const PathChange& change) const;

  /// The transpose of `tangent`: given ∂f/∂(q,p)(T), returns ∂f/∂q0, ∂f/∂p0, ∂f/∂ΔW, ∂f/∂θ.
  /// @param by_parameters whether ∂f/∂θ is wanted; else it is empty
  PathGradient adjoint(const StochasticSystem& system, const Trajectory& path, const PhaseState& final_bar,
                       bool by_parameters = true) const;

  /// All rows of the derivative of q(T) at once: here one adjoint for each.
  virtual EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const;

  /// From derivatives by the state at the end, a row each: here an adjoint for each.
  virtual PathRows adjoint_rows(const StochasticSystem& system, const Trajectory& path,
                                const Eigen::MatrixXd& by_end) const;

  /// The changes of q(T), dN×R, for R changes of p0 at once (index a·d + axis): here one tangent for each.
  virtual Eigen::MatrixXd endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                           const Eigen::MatrixXd& momentum_changes) const;

  /// How each step of a path moves the space between the landmarks.
  std::vector<SpaceStep> space_steps(const StochasticSystem& system, const Trajectory& path) const;

 protected:
  struct StepOutcome {
    PhaseState end;
    Points stage_momenta;  ///< momenta inside the step where they differ from p̂
    bool found = true;
    bool continued = false;
    double contraction = 0;
  };

  /// A step that was taken.
  struct Step {
    const StochasticSystem& system;
    double dt;
    Eigen::VectorXd w;        ///< the increments that act in it
    const PhaseState& start;  ///< adapted
    const PhaseState& end;    ///< adapted
    const Points& momenta;    ///< Trajectory::step_momenta
    Eigen::Index parameters;  ///< of the noise, by which do_adjoint() takes derivatives; 0 for none
  };

  struct StepBar {
    PhaseState start;
    Eigen::VectorXd w;
    Eigen::VectorXd parameters;
  };

  virtual StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt,
                              const Eigen::VectorXd& w, RootSearch search) const = 0;
  virtual PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                                const Eigen::VectorXd& parameters_change) const = 0;
  virtual StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const = 0;
  virtual SpaceStep do_space(const Step& step) const = 0;

  /// From the increments of the path to those that act in its steps, and the transpose of this map.
  virtual Eigen::MatrixXd acting(const Eigen::MatrixXd& increments) const { return increments; }
  virtual Eigen::MatrixXd acting_transposed(const Eigen::MatrixXd& acting_bar) const { return acting_bar; }

  static Step step_of(const StochasticSystem& system, const Trajectory& path, int k, const Eigen::MatrixXd& acting);
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
