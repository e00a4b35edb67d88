#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// k, k' and k'' at several s; empty from the order on that was not asked for.
struct ProfileValues {
  Eigen::ArrayXd value;
  Eigen::ArrayXd first;
  Eigen::ArrayXd second;
};

/// A radial profile of one's own: k(s) of s = r²/α², with k(0) = 1, and its derivatives by s, so that
///
///     K = k,   ∇K = 2k'/α² z,   ∇²K = 2k'/α² I + 4k''/α⁴ z zᵀ.
///
/// K must be positive definite in the space of the landmarks. Thread-safe.
class OwnProfile {
 public:
  virtual ~OwnProfile() = default;

  /// Where s = 0 the derivatives may be any numbers: they meet z = 0. @param s not negative @param order 0, 1 or 2
  virtual ProfileValues at(const Eigen::ArrayXd& s, int order) const = 0;

  /// sup |dk/dr| for α = 1, which bounds time steps.
  virtual double lipschitz() const = 0;
};

/// While the profile lives, make_kernel() knows it by this name: `NAME:alpha=0.4`, alone and in sums. Its sums are
/// plain loops, with one call of at() for many pairs. A name that is given again means the new profile.
/// @throws InputError where the name is that of a row of kernel_table(), or other than letters, digits, '_' and '-'
KernelProfile name_kernel(const std::string& name, const std::shared_ptr<const OwnProfile>& profile);

/// The profiles of one's own in a kernel: whoever keeps them keeps it usable.
std::vector<std::shared_ptr<const OwnProfile>> own_profiles(const KernelOperator& kernel);

}  // namespace pulson
