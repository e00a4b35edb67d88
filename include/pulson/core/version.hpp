#pragma once

#include <string>

namespace pulson {

/// The project's version, as in "0.1.0".
std::string version();

/// The BLAS in use, as it reports itself: "OpenBLAS 0.3.21 … Haswell MAX_THREADS=64".
std::string blas_version();

}  // namespace pulson
