#pragma once

#include <Eigen/Core>

namespace pulson {

/// How Eigen allocates its matrices, which -mavx, -march=native and -fsanitize=address change. Declared for every way
/// and defined for pulson's own alone: a program that would free in one way what pulson allocated in another is not
/// linked. Compile it with the same of these options.
template <int alignment, bool by_malloc>
int eigen_layout();

inline const int kEigenLayout = eigen_layout<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED != 0>();

}  // namespace pulson
