#pragma once

#include <vector>

#include <Eigen/SparseCore>

#include "pulson/dynamics/stochastic_system.hpp"
#include "schemes.hpp"

namespace pulson {

/// F(q) = Δt (H + G)_p(q, p): the implicit map of the positions.
class PositionMap final : public ImplicitMap {
 public:
  PositionMap(const StochasticSystem& system, const Points& p, double dt, bool compensates)
      : system_(system), p_(p), dt_(dt), compensates_(compensates) {}

  Points value(const Points& q) const override;
  Eigen::MatrixXd jacobian(const Points& q) const override;
  Eigen::VectorXd rounding_scale() const override;
  /// No two landmarks, one of them with momentum, may turn about each other by more than a right angle: an iteration
  /// that overshoots can land on a root where two of them have passed each other; on the branch from Δt = 0 they
  /// cannot.
  bool on_same_branch(const Points& before, const Points& after) const override;

  /// F'(q) δ and F'(q)ᵀ μ.
  Points tangent(const Points& q, const Points& delta) const;
  Points transposed(const Points& q, const Points& mu) const;

 private:
  const StochasticSystem& system_;
  const Points& p_;
  double dt_;
  bool compensates_;
};

/// F(p) = −Δt H_q(q, p) − λΔt H_p(q, p): the implicit map of the momenta in the adjoint of (20).
class KickMap final : public ImplicitMap {
 public:
  /// @param momenta that bound the terms of F
  KickMap(const StochasticSystem& system, const Points& q, const Points& momenta, double dt)
      : system_(system), q_(q), momenta_(momenta), dt_(dt) {}

  Points value(const Points& p) const override;
  Eigen::MatrixXd jacobian(const Points& p) const override;
  Eigen::VectorXd rounding_scale() const override;
  double contraction() const override { return 0.5; }

  /// F'(p) δ and F'(p)ᵀ μ.
  Points tangent(const Points& p, const Points& delta) const;
  Points transposed(const Points& p, const Points& mu) const;

 private:
  double friction() const { return system_.noise->friction(); }

  const StochasticSystem& system_;
  const Points& q_;
  const Points& momenta_;
  double dt_;
};

/// F(p) = −Σ h_i,q(q, p) w: the affine map that leads from the adapted momentum to p.
class MomentumMap final : public ImplicitMap {
 public:
  MomentumMap(const NoiseModel& noise, const Points& q, const Eigen::VectorXd& w) : noise_(noise), q_(q), w_(w) {}

  Points value(const Points& p) const override { return -noise_.gradient({q_, p}, w_).q; }
  Eigen::MatrixXd jacobian(const Points& p) const override;
  Eigen::VectorXd rounding_scale() const override { return Eigen::VectorXd::Zero(1); }

 private:
  const NoiseModel& noise_;
  const Points& q_;
  const Eigen::VectorXd& w_;
};

/// K ⊗ I as a dN×dN matrix. @param gram K
Eigen::MatrixXd velocity_matrix(const Eigen::MatrixXd& gram, Eigen::Index dimension);

/// The flow of (20) over a time Δt, with the friction λ of the noise and with G = 0 unless it compensates:
///
///     q⁺ = q + Δt (H + G)_p(q⁺,p)                       implicit in q⁺
///     p⁺ = p − Δt (H + G)_q(q⁺,p) − λΔt H_p(q⁺,p)
///
/// Its derivatives are given at `at` = (q⁺, p).
class FlowPart {
 public:
  FlowPart(const StochasticSystem& system, double dt, bool compensates)
      : system_(system), dt_(dt), compensates_(compensates) {}

  /// q⁺
  ImplicitRoot positions(const PhaseState& start, RootSearch search) const;

  /// p⁺
  Points momenta(const PhaseState& at) const;

  /// @param parameters of the noise, their change; empty for none
  PhaseState tangent(const PhaseState& at, const PhaseState& change, const Eigen::VectorXd& parameters) const;

  /// The transpose; adds the derivative by the parameters of the noise.
  PhaseState adjoint(const PhaseState& at, const PhaseState& end_bar, Eigen::VectorXd& parameters_bar) const;

 private:
  bool bends_in_momenta() const { return compensates_ && !system_.noise->traits().affine; }

  const StochasticSystem& system_;
  double dt_;
  bool compensates_;
};

/// The adjoint method of FlowPart (the inverse of its step over −Δt), with G = 0:
///
///     p' = p − Δt H_q(q,p') − λΔt H_p(q,p')             implicit in p'
///     q' = q + Δt H_p(q,p')
///
/// Its derivatives are given at `at` = (q, p').
class AdjointFlowPart {
 public:
  AdjointFlowPart(const StochasticSystem& system, double dt) : system_(system), dt_(dt) {}

  /// p'
  ImplicitRoot momenta(const PhaseState& start, RootSearch search) const;

  /// q'
  Points positions(const PhaseState& at) const;

  PhaseState tangent(const PhaseState& at, const PhaseState& change, const Eigen::VectorXd& parameters) const;
  PhaseState adjoint(const PhaseState& at, const PhaseState& end_bar, Eigen::VectorXd& parameters_bar) const;

 private:
  const StochasticSystem& system_;
  double dt_;
};

/// The adjoint of all coordinates r of q(T) at once, as dense matrices: column r of (q̄, p̄), dN×dN each, is the adjoint
/// state of r. It begins at the end of a path and is carried back through the parts of its steps, or their stages.
/// Cost O((dN)³) a part, memory O((dN)²).
class RowSweep {
 public:
  /// @param dt of the parts without noise @param compensates whether these have G
  RowSweep(const StochasticSystem& system, double dt, bool compensates, Eigen::Index d, Eigen::Index n);

  /// ∂q(T)/∂p of where it has come to, transposed.
  const Eigen::MatrixXd& p_bar() const { return p_bar_; }

  /// From the end (q, p⁺) of FlowPart to its start. @param p of the start
  void through_flow(const Points& q, const Points& p);

  /// From the end (q', p) of AdjointFlowPart to its start. @param q of the start @param p of the end
  void through_adjoint_flow(const Points& q, const Points& p);

  /// Through the noise of (20): from (q + h_w,p, p) to (q, p̂), with the derivatives of the rows by w.
  /// @param inside (q, p) @param by_w dN×C, or dN×0 where they are not wanted
  void through_noise(const PhaseState& inside, const Eigen::VectorXd& w, Eigen::Ref<Eigen::MatrixXd> by_w);

  /// Through a step of an explicit Runge–Kutta method, all of it in the dt given. @param stages z_i
  void through_stages(const ExplicitTableau& tableau, const std::vector<PhaseState>& stages, const Eigen::VectorXd& w,
                      Eigen::Ref<Eigen::MatrixXd> by_w);

  /// Through the midpoint rule of h_w.
  void through_midpoint_noise(const PhaseState& middle, const Eigen::VectorXd& w, Eigen::Ref<Eigen::MatrixXd> by_w);

 private:
  void add_velocities(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& from, Eigen::MatrixXd& to) const;
  struct Fields {
    Eigen::MatrixXd q, p;  ///< ∇h_i, dN×C
  };
  struct Adjoints {
    Eigen::MatrixXd q, p;
  };
  /// F'(z)ᵀμ of a StepField.
  Adjoints field_transposed(const PhaseState& z, const Adjoints& mu, const Eigen::VectorXd& w) const;
  Fields fields(const PhaseState& at, Eigen::Index channels) const;
  void rows_by_noise(const PhaseState& at, const Eigen::MatrixXd& mu, const Eigen::MatrixXd& nu,
                     Eigen::Ref<Eigen::MatrixXd> by_w);

  const StochasticSystem& system_;
  const NoiseModel& noise_;
  NoiseTraits traits_;
  double dt_;
  bool compensates_;
  Eigen::Index d_;
  Eigen::Index n_;
  Eigen::MatrixXd one_;
  Eigen::MatrixXd q_bar_;
  Eigen::MatrixXd p_bar_;
  Eigen::SparseMatrix<double> constant_q_, constant_p_;  ///< Fields of additive noise
};

/// A part of a step that has no noise, of FlowPart with (q, p) = (q⁺, p), or of AdjointFlowPart with (q, p'). It refers
/// to the path.
struct FlowSegment {
  const Points& q;
  const Points& p;
  double dt;
  bool adjoint;
};

/// Whether the noise between the parts has no share in the change of q(T) with p0.
bool changes_need_no_noise(const NoiseTraits& traits);

/// Whether all rows of ∂q(T)/∂p0 by a RowSweep cost less than a tangent for each change: a tangent costs as much as a
/// tenth of the rows or more (30 landmarks in the plane: 60 tangents 45 times as much for p-sd, 20 times for
/// ch-sd-screened, 11 times for kunita, 5 times for trouve-vialard, as much for potential).
bool rows_cost_less(const Trajectory& path, const Eigen::MatrixXd& momentum_changes);

/// Many tangents of one path at once, as products of matrices: the changes of q(T), dN×R, for R changes of p0 (index
/// a·d + axis). Without noise in the momenta a landmark at p = 0 keeps it: it is carried along, and acts on nothing.
/// The equations of the M others are solved for themselves; the carried ones follow, each by a d×d matrix. Cost O((dM)³
/// + (dM)²R + dN dM R) a segment, memory O(dN R).
Eigen::MatrixXd changes_along(const KernelOperator& kernel, const Points& p0, const std::vector<FlowSegment>& segments,
                              const Eigen::MatrixXd& momentum_changes);

}  // namespace pulson
