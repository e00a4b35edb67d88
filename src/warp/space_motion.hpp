// Points of space through one step of a path, with the gradient of their map where it is wanted.

#pragma once

#include <vector>

#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/integrators/space_step.hpp"

namespace pulson {

/// Points on their way, and ∂X/∂x in columns of d×d; without columns: not wanted.
struct PointsOnTheWay {
  Points x;
  Eigen::MatrixXd gradients;

  bool with_gradients() const { return gradients.cols() > 0; }
};

/// What moves points beside the fields of a step: by row of its table d×M, and its gradient by the label, d²×M. Rows
/// may be empty: 0.
struct OwnDisplacements {
  std::vector<Points> places;
  std::vector<Eigen::MatrixXd> gradients;
};

/// One SpaceStep for a system, applied to points.
class SpaceMotion {
 public:
  /// @param count of the landmarks
  SpaceMotion(const StochasticSystem& system, const SpaceStep& step, int count)
      : system_(system), step_(step), count_(count) {}

  /// X to X⁺. False where an implicit stage has no root that is certain to be the right one.
  bool forward(PointsOnTheWay& points, const OwnDisplacements& own) const;

  /// X⁺ to X, without displacements of their own. False where there is no X.
  bool backward(PointsOnTheWay& points) const;

 private:
  /// drift·u + noise·η at some points, and its gradient.
  struct Field {
    Points value;
    Eigen::MatrixXd gradients;
  };
  Field field(Eigen::Index stage, double drift, double noise, const Points& x, bool with_gradients) const;
  bool solve(Eigen::Index stage, const Points& c, Points& y) const;
  bool ends_in_last_stage() const;
  bool backward_from_last_stage(PointsOnTheWay& points) const;
  bool backward_by_newton(PointsOnTheWay& points) const;

  const StochasticSystem& system_;
  const SpaceStep& step_;
  int count_;
};

}  // namespace pulson
