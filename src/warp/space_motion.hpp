// Points of space through one step of a path, with the gradient of their map where it is wanted.

#pragma once

#include <vector>

#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::warp {

/// Points carried by the flow, and ∂X/∂x in columns of d×d; no columns if gradients are not wanted.
struct Tracers {
  Points x;
  Eigen::MatrixXd gradients;

  bool with_gradients() const { return gradients.cols() > 0; }
};

/// Displacements interpolated in label space, in addition to the fields of a step: by row of its table d×M, and the
/// gradient by the label, d²×M. Empty rows are 0.
struct LabelDisplacements {
  std::vector<Points> places;
  std::vector<Eigen::MatrixXd> gradients;
};

/// One SpaceStep for a system, applied to points.
class SpatialStep {
 public:
  SpatialStep(const StochasticSystem& system, const SpaceStep& step)
      : system_(system), step_(step), has_fields_(system.noise->traits().displacement.has_field()) {}

  /// X to X⁺. False where an implicit stage has no root that is certain to be the right one.
  bool forward(Tracers& points, const LabelDisplacements& own) const;

  /// X⁺ to X, without label displacements. False where there is no X.
  bool backward(Tracers& points) const;

 private:
  /// drift·u + noise·η at some points, and its gradient.
  struct Field {
    Points value;
    Eigen::MatrixXd gradients;
  };
  Field field(Eigen::Index stage, double drift, double noise, const Points& x, bool with_gradients) const;
  bool solve(Eigen::Index stage, const Points& c, Points& y) const;
  bool ends_in_last_stage() const;
  bool backward_from_last_stage(Tracers& points) const;
  bool backward_by_newton(Tracers& points) const;

  const StochasticSystem& system_;
  const SpaceStep& step_;
  bool has_fields_;  ///< of the noise
};

}  // namespace pulson::warp
