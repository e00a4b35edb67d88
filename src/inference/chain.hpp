#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/state_bytes.hpp"
#include "reference_weight.hpp"

namespace pulson::inference {

/// A point of the posterior of one specimen in whitened coordinates v = (ζ, ε) of a component of the reference.
struct ChainPoint {
  std::size_t component = 0;
  Eigen::VectorXd v;
  Eigen::VectorXd z;
  Specimen::Shot shot;
  LogWeight weight;
};

struct TrajectoryPoint;

/// Moves of θ in an iteration: each takes one path, and mixes less than a trajectory.
inline constexpr int kThetaMoves = 6;

/// One Markov chain, see sample_posterior(), of the density N(ζ, ε; 0, I) N(φ; φ̂, BBᵀ) w^τ, w the weight relative to
/// the reference: the posterior where the power τ is 1, the reference where it is 0. Its random numbers are a function
/// of seed, number and iteration.
class Chain {
 public:
  /// Begins at draws of the reference.
  Chain(const ChainSetting& setting, int number, double power);

  /// One iteration: each specimen's path, its component, θ; `warmup` is how many iterations adapt. With power 0 an
  /// independent draw.
  void advance(int warmup);

  /// Exchanges points with the chain of the next lower power, with the probability that leaves both densities as they
  /// are. @return that probability
  double exchange(Chain& lower);
  void set_power(double power);

  /// All from which it goes on, but the setting. After read() the next iterations have the bits that they would have
  /// had.
  void write(StateWriter& to) const;
  void read(StateReader& from);

  const ThetaPoint& theta() const { return theta_; }
  const std::vector<ChainPoint>& points() const { return points_; }
  /// log N(φ; 0, I)/N(φ; φ̂, BBᵀ) + Σ log weights
  double log_weight() const;
  double log_likelihood() const;
  double angle() const { return std::exp(log_angle_); }
  double acceptance() const { return moves_ > 0 ? accepted_ / static_cast<double>(moves_) : 0; }
  double parameter_acceptance() const {
    return theta_moves_ > 0 ? theta_accepted_ / static_cast<double>(theta_moves_) : 0;
  }
  std::int64_t evaluations() const { return evaluations_; }
  std::int64_t lost_draws() const { return lost_draws_; }  ///< those without a path, with power 0

 private:
  /// All but the points, for either direction.
  template <class State, class Self>
  static void pass_counts(State& state, Self& chain);
  Eigen::VectorXd normals(std::size_t kind, Eigen::Index count) const;
  double uniform(std::size_t kind) const;
  bool begin_at(ThetaPoint theta, double size);
  void redraw();
  /// Points of another power in the coordinates of this.
  std::vector<ChainPoint> seen_here(const ThetaPoint& theta, const std::vector<ChainPoint>& points) const;
  static double energy(const ChainPoint& at, const Eigen::VectorXd& eta);
  /// A kick of half a step, a rotation by `angle`, and another kick; none without a path. @param passing see draw_of()
  std::optional<TrajectoryPoint> step(std::size_t specimen, const TrajectoryPoint& from, double angle, bool passing);
  void move_path(std::size_t specimen, bool adapting);
  void jump(std::size_t specimen, bool adapting);
  void move_theta(int turn, bool adapting);
  void learn(int warmup);
  std::optional<ChainPoint> point(std::size_t specimen, const ThetaPoint& theta, std::size_t component,
                                  Eigen::VectorXd v, bool passing = false);
  Eigen::VectorXd gradient(std::size_t specimen, const ChainPoint& at) const;

  ChainSetting setting_;
  std::uint64_t number_;
  double power_;
  std::uint64_t iteration_ = 0;
  ThetaPoint theta_;
  std::vector<ChainPoint> points_;
  double log_angle_;
  double log_scale_;         ///< of the moves of φ
  Eigen::VectorXd centre_;   ///< of those that are rotations
  Eigen::MatrixXd root_;     ///< of their covariance
  Eigen::MatrixXd visited_;  ///< φ of the warm-up
  double accepted_ = 0, theta_accepted_ = 0;
  std::int64_t moves_ = 0, theta_moves_ = 0, evaluations_ = 0, lost_draws_ = 0;
  std::int64_t jumps_ = 0, jumped_ = 0;  ///< of the warm-up
};

}  // namespace pulson::inference
