// The derivatives by which the numbers of a model are found, against differences.

#include "cohort_model.hpp"

#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "cohort_examples.hpp"
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

// To a tenth of a standard deviation, which is half of a hundredth of a nat, by what the information differs from the
// evidence's over half a step, and by errors of matches: under a similarity the evidence is found to 0.006 nats.
TEST_P(OfEvidence, GradientsAreThoseOfLaplaces) {
  ASSERT_TRUE(matches.all_converged());
  MatrixXd information = metric_of(model.linear_evidence(matches, matches.x).information);
  VectorXd slopes(model.count()), differ(model.count());
  for (Index i = 0; i < model.count(); ++i) {
    const double step = 0.05 * std::min(1 / std::sqrt(information(i, i)), 1.0);
    const VectorXd by = step * VectorXd::Unit(model.count(), i);
    const double above = model.match(matches.x + by, &matches).log_evidence,
                 below = model.match(matches.x - by, &matches).log_evidence;
    slopes[i] = (above - below) / (2 * step);
    const double curvature = (2 * matches.log_evidence - above - below) / (step * step);
    information(i, i) = std::max(curvature, 0.25);
    differ[i] = 0.05 * (information(i, i) - curvature);
  }
  const VectorXd gradient = model.gradient(matches, information, model.box());
  for (Index i = 0; i < model.count(); ++i)
    EXPECT_NEAR(gradient[i], slopes[i],
                0.1 * std::sqrt(information(i, i)) + differ[i] + 0.12 * std::max(std::sqrt(information(i, i)), 1.0))
        << model.open()[at(i)].name;
}

TEST_P(OfEvidence, GradientsOfLinearModelsAreThoseOfTheirValue) {
  const VectorXd gradient = model.linear_evidence(matches, matches.x).gradient;
  for (Index i = 0; i < model.count(); ++i) {
    const VectorXd by = 1e-3 * VectorXd::Unit(model.count(), i);
    const double rise = model.linear_value(matches, matches.x + by) - model.linear_value(matches, matches.x - by);
    EXPECT_NEAR(gradient[i], rise / 2e-3, 1e-2 + 2e-3 * std::abs(gradient[i])) << model.open()[at(i)].name;
  }
}

// Of numbers that are held nothing is asked.
TEST_P(OfEvidence, GradientsOfHeldNumbersAreNone) {
  Box held = model.box();
  held.least = held.most = matches.x;
  EXPECT_EQ(model.gradient(matches, MatrixXd::Identity(model.count(), model.count()), held).norm(), 0);
}

}  // namespace
}  // namespace pulson::compare
