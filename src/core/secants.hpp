#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace pulson {

/// Anderson's acceleration of x ← x − F(x), which solves F(x) = 0 where F is close to the identity plus a constant
/// (D. Anderson 1965; type II of H. Fang and Y. Saad, "Two classes of multisecant methods", 2009): with the last
/// differences ΔX and ΔF,
///
///     x⁺ = x − F − (ΔX − ΔF)γ,   γ = argmin |F − ΔFγ|.
class Secants {
 public:
  /// @param window how many differences are kept
  explicit Secants(std::size_t window) : window_(window) {}

  /// x⁺, where F at `x` is `f`; x − f where no other place is known.
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& f);

  /// Whether next() has a difference to go by.
  bool any() const { return !x_changes_.empty(); }
  void forget();

 private:
  std::size_t window_;
  std::vector<Eigen::VectorXd> x_changes_, f_changes_;
  Eigen::VectorXd x_, f_;  // of the last call
};

}  // namespace pulson
