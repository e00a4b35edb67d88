#pragma once

#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

/// The adjoint of all coordinates r of q(T) at once, as dense matrices: column r of (q̄, p̄), dN×dN each, is the adjoint
/// state of r. It begins at the end of a path and is carried back through the parts of its steps.
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
  /// @param inside (q, p) @param by_w dN×C
  void through_noise(const PhaseState& inside, const Eigen::VectorXd& w, Eigen::Ref<Eigen::MatrixXd> by_w);

  /// Through the midpoint rule of h_w.
  void through_midpoint_noise(const PhaseState& middle, const Eigen::VectorXd& w, Eigen::Ref<Eigen::MatrixXd> by_w);

 private:
  void rows_by_noise(const PhaseState& at, const Eigen::MatrixXd& mu, const Eigen::MatrixXd& nu,
                     Eigen::Ref<Eigen::MatrixXd> by_w) const;

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
};

}  // namespace pulson
