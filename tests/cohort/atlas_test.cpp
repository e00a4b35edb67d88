#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "error_of.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using testing::HasSubstr;

Points mean_momenta(const Atlas& atlas) {
  Points sum = 0 * atlas.mean.points;
  for (const AtlasSpecimen& specimen : atlas.specimens) sum += specimen.momenta;
  return sum / static_cast<double>(atlas.specimens.size());
}

double cost_about(const CohortLaw& law, const Points& q0, const std::vector<Landmarks>& shapes) {
  double sum = 0;
  const TemplateMetric metric(law.kernel, 0, law.lambda * law.sigma * law.sigma, q0);
  std::vector<Eigen::Index> all(static_cast<std::size_t>(q0.cols()));
  for (std::size_t a = 0; a < all.size(); ++a) all[a] = static_cast<Eigen::Index>(a);
  for (const Landmarks& shape : shapes) {
    const GeodesicMatch found =
        Geodesics(law.kernel, 20).match(metric, MatchModel(metric, all), shape.points, 0 * q0, 1e-11);
    sum += law.lambda * hamiltonian(law.kernel, {q0, found.momenta}) +
           0.5 * (found.end.q - shape.points).squaredNorm() / (law.sigma * law.sigma);
  }
  return sum;
}

TEST(Atlas, TheTemplateMinimisesTheCostOfAll) {
  CohortLaw law;
  law.lambda = 40;  // displacements of a sixth of the oval
  const std::vector<Landmarks> shapes = drawn_shapes(law, 8, 1);
  AtlasOptions options = options_of(law);
  options.steps = 20;
  const Atlas atlas = make_atlas(shapes, options);
  ASSERT_TRUE(atlas.converged);
  EXPECT_LT(mean_momenta(atlas).cwiseAbs().maxCoeff(), 1e-6);
  const Points& q0 = atlas.template_shape.points;
  const double least = cost_about(law, q0, shapes);
  double total = 0;
  for (const AtlasSpecimen& specimen : atlas.specimens) total += specimen.cost.total();
  EXPECT_NEAR(total, least, 1e-8 * least);
  EXPECT_LT(least, cost_about(law, atlas.mean.points, shapes));
  for (int k = 0; k < 4; ++k) {
    const Points change = 0.01 * standard_normals(7, static_cast<std::uint64_t>(k), 24, 1).reshaped(2, 12);
    EXPECT_LT(least, cost_about(law, q0 + change, shapes));
    EXPECT_LT(least, cost_about(law, q0 - change, shapes));
  }
}

// A tenth of the landmarks of each shape is wrong: the atlas is that in which these are missing.
TEST(Atlas, ThatIsRobustIsThatWithoutWrongLandmarks) {
  const CohortLaw law;
  std::vector<Landmarks> wrong = drawn_shapes(law, 12, 3), missing = wrong;
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const auto a = static_cast<Eigen::Index>(5 * i % 12);
    const double angle = 2.1 * static_cast<double>(i);
    wrong[i].points.col(a) += 0.4 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    missing[i].points.col(a).setConstant(std::nan(""));
  }
  AtlasOptions options;
  const Atlas expected = make_atlas(missing, options);
  options.loss = matching::RobustLoss{};
  const Atlas robust = make_atlas(wrong, options);
  for (std::size_t i = 0; i < wrong.size(); ++i)
    EXPECT_THAT(robust.specimens[i].suspects(), testing::Contains(static_cast<int>(5 * i % 12))) << i;
  std::size_t suspects = 0;
  for (const AtlasSpecimen& specimen : robust.specimens) suspects += specimen.suspects().size();
  EXPECT_LE(suspects, wrong.size() + 2);
  // Standard errors of log λ and log σ exceed √(2/m) and √(1/2m) of m degrees of freedom: here 11·18, of 12 shapes
  // about their mean, each of which lacks a landmark of 12. The sizes of the templates differ, as a centroid size
  // counts the landmarks that there are.
  const double size = centroid_size(robust.template_shape.points) / centroid_size(expected.template_shape.points);
  EXPECT_NEAR(std::log(robust.lambda * size * size / expected.lambda), 0, 0.5 * std::sqrt(2.0 / 198));
  EXPECT_NEAR(std::log(robust.sigma / size / expected.sigma), 0, 0.5 * std::sqrt(0.5 / 198));
  EXPECT_THAT(robust.notes, testing::Contains(HasSubstr("of a weight below 0.1")));
  EXPECT_EQ(robust.loss, "tukey:5.12299");
  // Each match is the minimum of its weighted J: q(1) + λσ²p(1)/v = y.
  for (const AtlasSpecimen& specimen : robust.specimens) {
    const PhaseState end = robust.geodesic(specimen.momenta).final();
    for (Eigen::Index a = 0; a < 12; ++a) {
      const double v = specimen.precisions[a];
      EXPECT_NEAR(v, specimen.weights[a] < 0.1 ? 0 : specimen.weights[a] / 0.730023,
                  1e-6);  // κ, by integration in numpy
      const Eigen::VectorXd rest = v * (end.q.col(a) - specimen.shape.points.col(a)) +
                                   robust.lambda * robust.sigma * robust.sigma * end.p.col(a);
      EXPECT_LT(rest.norm(), 1e-6);
    }
  }
}

TEST(Atlas, ShotsOfMomentaReachTheirTargetsWithoutSigma) {
  const CohortLaw law;
  const std::vector<Landmarks> shapes = drawn_shapes(law, 10, 2);
  for (const double beta : {0.0, 0.2}) {
    AtlasOptions options;
    options.sigma = 0;
    options.beta = beta;
    const Atlas atlas = make_atlas(shapes, options);
    ASSERT_TRUE(atlas.converged);
    EXPECT_LT(atlas.exp_log_error(), 1e-10);
    for (const AtlasSpecimen& specimen : atlas.specimens)
      EXPECT_LT((atlas.geodesic(specimen.momenta).final().q - specimen.shape.points).cwiseAbs().maxCoeff(), 1e-10 * 2);
  }
}

// Two landmarks that change places in one shape of three, which no flow on a line can do.
TEST(Atlas, MetamorphosisReachesWhatNoFlowCan) {
  const std::vector<Landmarks> shapes = {shape_of(Points{{0, 1, 3}}), shape_of(Points{{0, 1.2, 3}}),
                                         shape_of(Points{{1.2, 0.9, 3}})};
  AtlasOptions options;
  options.kernel = "gaussian:alpha=1";
  options.lambda = 1;
  options.sigma = 0;
  options.beta = 1;
  options.steps = 20;
  const Atlas atlas = make_atlas(shapes, options);
  ASSERT_TRUE(atlas.converged);
  EXPECT_LT(atlas.exp_log_error(), 1e-10);
  EXPECT_GT(atlas.specimens[2].cost.action, 0);
}

TEST(Atlas, DoesNotDependOnTheUnitOfLength) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 6, 3);
  const Atlas one = make_atlas(shapes);
  for (Landmarks& shape : shapes) shape.points *= 1000;
  const Atlas other = make_atlas(shapes);
  EXPECT_NEAR(other.sigma / one.sigma, 1000, 1e-3 * 1000);
  EXPECT_NEAR(other.lambda / one.lambda, 1e-6, 1e-3 * 1e-6);
  EXPECT_LT((other.template_shape.points / 1000 - one.template_shape.points).norm(), 1e-5);
}

TEST(Atlas, HasTheSameBitsForAnyNumberOfThreads) {
  const CohortLaw law;
  const std::vector<Landmarks> shapes = drawn_shapes(law, 7, 4);
  set_thread_count(1);
  const Atlas one = make_atlas(shapes);
  set_thread_count(2);
  const Atlas two = make_atlas(shapes);
  set_thread_count(0);
  EXPECT_EQ(one.template_shape.points, two.template_shape.points);
  EXPECT_EQ(one.specimens[6].momenta, two.specimens[6].momenta);
}

TEST(Atlas, MissingLandmarksAreLeftOutOfTheData) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 20, 5);
  const Atlas complete = make_atlas(shapes, options_of(law));
  for (int i = 0; i < 20; i += 2) shapes[static_cast<std::size_t>(i)].points(0, i % 12) = std::nan("");
  const Atlas atlas = make_atlas(shapes, options_of(law));
  ASSERT_TRUE(atlas.converged);
  EXPECT_LT(mean_momenta(atlas).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_TRUE(std::isnan(atlas.specimens[2].distances()[2]));
  EXPECT_LT(atlas.specimens[2].momenta.col(2).norm(), atlas.specimens[1].momenta.col(2).norm());
  // A twentieth of the data is missing: the template's change is a fraction of its standard error.
  const double standard_error = std::sqrt((1 / law.lambda + law.sigma * law.sigma) / 20);
  EXPECT_LT((atlas.template_shape.points - complete.template_shape.points).cwiseAbs().maxCoeff(), standard_error);
}

// Σp = 0, Σ p∧q = 0 and Σ p·(q − q̄) = 0 for each specimen, and the template as the mean lies.
TEST(Atlas, MomentaHoldNoPose) {
  CohortLaw law;
  law.lambda = 40;
  law.q0 = oval(10, 3);
  std::vector<Landmarks> shapes = drawn_shapes(law, 8, 9);
  for (std::size_t i = 0; i < shapes.size(); i += 2)
    shapes[i].points.col(static_cast<int>(i)).setConstant(std::nan(""));
  const Atlas atlas = make_atlas(shapes);
  ASSERT_TRUE(atlas.converged);
  const Points& q0 = atlas.template_shape.points;
  const Points centred = q0.colwise() - q0.rowwise().mean();
  for (const AtlasSpecimen& specimen : atlas.specimens) {
    const double scale = specimen.momenta.norm() * centred.norm();
    const Eigen::Matrix3d moments = specimen.momenta * centred.transpose();
    EXPECT_LT(specimen.momenta.rowwise().sum().norm(), 1e-6 * specimen.momenta.norm());
    EXPECT_LT((moments - moments.transpose()).norm(), 1e-6 * scale);
    EXPECT_LT(std::abs(moments.trace()), 1e-6 * scale);
  }
  const Points change = q0 - atlas.mean.points;
  const Points mean = atlas.mean.points.colwise() - atlas.mean.points.rowwise().mean();
  EXPECT_LT(change.rowwise().sum().norm(), 1e-9);
  const Eigen::Matrix3d turn = change * mean.transpose();
  EXPECT_LT((turn - turn.transpose()).norm(), 1e-9);
  EXPECT_LT(std::abs(turn.trace()), 1e-9);
}

TEST(Atlas, InSpaceAndOnALine) {
  CohortLaw law;
  law.q0 = oval(10, 3);
  const Atlas space = make_atlas(drawn_shapes(law, 5, 6));
  EXPECT_TRUE(space.converged);
  EXPECT_EQ(space.alignment, AlignmentKind::kSimilarity);
  law.q0 = Points::Zero(1, 5);
  law.q0 << -2, -1, 0, 1, 2;
  const Atlas line = make_atlas(drawn_shapes(law, 5, 7));
  EXPECT_TRUE(line.converged);
  EXPECT_EQ(line.alignment, AlignmentKind::kNone);
}

TEST(Atlas, RefusesWhatItCannotDo) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 3, 8);
  EXPECT_THAT(error_of([&] { make_atlas({shapes[0]}); }), HasSubstr("at least two shapes"));
  AtlasOptions options;
  options.align = AlignmentKind::kAffine;
  EXPECT_THAT(error_of([&] { make_atlas(shapes, options); }), HasSubstr("affine"));
  options = {};
  options.sigma = -1;
  EXPECT_THAT(error_of([&] { make_atlas(shapes, options); }), HasSubstr("sigma is -1"));
  for (Landmarks& shape : shapes) shape.points.col(3) = shape.points.col(4);
  EXPECT_THAT(error_of([&] { make_atlas(shapes); }), HasSubstr("landmarks 4 and 5"));
  shapes[1].points.conservativeResize(2, 5);
  EXPECT_THAT(error_of([&] { make_atlas(shapes); }), HasSubstr("must agree in both"));
}

}  // namespace
}  // namespace pulson::cohort
