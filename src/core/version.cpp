#include "pulson/core/version.hpp"

namespace pulson {

std::string version() { return PULSON_VERSION; }

}  // namespace pulson
