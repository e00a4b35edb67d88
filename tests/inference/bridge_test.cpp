// Bridge sampling of the ratio of two normalising constants, and where it has nothing to say.

#include <cmath>

#include <gtest/gtest.h>

#include "inference/evidence.hpp"
#include "random/normals.hpp"

namespace pulson::inference {
namespace {

using Eigen::VectorXd;

// Of N(apart·e, I) relative to 5 N(0, I) in as many dimensions as e has, from draws of both.
Estimate ratio_of_normals(double apart, int dimensions) {
  constexpr int kDraws = 2000;
  const auto log_weights = [&](std::uint64_t seed, double mean) {
    const Eigen::MatrixXd x = standard_normals(seed, 0, dimensions, kDraws).array() + mean;
    const VectorXd along = x.colwise().sum().transpose();
    return VectorXd(apart * along.array() - 0.5 * apart * apart * dimensions - std::log(5));
  };
  return bridge(log_weights(1, apart), log_weights(2, 0), VectorXd::Ones(kDraws),
                [](const VectorXd& values) { return static_cast<double>(values.size()); });
}

TEST(Bridge, IsTheRatioWhereTheLawsShareDraws) {
  for (const double apart : {0.0, 0.5, 1.0}) {
    const Estimate found = ratio_of_normals(apart, 3);
    EXPECT_NEAR(found.value, -std::log(5), 4 * found.standard_error + 1e-12) << apart;
    EXPECT_LT(found.standard_error, 0.05) << apart;
  }
}

TEST(Bridge, IsUndeterminedWhereNoDrawComesToTheOther) {
  const Estimate found = ratio_of_normals(1, 200);
  EXPECT_TRUE(std::isnan(found.value));
  EXPECT_TRUE(std::isnan(found.standard_error));
}

}  // namespace
}  // namespace pulson::inference
