#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "draw/checks.hpp"
#include "picture_files.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {
namespace {

class PathPictureTest : public PictureTest {
 protected:
  /// Writes the picture, expects two whole files and returns the SVG's text.
  static std::string draw(const PathPicture& picture) {
    write_path_picture(picture, {"paths.png", "paths.svg"});
    return expect_whole_pictures("paths.png", "paths.svg");
  }

  static std::string message_of_failed_write(const PathPicture& picture) {
    std::string message = error_of([&] { write_path_picture(picture, {"paths.png", "paths.svg"}); });
    EXPECT_TRUE(files().empty());
    return message;
  }
};

/// Random walks of n landmarks around a circle, its first coordinate, whose momenta are walks as well.
PathPicture walks(int d, int n, std::size_t paths, int steps) {
  std::mt19937 generator(42);
  std::normal_distribution<double> normal(0, 0.2 / std::sqrt(steps));
  PathPicture picture;
  picture.start.points = Points::Zero(d, n);
  for (int a = 0; a < n; ++a) {
    picture.start.points(0, a) = std::cos(6.28 * a / n);
    if (d > 1) picture.start.points(1, a) = std::sin(6.28 * a / n);
  }
  for (int k = 0; k <= steps; ++k) picture.times.push_back(2.0 * k / steps);
  for (auto* lists : {&picture.positions, &picture.momenta})
    for (std::size_t m = 0; m < paths; ++m) {
      lists->push_back({picture.start.points});
      for (int k = 0; k < steps; ++k) {
        Points next = lists->back().back();
        for (double& value : next.reshaped()) value += normal(generator);
        lists->back().push_back(next);
      }
    }
  picture.title = "walks";
  picture.subtitle = "seed 42";
  return picture;
}

// Panels that stand side by side, of paths or of components, stand one above the other: each at least 200 pixels high.
TEST_F(PathPictureTest, StandsOneAboveTheOtherOnNarrowScreens) {
  for (const auto& [d, n, paths, panels] : {std::tuple(1, 2, 3, 6), std::tuple(1, 2, 9, 2), std::tuple(2, 2, 3, 4),
                                            std::tuple(2, 40, 1, 2), std::tuple(3, 2, 1, 7), std::tuple(3, 40, 3, 4)}) {
    std::string narrow;
    write_path_picture(walks(d, n, static_cast<std::size_t>(paths), 50), {.png = "paths.png", .narrow = &narrow});
    const auto [width, height] = size_of_png(narrow);
    EXPECT_EQ(width, 600);
    EXPECT_GE(height, 200 * panels) << d << "D, N = " << n << ", " << paths << " paths";
  }
}

TEST_F(PathPictureTest, WritesBothFilesInEachDimension) {
  for (const int d : {1, 2, 3})
    for (const int n : {1, 4, 40})
      for (const std::size_t paths : {1, 3, 8}) {
        SCOPED_TRACE(testing::Message() << "d = " << d << ", N = " << n << ", paths = " << paths);
        const std::string svg = draw(walks(d, n, paths, 20));
        EXPECT_TRUE(contains(svg, ">walks<") && contains(svg, ">seed 42<"));
      }
  EXPECT_EQ(files(), (std::set<std::string>{"paths.png", "paths.svg"}));
}

TEST_F(PathPictureTest, NamesLandmarksAxesAndPaths) {
  std::string svg = draw(walks(1, 2, 1, 20));
  EXPECT_TRUE(contains(svg, ">Positions q over time t<") && contains(svg, ">Momenta p over time t<"));
  EXPECT_TRUE(contains(svg, ">q₁, p₁<") && contains(svg, ">q₂, p₂<"));
  EXPECT_TRUE(contains(draw(walks(1, 2, 3, 20)), ">Momenta p over time t, path 3<"));
  EXPECT_TRUE(contains(draw(walks(1, 2, 4, 20)), ">Positions q over time t, path 1 and faintly 3 others<"));
  PathPicture labelled = walks(1, 2, 1, 20);
  labelled.start.labels = {"fast", "slow"};
  EXPECT_TRUE(contains(draw(labelled), ">fast<"));
  EXPECT_TRUE(contains(draw(walks(1, 20, 1, 20)), "landmarks in their order at the start"));
  EXPECT_TRUE(contains(draw(walks(2, 3, 1, 20)), ">Momenta p, component y, over time t<"));
  EXPECT_TRUE(contains(draw(walks(2, 5, 1, 20)), ">momentum, longest 1<"));
  EXPECT_TRUE(contains(draw(walks(2, 5, 7, 20)), ">6 other ends<"));
}

TEST_F(PathPictureTest, LongAndManyPathsStaySmall) {
  draw(walks(1, 2, 2, 60000));
  draw(walks(1, 2, 200, 500));
  draw(walks(2, 60, 1, 5000));
  draw(walks(2, 4, 200, 200));
  draw(walks(3, 4, 200, 200));
}

TEST_F(PathPictureTest, ManyLandmarksStaySmall) {
  EXPECT_TRUE(contains(draw(walks(1, 2000, 3, 100)), "path 1, 250 of 2000 landmarks"));
  EXPECT_TRUE(contains(draw(walks(2, 2000, 20, 30)), "7 of 19 other ends"));
  draw(walks(3, 2000, 10, 30));
  PathPicture scattered = walks(2, 2000, 1, 30);
  for (std::vector<Points>* path : {&scattered.positions[0], &scattered.momenta[0]})
    for (Points& points : *path) points += Points::Random(2, 2000);
  scattered.start.points = scattered.positions[0][0];
  EXPECT_TRUE(contains(draw(scattered), ">Sample path, 500 of 2000 landmarks<"));
}

TEST_F(PathPictureTest, DrawsConstantFarAwayAndHugeValues) {
  for (const int d : {1, 2, 3})
    for (const int n : {2, 5})
      for (const double value : {0.0, -1e300, 1e-300}) {
        SCOPED_TRACE(testing::Message() << "d = " << d << ", N = " << n << ", value = " << value);
        PathPicture picture = walks(d, n, 2, 10);
        for (auto* lists : {&picture.positions, &picture.momenta})
          for (std::vector<Points>& path : *lists)
            for (Points& points : path) points.setConstant(value);
        picture.start.points.setConstant(value);
        draw(picture);
        picture.positions[0].back().setConstant(-value);
        picture.momenta[0].back().setConstant(-value);
        for (double& time : picture.times) time = 1e9 + 1e7 * time;
        draw(picture);
      }
}

TEST_F(PathPictureTest, GrowthOverDecadesHasALogarithmicScale) {
  for (const int d : {1, 2}) {
    PathPicture picture = walks(d, 2, 1, 1000);
    EXPECT_FALSE(contains(draw(picture), "symmetric log scale"));
    for (std::size_t k = 0; k < picture.times.size(); ++k) {
      picture.momenta[0][k].setConstant(std::exp(20 * picture.times[k]));
      picture.momenta[0][k].col(1) *= -0.01;
    }
    const std::string svg = draw(picture);
    EXPECT_TRUE(contains(svg, "over time t, symmetric log scale<"));
    EXPECT_TRUE(contains(svg, ">10¹⁰<") && contains(svg, ">−10¹⁰<") && contains(svg, ">0<"));
  }
}

TEST_F(PathPictureTest, OneEndFarAwayDoesNotShrinkTheOthers) {
  PathPicture picture = walks(2, 5, 30, 20);
  const std::string before = draw(picture);
  picture.positions[7].back().array() += 1e6;
  const std::string svg = draw(picture);
  EXPECT_TRUE(contains(svg, ">29 other ends, 1 of them far outside<"));
  EXPECT_FALSE(contains(svg, "00000<"));
  picture.positions[0].back().array() += 1e6;
  EXPECT_TRUE(contains(draw(picture), ">29 other ends<")) << "the first path is shown whatever it does";
}

TEST_F(PathPictureTest, DrawsGroups) {
  PathPicture picture = walks(2, 40, 5, 20);
  for (int a = 0; a < 40; ++a) picture.start.groups.emplace_back(a < 20 ? "upper" : "lower");
  const std::string svg = draw(picture);
  EXPECT_TRUE(contains(svg, ">upper<") && contains(svg, ">lower<"));
}

TEST_F(PathPictureTest, RefusesValuesThatCannotBeDrawn) {
  PathPicture picture = walks(2, 8, 3, 10);
  picture.positions[1][2](1, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message_of_failed_write(picture), "path picture: point 5 of positions of path 2, entry 3 is not finite");
  picture = walks(2, 8, 3, 10);
  picture.momenta[2][10](0, 0) = -INFINITY;
  EXPECT_EQ(message_of_failed_write(picture), "path picture: point 1 of momenta of path 3, entry 11 is not finite");
  picture.momenta[2][10](0, 0) = 2e300;
  EXPECT_TRUE(contains(message_of_failed_write(picture), "is larger than 1e+300, too large to be drawn"));
  picture = walks(2, 8, 3, 10);
  picture.start.points(0, 7) = NAN;
  EXPECT_EQ(message_of_failed_write(picture), "path picture: point 8 of the start is not finite");
  picture = walks(2, 8, 3, 10);
  picture.times[4] = picture.times[3];
  EXPECT_TRUE(contains(message_of_failed_write(picture), "time 5 is 0.6"));
}

TEST_F(PathPictureTest, RefusesSizesThatDisagree) {
  PathPicture picture = walks(2, 8, 3, 10);
  picture.momenta.pop_back();
  EXPECT_EQ(message_of_failed_write(picture), "path picture: 2 paths of momenta for 3 of positions");
  picture = walks(2, 8, 3, 10);
  picture.positions[2].pop_back();
  EXPECT_TRUE(contains(message_of_failed_write(picture), "11 times for 10 entries of the positions of path 3"));
  picture = walks(2, 8, 3, 10);
  picture.momenta[0][1] = Points::Zero(2, 7);
  EXPECT_EQ(message_of_failed_write(picture), "path picture: momenta of path 1, entry 2 has 7 landmarks, the start 8");
  EXPECT_TRUE(contains(message_of_failed_write(walks(4, 8, 1, 10)), "dimension is 4"));
  EXPECT_EQ(message_of_failed_write(walks(2, 8, 0, 10)), "path picture: there are no paths");
  EXPECT_TRUE(contains(message_of_failed_write(PathPicture{}), "dimension is 0"));
}

TEST_F(PathPictureTest, SaysThatTheFolderIsMissingAndWritesNeither) {
  const PathPicture picture = walks(1, 2, 1, 10);
  EXPECT_THROW(write_path_picture(picture, {"paths.png", "nowhere/paths.svg"}), InputError);
  EXPECT_TRUE(files().empty());
}

TEST(SpreadIndicesTest, KeepsBothEnds) {
  EXPECT_EQ(spread_indices(4, 10), (std::vector<std::size_t>{0, 1, 2, 3}));
  EXPECT_EQ(spread_indices(11, 3), (std::vector<std::size_t>{0, 5, 10}));
  EXPECT_EQ(spread_indices(1000, 2), (std::vector<std::size_t>{0, 999}));
}

TEST(ThinPathsTest, KeepsShortPathsWhole) {
  const PathPicture picture = walks(2, 3, 1, 9);
  const auto kept = thin_paths(picture.positions[0], {0, 2}, picture.times, 10);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0], spread_indices(10, 10));
  EXPECT_EQ(kept[1], kept[0]);
}

/// Least and greatest value of each coordinate in each of some equal pieces of the time, by definition.
std::vector<Points> envelopes(const std::vector<Points>& path, int landmark, const std::vector<double>& times,
                              const std::vector<std::size_t>& indices, int pieces) {
  const Eigen::Index d = path.front().rows();
  std::vector<Points> ranges(pieces, Points(d, 2));
  for (Points& range : ranges) range.col(0).setConstant(INFINITY), range.col(1).setConstant(-INFINITY);
  for (const std::size_t k : indices) {
    const double s = (times[k] - times.front()) / (times.back() - times.front());
    Points& range = ranges[std::min(static_cast<int>(pieces * s), pieces - 1)];
    range.col(0) = range.col(0).cwiseMin(path[k].col(landmark));
    range.col(1) = range.col(1).cwiseMax(path[k].col(landmark));
  }
  return ranges;
}

TEST(ThinPathsTest, KeepsTheEnvelopeOfEveryPiece) {
  for (const int d : {1, 2, 3}) {
    PathPicture picture = walks(d, 3, 1, 5000);
    for (double& time : picture.times) time *= time;  // steps of different length
    const std::vector<Points>& path = picture.positions[0];
    const int pieces = 50, most = 2 * d * pieces + 2;
    const auto kept = thin_paths(path, {2, 0}, picture.times, most);
    ASSERT_EQ(kept.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LE(kept[i].size(), static_cast<std::size_t>(most));
      EXPECT_EQ(kept[i].front(), 0u);
      EXPECT_EQ(kept[i].back(), 5000u);
      EXPECT_TRUE(std::is_sorted(kept[i].begin(), kept[i].end(), std::less_equal<>()));
      const int landmark = i == 0 ? 2 : 0;
      const auto all = envelopes(path, landmark, picture.times, spread_indices(5001, 5001), pieces);
      EXPECT_EQ(envelopes(path, landmark, picture.times, kept[i], pieces), all) << "d = " << d;
    }
  }
}

TEST(ThinPathsTest, LosesNoSpike) {
  std::vector<Points> path(100001, Points::Zero(1, 1));
  std::vector<double> times(path.size());
  for (std::size_t k = 0; k < path.size(); ++k) times[k] = 1e-3 * static_cast<double>(k);
  path[77777](0, 0) = -5;
  const auto kept = thin_paths(path, {0}, times, 100)[0];
  EXPECT_NE(std::find(kept.begin(), kept.end(), 77777u), kept.end());
  EXPECT_LE(kept.size(), 100u);
  EXPECT_LE(thin_paths(path, {0}, times, 2)[0].size(), 4u);
}

TEST(SimplifyLinesTest, KeepsSpikesAndDropsWhatIsStraight) {
  std::vector<Points> lines{Points(2, 1001), Points(2, 1001)};
  for (Points& line : lines) line << Eigen::RowVectorXd::LinSpaced(1001, 0, 1000), Eigen::RowVectorXd::Zero(1001);
  lines[0](1, 300) = 40;
  lines[1].row(1) = lines[1].row(0);
  const std::vector<Points> all = lines;
  simplify_lines(lines, 2002);
  EXPECT_EQ(lines, all) << "few enough";
  simplify_lines(lines, 7);
  EXPECT_EQ(lines[0], all[0](Eigen::all, std::vector<int>{0, 299, 300, 301, 1000}));
  EXPECT_EQ(lines[1], all[1](Eigen::all, std::vector<int>{0, 1000}));
  simplify_lines(lines, 1);
  EXPECT_EQ(lines[0].cols(), 2) << "the ends stay";
}

TEST(SimplifyLinesTest, StaysWithinTheBudgetAndNearTheLine) {
  const PathPicture picture = walks(1, 1, 1, 4000);
  std::vector<Points> lines{Points(2, 4001)};
  for (int k = 0; k <= 4000; ++k) lines[0].col(k) << 0.25 * k, 1000 * picture.positions[0][k](0, 0);
  const Points all = lines[0];
  simplify_lines(lines, 800);
  const Points& line = lines[0];
  EXPECT_LE(line.cols(), 800);
  EXPECT_GT(line.cols(), 700);
  EXPECT_EQ(line.row(1).maxCoeff(), all.row(1).maxCoeff());
  EXPECT_EQ(line.row(1).minCoeff(), all.row(1).minCoeff());
  Eigen::Index i = 0;
  double farthest = 0;
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    while (line(0, i + 1) < all(0, k)) ++i;
    const double s = (all(0, k) - line(0, i)) / (line(0, i + 1) - line(0, i));
    farthest = std::max(farthest, std::abs(all(1, k) - (1 - s) * line(1, i) - s * line(1, i + 1)));
  }
  EXPECT_LT(farthest, 0.1 * (all.row(1).maxCoeff() - all.row(1).minCoeff()));
}

}  // namespace
}  // namespace pulson::draw
