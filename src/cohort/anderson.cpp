#include "anderson.hpp"

#include <limits>

namespace pulson::cohort {

using Eigen::VectorXd;

namespace {

constexpr double kGrowth = 10;
constexpr double kShorter = 0.3;

}  // namespace

VectorXd Anderson::retreat() {
  damping_ *= kShorter;
  secants_.forget();
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
  VectorXd next = secants_.next(x, f);
  return secants_.any() ? next : VectorXd(x - damping_ * f);
}

}  // namespace pulson::cohort
