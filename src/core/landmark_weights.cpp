#include "landmark_weights.hpp"

#include <cmath>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {

Eigen::VectorXd landmark_weights(const Eigen::VectorXd& weights, Eigen::Index count) {
  if (weights.size() == 0) return Eigen::VectorXd::Ones(count);
  if (weights.size() != count)
    throw InputError(fmt::format("there are {} weights for {} landmarks", weights.size(), count));
  for (Eigen::Index a = 0; a < count; ++a)
    if (!(std::isfinite(weights[a]) && weights[a] >= 0))
      throw InputError(
          fmt::format("the weight of landmark {} is {}; it must be a finite number, 0 or greater", a + 1, weights[a]));
  return weights;
}

}  // namespace pulson
