#pragma once

#include "implicit_step.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// An explicit Runge–Kutta scheme: k_i = F(z + Σ_{j<i} a_ij k_j), z⁺ = z + Σ_i b_i k_i, where F adds up what a step of
/// (11) does, noise increments as they are. Not symplectic.
struct ExplicitTableau {
  std::string name;
  Eigen::MatrixXd a;  ///< strictly lower triangular
  Eigen::VectorXd b;
  int order;
  bool noise;
};

/// z* = z + F(z), z⁺ = z + ½(F(z) + F(z*)): converges to the Stratonovich equation, strong order 1 for one channel or
/// additive noise and ½ else, weak order 1, order 2 without noise.
ExplicitTableau heun_tableau();

/// The classical scheme of order 4, for no noise.
ExplicitTableau rk4_tableau();

class RungeKuttaIntegrator final : public Integrator {
 public:
  explicit RungeKuttaIntegrator(ExplicitTableau tableau) : tableau_(std::move(tableau)) {}

  std::string name() const override { return tableau_.name; }
  IntegratorTraits traits() const override {
    return {.symplectic = false, .noise = tableau_.noise, .order = tableau_.order};
  }

  /// All rows at once by a RowSweep, four products of dN×dN matrices a stage.
  EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const override;

  /// At rest all rows at once, by products with dN×dN matrices, four a step of Heun's method.
  PathRows adjoint_rows(const StochasticSystem& system, const Trajectory& path,
                        const Eigen::MatrixXd& by_end) const override;

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;

 private:
  ExplicitTableau tableau_;
};

/// The implicit midpoint rule z⁺ = z + F(m), m = ½(z + z⁺), for what a step adds up. Its derivatives are given at m.
class MidpointStep {
 public:
  /// @param dt 0 for the noise alone
  MidpointStep(const StochasticSystem& system, double dt, const Eigen::VectorXd& w)
      : system_(system), field_(system, dt, w), dt_(dt) {}

  struct Outcome {
    PhaseState middle;
    PhaseState end;
    bool found = true;
    bool continued = false;
    double contraction = 0;
  };
  Outcome take(const PhaseState& start, RootSearch search) const;

  /// @param w_change, parameters what changes in F; parameters may be empty for none
  PhaseState tangent(const PhaseState& middle, const PhaseState& change, const Eigen::VectorXd& w_change,
                     const Eigen::VectorXd& parameters) const;

  /// The transpose; adds the derivatives by w and the parameters of the noise.
  PhaseState adjoint(const PhaseState& middle, const PhaseState& end_bar, Eigen::VectorXd& w_bar,
                     Eigen::VectorXd& parameters_bar) const;

 private:
  const StochasticSystem& system_;
  StepField field_;
  double dt_;
};

/// The stochastic implicit midpoint rule: with z = (q, p), m = ½(z + z⁺) and the increments ΔW of the step,
///
///     z⁺ = z + Δt J∇H(m) + Σ_i J∇h_i(m) ΔW_i        J∇H = (H_p, −H_q)
///
/// Symplectic for frozen increments; converges to the Stratonovich equation (11), with strong order 1 for one channel
/// or additive noise and ½ else, weak order 1, order 2 without noise, and then reversible. m is the root that is
/// continuously connected to Δt = 0 and ΔW = 0. (Milstein, Repin, Tretyakov, SIAM J. Numer. Anal. 39, 2002, who
/// truncate ΔW so that m always exists; here a step without such an m is an error.)
class MidpointIntegrator final : public Integrator {
 public:
  std::string name() const override { return "midpoint"; }
  IntegratorTraits traits() const override { return {.reversible = true, .order = 2}; }

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;
};

/// The stochastic variational integrator (20) of Holm and Tyranowski, as printed or compensated. In the adapted state
/// (q, p̂), with w_k = ½(ΔW_{k−1} + ΔW_k), ΔW_{−1} = ΔW_K = 0 as the variation of the finite sums in (19) gives, one
/// step is
///
///     p + Σ h_i,q(q,p) w_k = p̂                      linear in p
///     q⁺ = q + Σ h_i,p(q,p) w_k + Δt (H + G)_p(q⁺,p)    implicit in q⁺
///     p̂⁺ = p − Δt (H + G)_q(q⁺,p) − λΔt H_p(q⁺,p)
///
/// p is the pᵏ of (20), which already holds half of the coming increment: p̂⁺ = p⁺ + Σ h_i,q(q⁺,p⁺) w_{k+1} there.
/// `variational-paper` has G = 0. It converges to the Stratonovich equation of H − ¼ Σ h_i,q·h_i,p, which is (11) only
/// where h_i,q·h_i,p = 0. `variational` has G = ¼ Σ h_i,q·h_i,p and converges to (11) for every noise model; where G
/// vanishes the two are the same.
///
/// A composition of canonical maps for frozen increments: symplectic in (q, p̂), and exact in the total momentum,
/// because its equations are solved to round-off (but for friction λ, which Langevin's noise has). Strong order ½, weak
/// order 1, order 1 without noise.
///
/// The roots p and q⁺ are those continuously connected to w = 0 and Δt = 0. On that branch landmarks never meet in a
/// step of the flow only (G = 0), as two equal columns of q⁺ would need two equal columns of the right-hand side, so
/// order on a line changes only by the noise, for any Δt.
class VariationalIntegrator final : public Integrator {
 public:
  explicit VariationalIntegrator(bool compensated) : compensated_(compensated) {}

  std::string name() const override { return compensated_ ? "variational" : "variational-paper"; }
  IntegratorTraits traits() const override { return {}; }

  /// Cost O(K (dN)³), memory O((dN)² + dN·CK).
  EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const override;

  /// Landmarks without momentum and without a change of it are passive: for M others, cost
  /// O(K ((dM)³ + (dM)²R + dN dM R)), memory O(dN R), if noise is additive and does not move the momenta; else
  /// all rows at once, or of few changes a tangent for each.
  Eigen::MatrixXd endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                   const Eigen::MatrixXd& momentum_changes) const override;

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;
  Eigen::MatrixXd acting(const Eigen::MatrixXd& increments) const override { return acting_increments(increments); }
  Eigen::MatrixXd acting_transposed(const Eigen::MatrixXd& acting_bar) const override {
    return acting_increments_transposed(acting_bar);
  }

 private:
  bool compensates(const NoiseModel& noise) const { return compensated_ && noise.traits().compensated; }
  Eigen::MatrixXd rows(const StochasticSystem& system, const Trajectory& path, Eigen::MatrixXd* by_acting) const;

  bool compensated_;
};

/// A symmetric composition of the variational integrator (20) and its adjoint method, with the noise of the step
/// between them. With h = ½Δt, the increments ΔW of the step and h_w = Σ h_i ΔW_i, one step is
///
///     p' = p − h H_q(q,p') − λh H_p(q,p'),     q' = q + h H_p(q,p')             implicit in p'
///     (q'',p'') = the flow of h_w over time 1 from (q',p')
///     q⁺ = q'' + h H_p(q⁺,p''),     p⁺ = p'' − h H_q(q⁺,p'') − λh H_p(q⁺,p'')   implicit in q⁺
///
/// The flow of h_w is exact where ∇h_w is constant, or depends only on q and moves only momenta; else it is the
/// implicit midpoint rule. Each part is canonical for frozen increments, so the step is symplectic in (q, p) (but for
/// friction λ, which Langevin's noise has) and exact in the total momentum. It converges to the Stratonovich equation
/// (11) without compensation.
///
/// `variational-2`. Without noise reversible and of order 2. Strong order 1 for one channel or commuting ones, ½ else.
/// Weak order 2 where the flow of h_w is exact, 1 else. As many implicit solves as two steps of (20); where h_w is
/// solved for as well, that solve takes no sums of the kernel. Noise acts within its step: nothing is left to the next.
///
/// `stormer-verlet` is the same, for no noise: the Störmer–Verlet scheme for a Hamiltonian that does not separate
/// (Hairer, Lubich, Wanner, Geometric Numerical Integration, VI (3.4)).
///
/// Roots are those continuously connected to Δt = 0 and ΔW = 0.
class SymmetricVariationalIntegrator final : public Integrator {
 public:
  explicit SymmetricVariationalIntegrator(bool noise) : noise_(noise) {}

  std::string name() const override { return noise_ ? "variational-2" : "stormer-verlet"; }
  IntegratorTraits traits() const override { return {.reversible = true, .noise = noise_, .order = 2}; }

  /// Cost O(K (dN)³), memory O((dN)² + dN·CK).
  EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const override;

  /// Landmarks without momentum and without a change of it are passive: for M others, cost
  /// O(K ((dM)³ + (dM)²R + dN dM R)), memory O(dN R), if noise is additive and does not move the momenta; else
  /// all rows at once, or of few changes a tangent for each.
  Eigen::MatrixXd endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                   const Eigen::MatrixXd& momentum_changes) const override;

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;

 private:
  /// Where the derivatives of the three parts are taken: (q, p'), the midpoint of the noise (empty without noise) and
  /// (q⁺, p''). `Trajectory::stage_momenta` holds p'; the noise is solved for again.
  struct Parts {
    PhaseState first;
    PhaseState noise;
    PhaseState second;
  };
  static Parts parts_of(const Step& step);
  Eigen::MatrixXd rows(const StochasticSystem& system, const Trajectory& path, Eigen::MatrixXd* by_increments) const;

  bool noise_;
};

}  // namespace pulson
