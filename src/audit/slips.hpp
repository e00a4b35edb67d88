#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace pulson::audit {

/// What may have been meant by a landmark that was typed wrongly.
struct Slip {
  Eigen::VectorXd meant;  ///< d
  double log_stretch;     ///< minus the logarithm of the factor by which a coordinate has to be multiplied
  std::string text;       ///< "x is 10 times too large"
};

/// A factor of ten, a sign or two coordinates in each other's place.
std::vector<Slip> slips_of(const Eigen::VectorXd& here);

}  // namespace pulson::audit
