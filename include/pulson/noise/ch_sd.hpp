#pragma once

#include <vector>

#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// Canonical Hamiltonian stochastic deformation with constant coefficients, §5.1-5.2 of the paper: one channel per
/// chosen landmark a and axis j with the potential h = β p_a^j, so dq_a^j = … + β dW. Additive, and not diffeomorphic:
/// it lets landmarks pass through each other. β is in length units per square root of time. Channel order: axis
/// fastest.
class ChSd final : public NoiseModel {
 public:
  /// @param on landmarks that noise acts on, counted from 0 and increasing; empty for all
  ChSd(double beta, std::vector<int> on) : beta_(beta), on_(std::move(on)) {}

  std::string spec() const override;
  int channels(int dimension, int count) const override;
  bool diffeomorphic() const override { return false; }
  Points position_noise(const PhaseState& state, const Eigen::VectorXd& increments) const override;
  Eigen::VectorXd position_noise_transposed(const PhaseState& state, const Points& q_bar) const override;
  void check(int dimension, int count) const override;

 private:
  double beta_;
  std::vector<int> on_;
};

/// No noise: no channels.
class NoNoise final : public NoiseModel {
 public:
  std::string spec() const override { return "none"; }
  int channels(int /*dimension*/, int /*count*/) const override { return 0; }
  bool diffeomorphic() const override { return true; }
  Points position_noise(const PhaseState& state, const Eigen::VectorXd& increments) const override;
  Eigen::VectorXd position_noise_transposed(const PhaseState& state, const Points& q_bar) const override;
  void check(int /*dimension*/, int /*count*/) const override {}
};

}  // namespace pulson
