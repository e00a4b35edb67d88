#include "core/secants.hpp"

#include <Eigen/QR>

#include "core/columns.hpp"

namespace pulson {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd Secants::next(const VectorXd& x, const VectorXd& f) {
  if (x_.size() > 0) {
    x_changes_.emplace_back(x - x_);
    f_changes_.emplace_back(f - f_);
    if (x_changes_.size() > window_) {
      x_changes_.erase(x_changes_.begin());
      f_changes_.erase(f_changes_.begin());
    }
  }
  x_ = x;
  f_ = f;
  if (!any()) return x - f;
  const MatrixXd f_changes = columns_of(f_changes_);
  const VectorXd gamma = f_changes.colPivHouseholderQr().solve(f);
  return x - f - (columns_of(x_changes_) - f_changes) * gamma;
}

void Secants::forget() {
  x_changes_.clear();
  f_changes_.clear();
  x_.resize(0);
}

}  // namespace pulson
