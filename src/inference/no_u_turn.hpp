#pragma once

#include <functional>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "chain.hpp"

namespace pulson::inference {

/// A point of a trajectory: its momentum, the force there, and the energy −log w + ½|v|² + ½|η|².
struct TrajectoryPoint {
  ChainPoint at;
  Eigen::VectorXd eta, kick;
  double energy = 0;
};

/// The no-U-turn sampler (M. Hoffman and A. Gelman 2014), with the point drawn in proportion to e^−H along the
/// trajectory (M. Betancourt 2017, §A.2 and A.4.2): a trajectory is doubled forwards or backwards, by chance, until its
/// ends, or those of a half of it, turn towards each other.
class NoUTurn {
 public:
  /// A step forwards, or backwards with −1; none without a path.
  using Step = std::function<std::optional<TrajectoryPoint>(const TrajectoryPoint& from, int direction)>;

  /// @param uniforms at least 2^(most_doublings + 1) numbers in (0, 1)
  NoUTurn(Step step, Eigen::VectorXd uniforms, int most_doublings);

  /// @return the point drawn, `start` or another
  ChainPoint draw(const TrajectoryPoint& start);
  /// The mean over the points beside the first of min(1, e^(H0 − H)); 0 for those without a path.
  double acceptance() const { return tried_ > 0 ? accepted_ / tried_ : 0; }

 private:
  /// Some consecutive points.
  struct Tree {
    TrajectoryPoint first, last;
    ChainPoint drawn;
    double log_weight = 0;  ///< log Σ e^(H0 − H)
    Eigen::VectorXd sum;    ///< Σ η
  };

  std::optional<Tree> grown(const TrajectoryPoint& from, int direction, int doublings);
  std::optional<Tree> leaf(const TrajectoryPoint& from, int direction);
  /// Whether the trajectory of two consecutive trees turns, or a part of it that spans their joint.
  static bool turn(const Tree& before, const Tree& after);
  static Tree joined(Tree before, Tree after, bool takes_after);
  double uniform() { return uniforms_[next_++]; }

  Step step_;
  Eigen::VectorXd uniforms_;
  Eigen::Index next_ = 0;
  int most_doublings_;
  double energy_ = 0;
  double accepted_ = 0, tried_ = 0;
};

}  // namespace pulson::inference
