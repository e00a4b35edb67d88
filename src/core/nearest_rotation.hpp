#pragma once

#include <Eigen/Core>

namespace pulson {

/// d×d, d up to 3, without the heap.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

/// The orthogonal Q of least |Qx − y|² (W. Kabsch 1976): of greatest tr(QᵀC), C = yxᵀ of two centred shapes.
/// @param reflection below which least singular value a reflection is not taken: infinite for a rotation
SmallMatrix nearest_orthogonal(const SmallMatrix& products, double reflection);

}  // namespace pulson
