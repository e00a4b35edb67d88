#pragma once

#include <vector>

#include <Eigen/Core>

namespace pulson::cohort {

/// Anderson's acceleration of x ← x − F(x), which solves F(x) = 0 where F is close to the identity plus a constant
/// (D. Anderson 1965; type II of H. Fang and Y. Saad, "Two classes of multisecant methods", 2009): with the last
/// differences ΔX and ΔF,
///
///     x⁺ = x − F − (ΔX − ΔF)γ,   γ = argmin |F − ΔFγ|.
///
/// Without a line search: where |F| grows tenfold, or is not finite, the search returns to the best x with a shorter
/// step.
class Anderson {
 public:
  explicit Anderson(int window) : window_(window) {}

  /// The next x, where F at `x` is `f`.
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& f);

  const Eigen::VectorXd& best() const { return best_x_; }
  double best_size() const { return best_size_; }  ///< largest |F_i| there
  int since_best() const { return since_best_; }   ///< calls since |F| last fell
  bool is_lost() const { return damping_ < 1e-3; }

 private:
  Eigen::VectorXd retreat();

  int window_;
  std::vector<Eigen::VectorXd> x_changes_, f_changes_;
  Eigen::VectorXd x_, f_, best_x_, best_f_;
  double best_size_ = 0;
  double damping_ = 1;
  int since_best_ = 0;
};

}  // namespace pulson::cohort
