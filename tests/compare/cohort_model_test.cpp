// The derivatives by which the numbers of a model are found, against differences.

#include "cohort_model.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "combinations.hpp"
#include "evidence_surface.hpp"
#include "noise_range.hpp"
#include "number_search.hpp"
#include "pulson/compare/comparison.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Shapes that move by a good part of their distances, so that Laplace's evidence is not that of a linear model.
class OfEvidence : public testing::TestWithParam<std::tuple<std::string, AlignmentKind>> {
 protected:
  static CohortSettings settings() {
    CohortSettings settings = cohort_settings();
    settings.fit_width = settings.fit_sigma = true;
    settings.sigma = 0.05;
    return settings;
  }

  const Landmarks source = oval(6);
  const Cohort cohort =
      CohortShapes{std::nullopt, drawn_shapes(source, "ch-sd:beta=0.1", 20, settings(), 5, 4), std::get<1>(GetParam())}
          .cohort();
  const CohortModel model{cohort, make_open_noise(std::get<0>(GetParam()), cohort.source), settings()};
  const Matches matches = model.match(model.start(), nullptr, CohortModel::Effort::kThorough);
};
INSTANTIATE_TEST_SUITE_P(All, OfEvidence,
                         testing::Combine(testing::Values("none", "ch-sd", "trouve-vialard"),
                                          testing::Values(AlignmentKind::kNone, AlignmentKind::kRigid,
                                                          AlignmentKind::kSimilarity)),
                         [](const auto& row) { return "Case" + std::to_string(row.index); });

TEST_P(OfEvidence, GradientsOfLinearModelsAreThoseOfTheirValue) {
  const VectorXd gradient = model.linear_evidence(matches, matches.x).gradient;
  for (Index i = 0; i < model.count(); ++i) {
    const VectorXd by = 1e-3 * VectorXd::Unit(model.count(), i);
    const double rise = model.linear_value(matches, matches.x + by) - model.linear_value(matches, matches.x - by);
    EXPECT_NEAR(gradient[i], rise / 2e-3, 1e-2 + 2e-3 * std::abs(gradient[i])) << model.open()[at(i)].name;
  }
}

// At rest every landmark moves by K p0, K of unit diagonal, and by noise of variance β² in a unit of time.
TEST(NoiseShare, IsThatOfTheVariances) {
  const Cohort cohort = make_cohort(oval(6), {oval(6)}, AlignmentKind::kNone);
  CohortSettings settings = cohort_settings();
  settings.sigma = 0.05;
  const CohortModel model(cohort, make_open_noise("ch-sd", cohort.source), settings);
  for (const double beta : {0.05, 0.3}) {
    const double lambda = 20;
    EXPECT_NEAR(noise_share(model, model.place({lambda, beta})), beta * beta / (beta * beta + 1 / lambda), 1e-3);
  }
}

// The walk along an amplitude and the interval of it end where the evidence has fallen as far; of data without a pose
// and with known sigma, where that is smooth.
TEST(NoiseRange, HasPlacesUpToTheEndOfTheInterval) {
  CohortSettings settings = cohort_settings();
  settings.sigma = 0.05;
  const Landmarks source = oval(6);
  const Cohort cohort =
      make_cohort(source, drawn_shapes(source, "ch-sd:beta=0.2", 20, settings, 12, 4), AlignmentKind::kNone);
  const CohortModel model(cohort, make_open_noise("ch-sd", cohort.source), settings);
  const Found found = find_numbers(model);
  const NoiseRange range = noise_range(model, found.about);
  double highest = 0;
  for (const VectorXd& x : range.places) highest = std::max(highest, x[1]);
  ASSERT_EQ(model.open()[1].kind, ModelNumber::Kind::kAmplitude);
  ASSERT_TRUE(std::isfinite(found.intervals.high[1]));
  EXPECT_GT(highest, found.x()[1]);
  EXPECT_NEAR(highest, found.intervals.high[1], 0.3 * (found.intervals.high[1] - found.x()[1]));
  EXPECT_GE(range.greatest_share, noise_share(model, found.x()));
}

TEST(AddedByDraws, IsThatAtItsBoxBeyondIt) {
  const AddedByDraws added({VectorXd::Zero(2), VectorXd{{1, -2}}, MatrixXd{{0.5, 0.1}, {0.1, 0.3}}},
                           {VectorXd::Constant(2, -1), VectorXd::Constant(2, 1)});
  EXPECT_EQ(added.value(VectorXd{{7, 0.4}}), added.value(VectorXd{{1, 0.4}}));
  EXPECT_EQ(AddedByDraws().value(VectorXd{{7, 0.4}}), 0);
  for (const VectorXd& x : {VectorXd{{0.2, 0.4}}, VectorXd{{7, 0.4}}, VectorXd{{-3, 5}}}) {
    SecondOrder found{0, VectorXd::Zero(2), MatrixXd::Zero(2, 2)};
    added.add_to(found, x);
    EXPECT_EQ(found.value, added.value(x));
    for (const Index i : {0, 1}) {
      const VectorXd by = 1e-4 * VectorXd::Unit(2, i);
      EXPECT_NEAR(found.gradient[i], (added.value(x + by) - added.value(x - by)) / 2e-4, 1e-8);
      EXPECT_NEAR(-found.information(i, i), (added.value(x + by) - 2 * found.value + added.value(x - by)) / 1e-8, 1e-6);
    }
  }
}

// Differences about the maximum of 20 shapes give the evidence half a deviation away, in any direction, twice as well
// as the linear models. A number at its bound stays there: of that differences know one side.
TEST(CorrectedEvidence, IsLaplacesNearThePlaceOfItsDifferences) {
  CohortSettings settings = cohort_settings();
  settings.fit_width = settings.fit_sigma = true;
  settings.sigma = 0.05;
  const std::vector<Landmarks> shapes = drawn_shapes(oval(12), "ch-sd:beta=0.1", 20, settings, 20, 4);
  for (const AlignmentKind kind : {AlignmentKind::kNone, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
    const Cohort cohort = CohortShapes{std::nullopt, shapes, kind}.cohort();
    const CohortModel model(cohort, make_open_noise("none", cohort.source), settings);
    Found found = find_numbers(model);
    ASSERT_TRUE(found.converged);
    const EvidenceSurface surface(model, found.about, false);
    EXPECT_EQ(surface.here(), found.about.log_evidence);
    const CorrectedEvidence corrected(model, found.about, surface.correction());
    EXPECT_NEAR(corrected.value(found.x()), found.about.log_evidence, 1e-9);
    Numbers numbers(3);
    const Eigen::LLT<MatrixXd> factors(metric_of(surface.local().slope.information));
    double corrected_squares = 0, linear_squares = 0;
    for (int k = 0; k < 8; ++k) {
      const VectorXd z = VectorXd(numbers(static_cast<int>(model.count()), 1)).normalized();
      VectorXd x = model.box().clipped(found.x() + 0.5 * factors.matrixU().solve(z));
      const auto is_bound = found.x().array() == model.box().least.array();
      x = is_bound.select(found.x(), x);
      const double there = model.match(x, &found.about).log_evidence;
      corrected_squares += std::pow(corrected.value(x) - there, 2);
      linear_squares += std::pow(model.linear_value(found.about, x) - there, 2);
    }
    EXPECT_LT(corrected_squares, linear_squares / 4);
    EXPECT_LT(std::sqrt(corrected_squares / 8), 0.2);
  }
}

}  // namespace
}  // namespace pulson::compare
