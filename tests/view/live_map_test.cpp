#include "view/live_map.hpp"

#include <cstdint>
#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "error_of.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::view {
namespace {

using testing::ElementsAre;

const Points kSource{{10, 90, 90, 10, 50, 70}, {10, 10, 70, 70, 40, 20}};

TEST(LiveMap, OfASimilarityMovesTheWholeGridByIt) {
  const Points target = (1.5 * kSource).colwise() + Eigen::Vector2d(20, -5);
  const LiveMapOptions options{.columns = 5, .rows = 4};
  const LiveMap map = live_map(kSource, target, 100, 80, options);
  EXPECT_EQ(map.times.front(), 0);
  EXPECT_EQ(map.times.back(), 1);
  // The first node is the picture's corner, half a pixel before the centre of its first pixel; the last the other one.
  EXPECT_LT((map.frames.back().col(0) - Eigen::Vector2d(1.5 * -0.5 + 20, 1.5 * -0.5 - 5)).norm(), 1e-6);
  EXPECT_LT((map.frames.back().col(19) - Eigen::Vector2d(1.5 * 99.5 + 20, 1.5 * 79.5 - 5)).norm(), 1e-6);
  EXPECT_LT((map.jacobians.array() - 1).abs().maxCoeff(), 1e-6);
  EXPECT_EQ(map.folded_fraction, 0);
}

TEST(LiveMap, BringsLandmarksOntoThoseOfTheOtherPicture) {
  Points target = kSource;
  target.col(4) += Eigen::Vector2d(8, 5);
  target.col(2).setConstant(std::nan(""));
  const LiveMap map = live_map(kSource, target, 100, 80, {});
  EXPECT_THAT(map.landmarks, ElementsAre(0, 1, 3, 4, 5));
  EXPECT_LT(map.rms, 1);
  EXPECT_LT((map.paths.back().col(3) - target.col(4)).norm(), 1);
}

TEST(LiveMap, NeedsThreeLandmarks) {
  Points target = kSource;
  target.rightCols(4).setConstant(std::nan(""));
  EXPECT_EQ(error_of([&] { live_map(kSource, target, 100, 80, {}); }),
            "2 of the landmarks are on both pictures; a match needs 3");
}

// Of small displacements the match is linear, so both models agree to second order in them.
TEST(LiveMap, OfSmallDisplacementsIsNearlyTheLinearModel) {
  double before = 0;
  for (const double part : {1.0, 0.25}) {
    Points target = kSource;
    target.col(4) += part * Eigen::Vector2d(4, 3);
    const LiveMap map = live_map(kSource, target, 100, 80, {});
    const LiveMap linear = linear_map(kSource, target, 100, 80, {}, map.kernel, map.ridge);
    const double apart = (map.frames.back() - linear.frames.back()).colwise().norm().maxCoeff();
    EXPECT_LT(apart, 0.15 * part * 5);
    if (before > 0) {
      EXPECT_LT(apart, before / 4);
    }
    before = apart;
    EXPECT_LT((map.jacobians - linear.jacobians).cwiseAbs().mean(), 0.05);
  }
}

// What the match with the same kernel and λ from rest ends at.
matching::Registration match_as(const NearMatch& near, const Points& source, const Points& target) {
  Landmarks from, to;
  from.points = source;
  to.points = target;
  from.frame.y_down = to.frame.y_down = true;
  matching::RegistrationOptions options;
  options.noise = near.noise;
  options.kernel = near.kernel;
  options.lambda = near.lambda;
  return matching::register_shapes(from, to, options);
}

TEST(LiveMap, FollowsAMatchToWhereOneFromRestEnds) {
  for (const char* noise : {"none", "ch-sd:beta=5%"}) {
    const LiveMapOptions options{.noise = noise};
    Points source = kSource, target = kSource;
    target.col(4) += Eigen::Vector2d(8, 5);
    NearMatch near = live_map(source, target, 100, 80, options).near;
    // Two moves, of which the second follows a followed match: one of the right picture and one of the left.
    for (const bool moves_left : {false, true}) {
      (moves_left ? source : target).col(3) += Eigen::Vector2d(-6, 4);
      ASSERT_TRUE(can_follow(near, source, target, options));
      const LiveMap map = followed_map(source, target, 100, 80, options, near);
      const matching::Registration registration = match_as(near, source, target);
      EXPECT_TRUE(map.is_followed && map.converged);
      // Both searches end within their tolerance of 1e-3 of the cost; σ is half a per cent of the diameter, 0.5 pixels.
      EXPECT_LT((map.paths.back() - registration.result).cwiseAbs().maxCoeff(), 0.02) << noise << moves_left;
      EXPECT_NEAR(map.rms, registration.rms(), 0.01);
      const Points& before = moves_left ? near.path.front() : near.path.back();
      EXPECT_GT(((moves_left ? map.paths.front() : map.paths.back()) - before).cwiseAbs().maxCoeff(), 1) << "it moved";
      near = map.near;
    }
  }
}

TEST(LiveMap, FollowsNoMatchOfOtherLandmarksOrNoise) {
  const NearMatch near = live_map(kSource, kSource, 100, 80, {}).near;
  EXPECT_TRUE(can_follow(near, kSource, kSource, {}));
  EXPECT_FALSE(can_follow(near, kSource, kSource, {.noise = "ch-sd:beta=5%"}));
  Points fewer = kSource;
  fewer.col(2).setConstant(std::nan(""));
  EXPECT_FALSE(can_follow(near, kSource, fewer, {}));
  EXPECT_FALSE(can_follow({}, kSource, kSource, {}));
}

TEST(LiveMap, EndsWhereItIsNoLongerWanted) {
  Points target = kSource;
  target.col(4) += Eigen::Vector2d(8, 5);
  int asked = 0;
  EXPECT_THROW(live_map(kSource, target, 100, 80, {}, [&] { return ++asked > 1; }), Superseded);
  EXPECT_GT(asked, 1);
}

TEST(LiveMap, BytesAreAHeadAndNumbers) {
  const LiveMapOptions options{.columns = 3, .rows = 2, .frames = 2};
  const LiveMap map = live_map(kSource, kSource, 100, 80, options);
  const std::string bytes = bytes_of(map, options);
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data(), 4);
  EXPECT_EQ(length % 4, 0U);
  const nlohmann::json head = nlohmann::json::parse(bytes.substr(4, length));
  EXPECT_EQ(head["columns"], 3);
  const std::size_t times = head["times"].size();
  EXPECT_EQ(bytes.size(), 4 + length + 4 * (times * 2 * 6 + times * 2 * 6 + 6));
  float first = 0;
  std::memcpy(&first, bytes.data() + 4 + length, 4);
  EXPECT_FLOAT_EQ(first, static_cast<float>(map.frames[0](0, 0)));
}

}  // namespace
}  // namespace pulson::view
