#include "pulson/random/brownian.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "random/normals.hpp"

namespace pulson {

Eigen::MatrixXd brownian_increments(std::uint64_t seed, std::uint64_t path, int channels, const TimeGrid& grid) {
  return std::sqrt(grid.dt()) * standard_normals(seed, path, channels, grid.steps);
}

Eigen::MatrixXd coarsened(const Eigen::MatrixXd& increments, int ratio) {
  if (ratio < 1) throw InputError(fmt::format("coarser grid: the ratio of steps is {}; it must be at least 1", ratio));
  if (increments.cols() % ratio != 0)
    throw InputError(
        fmt::format("coarser grid: {} steps cannot be joined by {}; the number of steps must be a multiple",
                    increments.cols(), ratio));
  Eigen::MatrixXd coarse = Eigen::MatrixXd::Zero(increments.rows(), increments.cols() / ratio);
  for (Eigen::Index k = 0; k < increments.cols(); ++k) coarse.col(k / ratio) += increments.col(k);
  return coarse;
}

}  // namespace pulson
