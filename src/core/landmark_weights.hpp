#pragma once

#include <Eigen/Core>

namespace pulson {

/// `weights`, or `count` ones where it is empty.
/// @throws InputError where their number is another or one is negative or not finite
Eigen::VectorXd landmark_weights(const Eigen::VectorXd& weights, Eigen::Index count);

}  // namespace pulson
