#include <vector>

#include <fmt/format.h>
#include <hwy/highway.h>

#include "program.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

std::string compiled_targets() {
  std::vector<std::string> names;
  for (std::int64_t left = HWY_TARGETS; left != 0; left &= left - 1) names.emplace_back(hwy::TargetName(left & -left));
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

std::string build_facts() {
  return fmt::format(
      "pulson {}\n"
      "vector code  {} in use; compiled in: {}\n"
      "compiler     {}, {}\n"
      "threads      {}\n"
      "libraries    {}\n"
      "             {}\n",
      version(), vector_target(), compiled_targets(), PULSON_COMPILER, PULSON_BUILD_TYPE, thread_count(),
      PULSON_LIBRARIES, blas_version());
}

}  // namespace pulson
