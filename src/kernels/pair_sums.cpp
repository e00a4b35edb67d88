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

std::string vector_target() { return hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()); }

}  // namespace pulson

#endif  // HWY_ONCE
