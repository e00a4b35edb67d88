#pragma once

#include <algorithm>
#include <cmath>

namespace pulson::matching {

/// The damping μ of Levenberg–Marquardt steps (K. Madsen, H. Nielsen and O. Tingleff, Methods for Non-Linear Least
/// Squares Problems, 2004, section 3.2): none until a step is refused; then it falls smoothly with the gain of accepted
/// steps, and grows ever faster while steps are refused. The least μ is for metrics whose largest weights are some 1e8
/// times those of directions that data show.
class Damping {
 public:
  double mu() const { return mu_; }
  bool is_exhausted() const { return mu_ >= kMost; }

  /// @param gain of the cost, as a part of what the model foresaw
  void accept(double gain) {
    mu_ *= std::max(0.1, 1 - std::pow(2 * std::min(gain, 1.0) - 1, 3));
    if (mu_ < kLeast) mu_ = 0;
    growth_ = 2;
  }
  void refuse() {
    mu_ = mu_ > 0 ? mu_ * growth_ : kFirst;
    growth_ *= 2;
  }

 private:
  static constexpr double kFirst = 1e-8, kLeast = 1e-14, kMost = 1e12;
  double mu_ = 0, growth_ = 2;
};

}  // namespace pulson::matching
