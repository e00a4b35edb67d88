#include "random/normals.hpp"

#include <cassert>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson {

Eigen::MatrixXd standard_normals(std::uint64_t seed, std::uint64_t path, int channels, int steps) {
  if (channels < 0 || steps < 0)
    throw InputError(
        fmt::format("normal numbers of {} channels in {} steps; neither may be negative", channels, steps));
  Eigen::MatrixXd normals(channels, steps);
  NormalBatch batch;
  batch.over = NormalBatch::Over::kChannels;
  batch.seed = seed;
  batch.path = path;
  batch.count = static_cast<std::size_t>(channels);
  batch.rows = static_cast<std::size_t>(steps);
  batch.stride = batch.count;
  batch.out = normals.data();
  fill_normals(batch);
  return normals;
}

void fill_standard_normals(std::uint64_t seed, std::uint64_t first_path, std::size_t paths, std::uint32_t block,
                           std::uint32_t channel, double* out) {
  assert(block < 1U << 30U);
  assert(paths == 0 || paths - 1 <= std::numeric_limits<std::uint64_t>::max() - first_path);
  NormalBatch batch;
  batch.seed = seed;
  batch.path = first_path;
  batch.block = block;
  batch.channel = channel;
  batch.count = paths;
  batch.stride = paths;
  batch.out = out;
  fill_normals(batch);
}

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
