// Brownian increments, and the same path on a coarser grid.

#include "pulson/random/brownian.hpp"

#include <cmath>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"
#include "random/normals.hpp"

namespace pulson {
namespace {

using testing::ThrowsMessage;

constexpr std::uint64_t kPathSeed = 0xA5A5A5A500000007U;

TEST(BrownianIncrements, AreScaledNormals) {
  const TimeGrid grid{.time = 2, .steps = 7};
  const Eigen::MatrixXd increments = brownian_increments(kPathSeed, 9, 5, grid);
  EXPECT_EQ(increments, std::sqrt(grid.dt()) * standard_normals(kPathSeed, 9, 5, 7));
}

TEST(BrownianIncrements, HaveVarianceOfTheStep) {
  const TimeGrid grid{.time = 3, .steps = 1000};
  const Eigen::MatrixXd increments = brownian_increments(kPathSeed, 0, 1000, grid);
  const auto n = static_cast<double>(increments.size());
  EXPECT_NEAR(increments.squaredNorm() / n, grid.dt(), 5 * grid.dt() * std::sqrt(2 / n));
  const Eigen::VectorXd end = increments.rowwise().sum();
  EXPECT_NEAR(end.squaredNorm() / 1000, grid.time, 5 * grid.time * std::sqrt(2.0 / 1000));
}

TEST(Coarsened, SumsNeighbours) {
  const Eigen::MatrixXd fine = brownian_increments(kPathSeed, 1, 3, {.time = 1, .steps = 12});
  EXPECT_EQ(coarsened(fine, 1), fine);
  for (const int ratio : {2, 3, 4, 6, 12}) {
    const Eigen::MatrixXd coarse = coarsened(fine, ratio);
    ASSERT_EQ(coarse.cols(), 12 / ratio);
    for (Eigen::Index k = 0; k < coarse.cols(); ++k)
      for (Eigen::Index c = 0; c < 3; ++c) {
        double sum = fine(c, k * ratio);
        for (int i = 1; i < ratio; ++i) sum += fine(c, k * ratio + i);
        EXPECT_EQ(coarse(c, k), sum) << "ratio " << ratio << ", step " << k;
      }
  }
}

// On every time of the coarser grid the two paths are at the same position, and its steps have the variance of a
// grid's.
TEST(Coarsened, IsTheSamePathOnTheCoarserGrid) {
  const TimeGrid fine_grid{.time = 2, .steps = 400};
  const TimeGrid coarse_grid{.time = 2, .steps = 100};
  const Eigen::MatrixXd fine = brownian_increments(kPathSeed, 2, 500, fine_grid);
  const Eigen::MatrixXd coarse = coarsened(fine, 4);
  Eigen::VectorXd fine_place = Eigen::VectorXd::Zero(500), coarse_place = fine_place;
  for (int k = 0; k < coarse_grid.steps; ++k) {
    for (int i = 0; i < 4; ++i) fine_place += fine.col(4 * k + i);
    coarse_place += coarse.col(k);
    EXPECT_LE((coarse_place - fine_place).cwiseAbs().maxCoeff(), 1e-13);
  }
  const auto n = static_cast<double>(coarse.size());
  EXPECT_NEAR(coarse.squaredNorm() / n, coarse_grid.dt(), 5 * coarse_grid.dt() * std::sqrt(2 / n));
}

TEST(Coarsened, OfNothingIsNothing) {
  EXPECT_EQ(coarsened(Eigen::MatrixXd(3, 0), 2).cols(), 0);
  EXPECT_EQ(coarsened(Eigen::MatrixXd(0, 4), 2).cols(), 2);
}

TEST(Coarsened, SaysWhatIsWrong) {
  EXPECT_THAT([] { coarsened(Eigen::MatrixXd::Zero(2, 10), 3); },
              ThrowsMessage<InputError>(
                  "coarser grid: 10 steps cannot be joined by 3; the number of steps must be a multiple"));
  for (const int ratio : {0, -2})
    EXPECT_THAT([ratio] { coarsened(Eigen::MatrixXd::Zero(2, 10), ratio); },
                ThrowsMessage<InputError>("coarser grid: the ratio of steps is " + std::to_string(ratio) +
                                          "; it must be at least 1"));
}

}  // namespace
}  // namespace pulson
