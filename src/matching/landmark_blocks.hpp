#pragma once

#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson::matching {

/// A small matrix for each landmark, d×d: the columns of d²×N numbers, each in column-major order.
using LandmarkBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

inline LandmarkBlock block(const Eigen::MatrixXd& blocks, Eigen::Index a, Eigen::Index d) {
  return blocks.col(a).reshaped(d, d);
}

/// The symmetric R with R² = m but for what is negative. @param m symmetric, at most 3×3
LandmarkBlock symmetric_root(const Eigen::MatrixXd& m);

/// B_a v_a, or B_aᵀ v_a.
Points by_blocks(const Eigen::MatrixXd& blocks, const Points& v, bool transposed);

/// (I + ½Δt G_a)v_a, or the same of G_aᵀ.
Points half_step(const Eigen::MatrixXd& gradients, double dt, const Points& v, bool transposed);

/// (I − ½Δt G_a)⁻¹.
Eigen::MatrixXd half_step_inverses(const Eigen::MatrixXd& gradients, double dt, Eigen::Index d);

}  // namespace pulson::matching
