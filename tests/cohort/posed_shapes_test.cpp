#include "cohort/posed_shapes.hpp"

#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "cohort/displacement_fit.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

PosedShapes posed_law(AlignmentKind kind = AlignmentKind::kSimilarity, int dimension = 2) {
  const CohortLaw law;
  const Points mean = oval(12, dimension);
  return {mean, kind, displacement_covariance(law.kernel, law.lambda, law.sigma, mean), law.sigma * law.sigma};
}

// A draw around the mean that misses these landmarks.
Points incomplete_draw(const PosedShapes& law, std::uint64_t path, const std::vector<Index>& missing) {
  const Points& mean = law.mean();
  Points shape =
      mean + 0.05 * standard_normals(3, path, static_cast<int>(mean.size()), 1).reshaped(mean.rows(), mean.cols());
  for (const Index a : missing) shape.col(a).setConstant(std::nan(""));
  return shape;
}

// The flat prior as the limit of a wide one.
TEST(PosedShapes, AreConditionedAsNormalShapesOfWidelySpreadPoses) {
  const PosedShapes law = posed_law();
  const Points shape = incomplete_draw(law, 0, {2, 3});
  VectorXd precisions = VectorXd::LinSpaced(12, 0.2, 1.3);
  precisions[9] = 0;  // as if it were missing
  const PosedShapes::Conditional found = law.condition(shape, precisions);
  MatrixXd wide = law.covariance() + 1e3 * law.directions() * law.directions().transpose();
  for (const Index place : found.observed)
    wide(place, place) += std::pow(CohortLaw().sigma, 2) * (1 / precisions[place / 2] - 1);
  const auto &seen = found.observed, &missing = found.missing;
  ASSERT_EQ(missing.size(), 6U);
  const Eigen::LDLT<MatrixXd> factors(MatrixXd(wide(seen, seen)));
  const VectorXd displacement = (shape - law.mean()).reshaped()(seen);
  const MatrixXd weights = factors.solve(MatrixXd(wide(seen, missing))).transpose();
  EXPECT_LT((found.displacement - weights * displacement).norm(), 1e-5 * displacement.norm());
  const MatrixXd covariance = wide(missing, missing) - weights * wide(seen, missing);
  EXPECT_LT((found.covariance - covariance).norm(), 1e-4 * covariance.norm());
  EXPECT_NEAR(found.distance, displacement.dot(factors.solve(displacement)), 1e-4 * found.distance);
}

TEST(PosedShapes, APlacedShapeHasThePoseOfTheMean) {
  const Eigen::Matrix2d quarter{{0, -1}, {1, 0}};
  for (const AlignmentKind kind : {AlignmentKind::kTranslation, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
    const PosedShapes law = posed_law(kind);
    for (const std::vector<Index>& missing : {std::vector<Index>{}, {0, 1, 2, 3}}) {
      const Points shape = incomplete_draw(law, 1, missing);
      const Points placed = law.placing(shape).apply(shape);
      EXPECT_LT(law.condition(placed).pose.norm(), 1e-10);
      if (kind == AlignmentKind::kTranslation) continue;
      const double scale = kind == AlignmentKind::kSimilarity ? 70 : 1;
      const Points moved = (scale * quarter * shape).colwise() + Eigen::Vector2d(5, -3);
      const Points again = law.placing(moved).apply(moved);
      for (Index a = 0; a < shape.cols(); ++a)
        if (shape.col(a).allFinite()) {
          EXPECT_LT((again.col(a) - placed.col(a)).norm(), 1e-9);
        }
    }
  }
  const PosedShapes space = posed_law(AlignmentKind::kSimilarity, 3);
  const Points shape = incomplete_draw(space, 2, {1, 5});
  EXPECT_LT(space.condition(space.placing(shape).apply(shape)).pose.norm(), 1e-10);
}

// A shape that is as much larger as it is far away: its part along the mean is the mean.
TEST(PosedShapes, PlacingAgainAndAgainDoesNotShrink) {
  PosedShapes law = posed_law();
  std::vector<Points> shapes;
  for (std::uint64_t i = 0; i < 20; ++i) shapes.push_back(incomplete_draw(law, 10 + i, {static_cast<Index>(i % 12)}));
  const double size = centroid_size(law.mean());
  for (int round = 0; round < 30; ++round) {
    const ExpectedShapes expected = expected_shapes(law, shapes);
    law = {updated_mean(law, expected.complete, AlignmentKind::kSimilarity), AlignmentKind::kSimilarity,
           law.covariance()};
    shapes = expected.placed;
    for (const Points& shape : expected.complete) EXPECT_GE(centroid_size(shape), (1 - 1e-9) * size);
  }
  EXPECT_NEAR(centroid_size(law.mean()), size, 1e-9 * size);
}

}  // namespace
}  // namespace pulson::cohort
