// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pair_lanes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "pair_lanes_body.hpp"
// clang-format on

#if HWY_ONCE

#include "pair_lanes.hpp"

namespace pulson {

HWY_EXPORT(AdvancePair);

void advance_pair(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last) {
  HWY_DYNAMIC_DISPATCH(AdvancePair)(model, batch, first, last);
}

}  // namespace pulson

#endif  // HWY_ONCE
