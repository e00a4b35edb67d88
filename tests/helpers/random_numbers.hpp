#pragma once

#include <random>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Numbers from −1 to 1, always the same.
class Numbers {
 public:
  explicit Numbers(unsigned seed) : engine_(seed) {}
  double operator()() { return std::uniform_real_distribution<double>(-1, 1)(engine_); }
  Eigen::MatrixXd operator()(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [this](Eigen::Index, Eigen::Index) { return (*this)(); });
  }
  /// Landmarks that are at least 0.4 apart along the first axis.
  Points landmarks(int d, int n) {
    Points q = (*this)(d, n);
    for (int a = 0; a < n; ++a) q(0, a) = 0.6 * a + 0.1 * q(0, a);
    return q;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace pulson
