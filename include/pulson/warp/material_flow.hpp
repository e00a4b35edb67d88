#pragma once

#include <optional>
#include <vector>

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The motion of every point of space under a landmark path. The point with label x (its place at t = 0) moves by
///
///     X⁺ = X + Δt (Σ_b K(X⁺ − q_b⁺) p_b + η(X⁺)) + Σ_i ξ_i(X) w_i + Σ_a c_a(x) δ_a,   X(0) = x
///
/// the step of the variational integrators, where ξ_i are the fields of noise over space and η what compensates them
/// (P-SD); δ_a is what other noise moved landmark a in this step, and c(x) = K(x,q0) K(q0,q0)^{-1} are the cardinal
/// functions of kernel interpolation in label space: each object takes its interior along, so two of them pass through
/// each other cleanly. The map is a diffeomorphism where δ = 0, and may fold else. K(q0,q0) is inverted on the
/// eigenvectors whose eigenvalue is at least 1e-10 of the largest.
class MaterialFlow {
 public:
  /// @throws InputError for a path of another integrator
  MaterialFlow(StochasticSystem system, Trajectory path);

  /// Places of the labelled points at every time of the path. @param labels d×M @return K+1 matrices d×M @throws
  /// StepError where a step is too large for a point
  std::vector<Points> paths(const Points& labels) const;

  /// Places at the end of the path, d×M.
  Points end(const Points& labels) const;

 private:
  Points step(int k, const Points& x, const Points& labels) const;
  std::optional<Points> solve_points(const Points& c, const Points& q, const Points& p) const;
  Points field(const Points& x, const Points& q, const Points& p) const;

  StochasticSystem system_;
  Trajectory path_;
  Eigen::MatrixXd w_;  ///< increments that act in each step, C×K
  bool compensates_ = false;
  std::vector<Points> landmark_noise_;      ///< per step δ, d×N; empty where it is zero
  std::vector<Points> noise_coefficients_;  ///< per step K(q0,q0)^{-1} applied to δ, d×N; empty where it is zero
};

}  // namespace pulson
