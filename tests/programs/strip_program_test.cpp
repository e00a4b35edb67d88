// The verb `warp` of pictures along a line: strips of cores, whose landmarks change their order.

#include <algorithm>
#include <cmath>
#include <set>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;

class StripProgram : public Program {
 protected:
  static std::string strip(const std::string& name) {
    return std::string(PULSON_SOURCE_DIR) + "/sample_shapes/" + name + ".png";
  }

  // Of colours in the middle of two strips.
  static double difference(const images::Image& a, int x, const images::Image& b, int y) {
    double most = 0;
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(a.at(x, 32, c) - b.at(y, 32, c)));
    return most;
  }

  static ProgramRun register_cores(const std::string& options) {
    return run(joined({"register", sample("core_source"), sample("core_target"), "-o", "core"},
                      words("--no-picture " + options)));
  }
};

// Where landmarks pass each other the strip folds at them, and half of a band is seen; what lies between the ends of
// the run in reverse, 32 and 36, is below the sheets at both sides of it.
TEST_F(StripProgram, CarriesTheBandsOfLandmarksThatPassEachOther) {
  const ProgramRun matched = register_cores("--noise ch-sd:beta=5%");
  ASSERT_EQ(matched.exit_code, 0) << matched.err;
  EXPECT_THAT(matched.out, HasSubstr("topology   13 pairs of landmarks changed order"));
  const ProgramRun done = run({"warp", "core", strip("core_source"), "--like", strip("core_target"), "-o", "w.png",
                               "--side-by-side", "s.png", "--report", "w.html"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_THAT(done.out, HasSubstr("method     push: the map folds"));
  const images::Image before = images::read_image(strip("core_source")), after = images::read_image("w.png");
  EXPECT_EQ(after.width(), 640);
  EXPECT_EQ(after.height(), 64);
  for (int x = 0; x < 640; ++x)
    for (int y = 1; y < 64; ++y)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(after.at(x, y, c), after.at(x, 0, c)) << x << ", " << y;
  const Points from = formats::read_landmarks(sample("core_source")).points;
  const Points to = formats::read_landmarks(sample("core_target")).points;
  const std::set<Eigen::Index> hidden = {12, 19, 20, 33, 34, 35};
  for (Eigen::Index a = 0; a < from.cols(); ++a) {
    if (hidden.contains(a + 1)) continue;
    const int x = static_cast<int>(std::lround(from(0, a))), there = static_cast<int>(std::lround(to(0, a)));
    double least = 255;
    for (int near = there - 1; near <= there + 1; ++near) least = std::min(least, difference(before, x, after, near));
    EXPECT_LE(least, 30) << "landmark " << a + 1;
  }
}

TEST_F(StripProgram, IsPulledWhereNothingChangesItsOrderAndComesBack) {
  Points sorted = formats::read_landmarks(sample("core_target")).points;
  std::sort(sorted.reshaped().begin(), sorted.reshaped().end());
  std::string csv = "x\n";
  for (const double x : sorted.reshaped()) csv += std::to_string(x) + "\n";
  write("sorted.csv", csv);
  ASSERT_EQ(run({"register", sample("core_source"), "sorted.csv", "-o", "core", "--no-picture"}).exit_code, 0);
  const ProgramRun done = run({"warp", "core", strip("core_source"), "--size", "640x64", "-o", "w.png"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("method     pull: the map is a diffeomorphism"));
  const ProgramRun back = run({"warp", "core", "w.png", "--inverse", "--size", "640x64", "-o", "b.png"});
  EXPECT_EQ(back.exit_code, 0) << back.err;
  const images::Image before = images::read_image(strip("core_source")), after = images::read_image("b.png");
  double sum = 0;
  for (int x = 10; x < 630; ++x) sum += difference(before, x, after, x) / 620;
  EXPECT_LE(sum, 6);  // two linear interpolations blur the edges of the bands
}

TEST_F(StripProgram, NeedsTheLandmarksOnIt) {
  register_cores("--noise ch-sd:beta=5%");
  const ProgramRun done = run({"warp", "core", strip("core_source"), "--pixel-size", "0.1", "-o", "w.png"});
  EXPECT_THAT(done.err, HasSubstr("40 landmarks of"));
}

}  // namespace
}  // namespace pulson
