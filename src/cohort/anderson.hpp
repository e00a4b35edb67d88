#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "core/secants.hpp"

namespace pulson::cohort {

/// Anderson's acceleration, see Secants, without a line search: where |F| grows tenfold, or is not finite, the search
/// returns to the best x with a shorter step.
class Anderson {
 public:
  explicit Anderson(std::size_t window) : secants_(window) {}

  /// The next x, where F at `x` is `f`.
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& f);

  const Eigen::VectorXd& best() const { return best_x_; }
  double best_size() const { return best_size_; }  ///< largest |F_i| there
  int since_best() const { return since_best_; }   ///< calls since |F| last fell
  bool is_lost() const { return damping_ < 1e-3; }

 private:
  Eigen::VectorXd retreat();

  Secants secants_;
  Eigen::VectorXd best_x_, best_f_;
  double best_size_ = 0;
  double damping_ = 1;
  int since_best_ = 0;
};

}  // namespace pulson::cohort
