// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pair_sums.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include <hwy/targets.h>
#include "pair_sums_body.hpp"
// clang-format on

#if HWY_ONCE

#include "pair_sums.hpp"

namespace pulson {

HWY_EXPORT(AddPairSums);
HWY_EXPORT(LaneCount);

void add_pair_sums(const PairSumArguments& arguments, std::size_t first) {
  HWY_DYNAMIC_DISPATCH(AddPairSums)(arguments, first);
}

std::size_t vector_lanes() { return HWY_DYNAMIC_DISPATCH(LaneCount)(); }

std::string vector_target() {
  vector_lanes();  // the first dispatch chooses the target
  const auto chosen = static_cast<std::uint32_t>(hwy::SupportedTargets()) & HWY_TARGETS;
  return hwy::TargetName(static_cast<std::uint32_t>(chosen & (~chosen + 1)));
}

}  // namespace pulson

#endif  // HWY_ONCE
