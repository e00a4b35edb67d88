// Errors of digitising that were planted are measured; sessions without a bias have a uniform p.

#include "audit/repeats.hpp"

#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"

namespace pulson::audit {
namespace {

constexpr int kLandmarks = 10;

struct Digitised {
  std::vector<Landmarks> shapes;
  std::vector<std::string> specimens;
};

/// Specimens of random poses, each digitised twice: landmark a with errors of 0.01(1 + a) on x and half that on y in
/// the pose of the mean, and the second time `bias` further up.
Digitised digitised(int specimens, unsigned seed, double bias) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Points mean = 5 * Points::NullaryExpr(2, kLandmarks, [&] { return normal(random); });
  Digitised all;
  for (int i = 0; i < specimens; ++i) {
    const Points own = mean + 0.3 * Points::NullaryExpr(2, kLandmarks, [&] { return normal(random); });
    for (int session = 0; session < 2; ++session) {
      Landmarks shape;
      shape.points = own;
      for (int a = 0; a < kLandmarks; ++a) {
        shape.points(0, a) += 0.01 * (1 + a) * normal(random);
        shape.points(1, a) += 0.005 * (1 + a) * normal(random) + (session == 1 && a == 4 ? bias : 0);
      }
      // the first specimen's pose is the mean's
      if (i > 0) shape.points = Eigen::Rotation2Dd(normal(random)).toRotationMatrix() * shape.points;
      all.shapes.push_back(std::move(shape));
      all.specimens.push_back("s" + std::to_string(i));
    }
  }
  return all;
}

TEST(Repeatability, IsThatOfErrorsPlanted) {
  const Digitised all = digitised(400, 1, 0);
  const Repeatability found = repeatability(all.shapes, all.specimens, 99);
  EXPECT_EQ(found.specimens, 400);
  EXPECT_EQ(found.shapes, 800);
  double squares = 0;
  for (int a = 0; a < kLandmarks; ++a) {
    const double x = 0.01 * (1 + a), y = 0.005 * (1 + a);
    squares += (x * x + y * y) / 2 / kLandmarks;
    if (a < 4) continue;  // of small errors the alignment's are a part
    EXPECT_NEAR(std::sqrt(found.covariances[static_cast<std::size_t>(a)](0, 0)), x, 0.25 * x) << a;
    EXPECT_NEAR(std::sqrt(found.covariances[static_cast<std::size_t>(a)](1, 1)), y, 0.35 * y) << a;
  }
  EXPECT_NEAR(found.sigma, std::sqrt(squares), 0.05 * std::sqrt(squares));
}

TEST(Repeatability, FindsTheBiasOfASession) {
  const Digitised biased = digitised(20, 2, 0.1);
  const auto found = repeatability(biased.shapes, biased.specimens, 199).bias;
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sessions, 2);
  EXPECT_EQ(found->specimens, 20);
  EXPECT_LT(found->p, 0.02);
  int worst = 0;
  found->distances.maxCoeff(&worst);
  EXPECT_EQ(worst, 4);
}

// Of 100 experiments p is below 0.2 in 20 ± 4.
TEST(Repeatability, HasAUniformLevelWithoutBias) {
  int below = 0;
  for (unsigned seed = 10; seed < 110; ++seed) {
    const Digitised all = digitised(8, seed, 0);
    if (repeatability(all.shapes, all.specimens, 49).bias->p <= 0.2) ++below;
  }
  EXPECT_NEAR(below, 20, 12);
}

TEST(Repeatability, NeedsRepeats) {
  Digitised all = digitised(4, 3, 0);
  for (std::size_t i = 0; i < all.specimens.size(); ++i) all.specimens[i] += std::to_string(i);
  EXPECT_THROW(repeatability(all.shapes, all.specimens), InputError);
}

}  // namespace
}  // namespace pulson::audit
