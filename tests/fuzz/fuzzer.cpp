// libFuzzer's program. The environment says which target it runs: PULSON_FUZZ_TARGET=tables pulson_fuzz corpus/tables

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "fuzz_targets.hpp"
#include "pulson/core/parallel.hpp"

namespace {

pulson::fuzz::Target find_target() {
  pulson::set_thread_count(1);  // as many fuzzers as cores
  const char* const name = std::getenv("PULSON_FUZZ_TARGET");
  for (const auto& target : pulson::fuzz::kTargets)
    if (name != nullptr && target.name == name) return target.run;
  std::cerr << "the environment's PULSON_FUZZ_TARGET must be one of:";
  for (const auto& target : pulson::fuzz::kTargets) std::cerr << ' ' << target.name;
  std::cerr << '\n';
  std::_Exit(2);
}

}  // namespace

// Its name is libFuzzer's. NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const pulson::fuzz::Target kTarget = find_target();
  return kTarget({reinterpret_cast<const char*>(data), size}) ? 0 : -1;
}
