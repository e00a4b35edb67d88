// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "landmark_lanes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "landmark_lanes_body.hpp"
// clang-format on

#if HWY_ONCE

#include "landmark_lanes.hpp"

namespace pulson {

HWY_EXPORT(AdvanceLandmarks);

void advance_landmarks(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  HWY_DYNAMIC_DISPATCH(AdvanceLandmarks)(model, batch, first, last);
}

}  // namespace pulson

#endif  // HWY_ONCE
