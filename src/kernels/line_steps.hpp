#pragma once

#include <array>
#include <utility>
#include <vector>

#include "line_covariance.hpp"
#include "line_state.hpp"

namespace pulson {

/// Sums over pairs, and solutions, of landmarks on a line in the n steps of a path at once, each step with an order of
/// its own: the sweeps of line_sums() and LineCovariance, with the distances and what they decay to kept, eight steps
/// abreast. Weights and sums are n of 1×N, one of each step.
class LineSteps {
 public:
  /// @param term of all @param steps K + R of each
  LineSteps(const KernelTerm& term, const std::vector<const LineCovariance*>& steps);

  std::vector<Points> value(const std::vector<Points>& weights) const;  ///< Σ_b K(x_a − x_b) w_b
  std::vector<Points> slope(const std::vector<Points>& weights) const;  ///< Σ_b K'(x_a − x_b) w_b, with K'(0) := 0

  /// slope() and Σ_b K''(x_a − x_b) w_b; of the peakon without what is at r = 0.
  std::pair<std::vector<Points>, std::vector<Points>> slope_and_second(const std::vector<Points>& weights) const;

  /// (K + R)⁻¹v
  std::vector<Points> solve(const std::vector<Points>& v) const;

 private:
  // A number of each landmark, from left to right, in each of eight steps; where there are fewer, the last again.
  using Lanes = Eigen::Matrix<double, kLineLanes, Eigen::Dynamic>;
  struct Block {
    std::vector<Eigen::Index> order;  // landmarks, of each place those of all lanes
    Lanes gaps, decays;               // before each
    Lanes variances;                  // of innovations
    std::array<Lanes, 3> gains;       // of the filter
  };
  struct Sums;

  int count_of(std::size_t block) const;
  Lanes gathered(std::size_t block, const std::vector<Points>& values) const;
  void scatter(std::size_t block, const Lanes& from, std::vector<Points>& to) const;
  template <class Profile, bool kValue, bool kSecond>
  Sums swept(const Block& block, const Lanes& weights) const;
  template <bool kValue, bool kSecond>
  std::pair<std::vector<Points>, std::vector<Points>> sums(const std::vector<Points>& weights) const;
  template <int S>
  void solve_lanes(const Block& block, Lanes& v) const;

  KernelTerm term_;
  int steps_;
  Eigen::Index landmarks_;
  std::vector<Block> blocks_;
};

}  // namespace pulson
