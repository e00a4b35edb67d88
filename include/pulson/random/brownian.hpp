#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "pulson/core/time_grid.hpp"

namespace pulson {

/// Increments ΔW of independent Brownian motions over the steps of a grid: √Δt times standard_normals(seed, path).
///
/// The numbers belong to the steps and not to the times: on another grid the same path number is another path. The same
/// path on two grids is brownian_increments on the finer and coarsened() of that on the coarser.
/// @return channels×K
Eigen::MatrixXd brownian_increments(std::uint64_t seed, std::uint64_t path, int channels, const TimeGrid& grid);

/// The same Brownian path on the grid whose steps are `ratio` times longer: column k is the sum of the columns
/// k·ratio … (k + 1)·ratio − 1, in this order.
/// @param increments C×K @return C×(K/ratio) @throws InputError if ratio is below 1 or K no multiple of it
Eigen::MatrixXd coarsened(const Eigen::MatrixXd& increments, int ratio);

}  // namespace pulson
