// The paths of LaneShots and their slopes as vector code. Included once per vector target, so its guard toggles with
// the target.
#if defined(PULSON_LANE_SHOTS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_SHOTS_BODY
#undef PULSON_LANE_SHOTS_BODY
#else
#define PULSON_LANE_SHOTS_BODY
#endif

#include <hwy/highway.h>

#include "lane_bumps_body.hpp"
#include "lane_heun_body.hpp"
#include "lane_pairs_body.hpp"
#include "lane_shooter_body.hpp"
#include "lane_variational_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

void ShootLanes(const LaneShotArguments& arguments) {
  switch (arguments.dimension) {
    case 1:
      return LaneShooter<1>(arguments).Run();
    case 2:
      return LaneShooter<2>(arguments).Run();
    default:
      return LaneShooter<3>(arguments).Run();
  }
}

std::size_t ShotLaneCount() { return hn::Lanes(Tag()); }

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_SHOTS_BODY
