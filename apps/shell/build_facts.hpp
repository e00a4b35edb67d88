#pragma once

#include <string>

namespace pulson {

/// What `--version` prints: "pulson 0.1.0", then vector code, compiler, threads and libraries, a line each.
std::string build_facts();

}  // namespace pulson
