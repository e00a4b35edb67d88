#include "anderson.hpp"

#include <Eigen/QR>

namespace pulson::cohort {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kGrowth = 10;
constexpr double kShorter = 0.3;

MatrixXd as_columns(const std::vector<VectorXd>& vectors) {
  MatrixXd matrix(vectors.front().size(), static_cast<Index>(vectors.size()));
  for (std::size_t j = 0; j < vectors.size(); ++j) matrix.col(static_cast<Index>(j)) = vectors[j];
  return matrix;
}

}  // namespace

VectorXd Anderson::retreat() {
  damping_ *= kShorter;
  x_changes_.clear();
  f_changes_.clear();
  x_.resize(0);
  return best_x_ - damping_ * best_f_;
}

VectorXd Anderson::next(const VectorXd& x, const VectorXd& f) {
  const double size = f.allFinite() ? f.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
  const bool first = best_x_.size() == 0;
  ++since_best_;
  if (first || size < best_size_) {
    best_x_ = x;
    best_f_ = f;
    best_size_ = size;
    since_best_ = 0;
  } else if (!(size < kGrowth * best_size_)) {
    return retreat();
  }
  if (x_.size() > 0) {
    x_changes_.emplace_back(x - x_);
    f_changes_.emplace_back(f - f_);
    if (static_cast<int>(x_changes_.size()) > window_) {
      x_changes_.erase(x_changes_.begin());
      f_changes_.erase(f_changes_.begin());
    }
  }
  x_ = x;
  f_ = f;
  if (x_changes_.empty()) return x - damping_ * f;
  const MatrixXd f_changes = as_columns(f_changes_);
  const VectorXd gamma = f_changes.colPivHouseholderQr().solve(f);
  return x - f - (as_columns(x_changes_) - f_changes) * gamma;
}

}  // namespace pulson::cohort
