#pragma once

#include <Eigen/Core>

namespace pulson {

/// How Eigen allocates its matrices, which -mavx, -march=native and -fsanitize=address change. Declared for every
/// layout but defined only for the one pulson was compiled with: a program that would free memory differently from how
/// pulson allocated it does not link. Compile it with the same of these options.
template <int alignment, bool by_malloc>
int eigen_layout();

inline const int kEigenLayout = eigen_layout<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED != 0>();

}  // namespace pulson
