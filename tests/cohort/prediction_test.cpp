#include "pulson/cohort/prediction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "error_of.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using testing::ElementsAre;
using testing::HasSubstr;

// Abramowitz and Stegun, table 26.10.
TEST(Student, QuantilesAreThoseOfTables) {
  EXPECT_NEAR(student_quantile(0.95, 1), 6.314, 5e-4);
  EXPECT_NEAR(student_quantile(0.95, 10), 1.812, 5e-4);
  EXPECT_NEAR(student_quantile(0.975, 30), 2.042, 5e-4);
  EXPECT_NEAR(student_quantile(0.95, 1e7), 1.6448536, 1e-5);
  EXPECT_NEAR(student_quantile(0.75, 1), 1, 1e-9);  // Cauchy's: tan(π/4)
}

// The rms of predictions over the shapes' standard deviation there, and how many coordinates the bands cover.
struct Score {
  double rms = 0, rms_of_mean = 0, covered = 0, count = 0;
};

Score score(const ShapePredictor& predictor, const std::vector<Landmarks>& shapes, int missing) {
  Score found;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Landmarks shape = shapes[i];
    for (int k = 0; k < missing; ++k)
      shape.points.col(static_cast<Index>((i + static_cast<std::size_t>(5 * k)) % 12)).setConstant(std::nan(""));
    const PredictedLandmarks predicted = predictor.predict(shape);
    for (std::size_t k = 0; k < predicted.landmarks.size(); ++k) {
      const Eigen::VectorXd truth = shapes[i].points.col(predicted.landmarks[k]);
      const auto column = static_cast<Index>(k);
      const Eigen::ArrayXd error = (truth - predicted.positions.col(column)).array().abs();
      found.rms += error.square().sum();
      found.rms_of_mean += (truth - predictor.mean().col(predicted.landmarks[k])).squaredNorm();
      found.covered += (error < predicted.half_widths.col(column).array()).cast<double>().sum();
      found.count += static_cast<double>(error.size());
    }
  }
  found.rms = std::sqrt(found.rms / found.count);
  found.rms_of_mean = std::sqrt(found.rms_of_mean / found.count);
  return found;
}

TEST(ShapePredictor, BandsCoverNineOfTen) {
  const CohortLaw law;
  const Atlas atlas = make_atlas(drawn_shapes(law, 30, 31), options_of(law));
  const ShapePredictor predictor(atlas);
  const Score found = score(predictor, drawn_shapes(law, 600, 32), 2);
  EXPECT_LT(found.rms, 0.8 * found.rms_of_mean);
  // 2400 coordinates, about two of each landmark dependent.
  EXPECT_NEAR(found.covered / found.count, 0.9, 4 * std::sqrt(0.9 * 0.1 * 2 / found.count));
}

// With the law itself instead of what 30 shapes show, the error is that of Gaussian regression.
TEST(ShapePredictor, IsNearlyAsGoodAsTheLawItself) {
  const CohortLaw law;
  const ShapePredictor predictor(make_atlas(drawn_shapes(law, 30, 33), options_of(law)));
  const std::vector<Landmarks> shapes = drawn_shapes(law, 300, 34);
  Eigen::MatrixXd v = law.kernel.gram(law.q0, law.q0) / law.lambda;
  v.diagonal().array() += law.sigma * law.sigma;
  double squares = 0;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto a = static_cast<Index>(i % 12);
    std::vector<Index> rest;
    for (Index b = 0; b < 12; ++b)
      if (b != a) rest.push_back(b);
    const Eigen::VectorXd weights = v(rest, rest).llt().solve(v(rest, a));
    const Points displacement = shapes[i].points - law.q0;
    squares += (displacement.col(a) - displacement(Eigen::all, rest) * weights).squaredNorm();
  }
  const double best = std::sqrt(squares / (2 * static_cast<double>(shapes.size())));
  EXPECT_LT(score(predictor, shapes, 1).rms, 1.1 * best);
}

// In pixels, turned and moved: the prediction moves along.
TEST(ShapePredictor, PredictsInTheCoordinatesOfTheShape) {
  const CohortLaw law;
  AtlasOptions options;
  const ShapePredictor predictor(make_atlas(drawn_shapes(law, 20, 35), options));
  Landmarks shape = drawn_shapes(law, 1, 36).front();
  shape.points.col(3).setConstant(std::nan(""));
  shape.points(1, 8) = std::nan("");
  const PredictedLandmarks here = predictor.predict(shape);
  EXPECT_THAT(here.landmarks, ElementsAre(3, 8));
  const Eigen::Matrix2d quarter{{0, -1}, {1, 0}};
  const auto moved = [&](const Points& points) {
    return Points((300 * quarter * points).colwise() + Eigen::Vector2d(70, 9));
  };
  Landmarks there = shape;
  there.points = moved(shape.points);
  const PredictedLandmarks found = predictor.predict(there);
  EXPECT_LT((found.positions - moved(here.positions)).norm(), 1e-8 * 300);
  EXPECT_NEAR(found.half_widths(0, 0), 300 * here.half_widths(1, 0), 1e-8 * 300);
  EXPECT_NEAR(found.half_widths(1, 1), 300 * here.half_widths(0, 1), 1e-8 * 300);
}

TEST(ShapePredictor, LearnsFromSpecimensThatMissLandmarks) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 40, 37);
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k)
      shapes[i].points.col(static_cast<Index>((3 * i + 7 * k) % 12)).setConstant(std::nan(""));
  const ShapePredictor predictor(make_atlas(shapes, options_of(law)));
  const Score found = score(predictor, drawn_shapes(law, 600, 38), 2);
  EXPECT_LT(found.rms, 0.8 * found.rms_of_mean);
  EXPECT_NEAR(found.covered / found.count, 0.9, 4 * std::sqrt(0.9 * 0.1 * 2 / found.count));
}

// Of the cohort's own shapes: what a shape shows must not count as evidence for its prediction.
TEST(PredictMissing, BandsOfTheCohortsOwnShapesCoverNineOfTen) {
  const CohortLaw law;
  double covered = 0, count = 0;
  for (std::uint64_t cohort = 0; cohort < 10; ++cohort) {
    const std::vector<Landmarks> truth = drawn_shapes(law, 12, 400 + cohort);
    std::vector<Landmarks> shapes = truth;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      shapes[i].points.col(static_cast<Index>(i)).setConstant(std::nan(""));
    const std::vector<PredictedLandmarks> found = predict_missing(make_atlas(shapes, options_of(law)), shapes);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      ASSERT_THAT(found[i].landmarks, ElementsAre(static_cast<int>(i)));
      const Points error = (truth[i].points.col(static_cast<Index>(i)) - found[i].positions).cwiseAbs();
      covered += (error.array() < found[i].half_widths.array()).cast<double>().sum();
      count += 2;
    }
  }
  EXPECT_NEAR(covered / count, 0.9, 4 * std::sqrt(0.9 * 0.1 * 2 / count));
}

// What a specimen does not have tells nothing and is not told; the others are predicted as if it were missing.
TEST(PredictMissing, SaysNothingOfWhatIsAbsent) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 10, 47);
  for (const Index a : {2, 5, 7}) shapes[3].points.col(a).setConstant(std::nan(""));
  const PredictedLandmarks all = predict_missing(make_atlas(shapes, options_of(law)), shapes)[3];
  ASSERT_THAT(all.landmarks, ElementsAre(2, 5, 7));
  shapes[3].absent = {2, 7};
  const Atlas atlas = make_atlas(shapes, options_of(law));
  EXPECT_THAT(atlas.template_shape.absent, testing::IsEmpty());
  const PredictedLandmarks found = predict_missing(atlas, shapes)[3];
  ASSERT_THAT(found.landmarks, ElementsAre(5));
  EXPECT_EQ(found.positions.col(0), all.positions.col(1));
  EXPECT_EQ(found.half_widths.col(0), all.half_widths.col(1));
}

// Each drawn shape turned, moved and scaled.
std::vector<Landmarks> posed_draws(const CohortLaw& law, int count, std::uint64_t seed) {
  std::vector<Landmarks> shapes = drawn_shapes(law, count, seed);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto turn = static_cast<double>(i);
    const Eigen::Matrix2d rotation{{std::cos(turn), -std::sin(turn)}, {std::sin(turn), std::cos(turn)}};
    shapes[i].points = ((1 + 0.1 * turn) * rotation * shapes[i].points).colwise() + Eigen::Vector2d(turn, 7);
  }
  return shapes;
}

// Errors over the size of a shape, of the predictions and of the mean placed on the landmarks that are left.
Score score_in_cohort(const std::vector<Landmarks>& truth, const std::vector<Landmarks>& shapes) {
  const Atlas atlas = make_atlas(shapes);
  const std::vector<PredictedLandmarks> predicted = predict_missing(atlas, shapes);
  Score found;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Points mean = align(atlas.mean.points, shapes[i].points, atlas.alignment).apply(atlas.mean.points);
    const double size = centroid_size(truth[i].points);
    for (std::size_t k = 0; k < predicted[i].landmarks.size(); ++k) {
      const int a = predicted[i].landmarks[k];
      const auto column = static_cast<Index>(k);
      const Eigen::ArrayXd error = (truth[i].points.col(a) - predicted[i].positions.col(column)).array();
      found.rms += error.square().sum() / (size * size);
      found.rms_of_mean += (truth[i].points.col(a) - mean.col(a)).squaredNorm() / (size * size);
      found.covered += (error.abs() < predicted[i].half_widths.col(column).array()).cast<double>().sum();
      found.count += static_cast<double>(error.size());
    }
  }
  found.rms = std::sqrt(found.rms / found.count);
  found.rms_of_mean = std::sqrt(found.rms_of_mean / found.count);
  return found;
}

void expect_useful(const Score& found) {
  EXPECT_LT(found.rms, 0.95 * found.rms_of_mean);
  EXPECT_NEAR(found.covered / found.count, 0.9, 4 * std::sqrt(0.9 * 0.1 * 2 / found.count));
}

TEST(PredictMissing, NoSpecimenNeedsToBeComplete) {
  const CohortLaw law;
  const std::vector<Landmarks> truth = posed_draws(law, 40, 41);
  for (const std::size_t missing : {1U, 3U}) {
    std::vector<Landmarks> shapes = truth;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      for (std::size_t k = 0; k < missing; ++k)
        shapes[i].points.col(static_cast<Index>((5 * i + 7 * k) % 12)).setConstant(std::nan(""));
    expect_useful(score_in_cohort(truth, shapes));
  }
}

// One region or the other in two specimens of three.
TEST(PredictMissing, WholeRegionsMayBeMissing) {
  const CohortLaw law;
  const std::vector<Landmarks> truth = posed_draws(law, 40, 42);
  std::vector<Landmarks> shapes = truth;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    if (i % 3 > 0) shapes[i].points.middleCols(i % 3 == 1 ? 0 : 6, 3).setConstant(std::nan(""));
  expect_useful(score_in_cohort(truth, shapes));
}

// The mean of a landmark that two shapes show is as uncertain as these.
TEST(PredictMissing, BandsOfALandmarkOfTwoSpecimensAreWide) {
  const CohortLaw law;
  double covered = 0, count = 0, width = 0, width_of_known = 0;
  for (std::uint64_t cohort = 0; cohort < 8; ++cohort) {
    const std::vector<Landmarks> truth = posed_draws(law, 20, 500 + cohort);
    std::vector<Landmarks> shapes = truth;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (i > 1) shapes[i].points.col(4).setConstant(std::nan(""));
    }
    shapes[2].points.col(8).setConstant(std::nan(""));
    const std::vector<PredictedLandmarks> found = predict_missing(make_atlas(shapes), shapes);
    ASSERT_THAT(found[2].landmarks, ElementsAre(4, 8));
    width += found[2].half_widths.col(0).norm();
    width_of_known += found[2].half_widths.col(1).norm();
    // All depend on the two shapes: one of them is enough.
    const Eigen::ArrayXd error = (truth[2].points.col(4) - found[2].positions.col(0)).array().abs();
    covered += (error < found[2].half_widths.col(0).array()).cast<double>().sum();
    count += 2;
  }
  EXPECT_GT(covered / count, 0.9 - 4 * std::sqrt(0.9 * 0.1 / count));
  EXPECT_GT(width, 1.1 * width_of_known);  // √(1 + 1/2) beside √(1 + 1/20) of the same law
}

TEST(ShapePredictor, RefusesAShapeWithTooFewLandmarks) {
  const CohortLaw law;
  AtlasOptions options;
  options.align = AlignmentKind::kSimilarity;
  const ShapePredictor predictor(make_atlas(drawn_shapes(law, 10, 39), options));
  Landmarks shape = shape_of(law.q0);
  for (Index a = 0; a < 10; ++a) shape.points.col(a).setConstant(std::nan(""));
  EXPECT_THAT(error_of([&] { predictor.predict(shape); }), HasSubstr("2 landmarks are not missing"));
  shape.points.conservativeResize(2, 5);
  EXPECT_THAT(error_of([&] { predictor.predict(shape); }), HasSubstr("must agree in both"));
}

}  // namespace
}  // namespace pulson::cohort
