#include "pulson/core/version.hpp"

#include <cblas.h>

namespace pulson {

std::string version() { return PULSON_VERSION; }

std::string blas_version() { return openblas_get_config(); }

}  // namespace pulson
