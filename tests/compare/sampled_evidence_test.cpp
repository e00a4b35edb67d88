// The evidence by Markov chains, beside that by importance samples where these are effective.

#include "compare/sampled_evidence.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "pulson/compare/comparison.hpp"

namespace pulson::compare {
namespace {

class SampledEvidenceOf : public testing::TestWithParam<const char*> {};

TEST_P(SampledEvidenceOf, EachShapeIsThatOfImportanceSamples) {
  CohortSettings settings = cohort_settings();
  settings.lambda = 50;
  Cohort cohort = drawn_cohort(oval(6), GetParam(), 50, settings, 3, 1);
  cohort.targets[1].points(0, 2) = std::nan("");
  cohort = make_cohort(cohort.source, cohort.targets, AlignmentKind::kSimilarity);
  settings.importance_samples = 2000;
  settings.sampling_error = 0.02;
  const CohortFit fit = fit_cohort(cohort, GetParam(), settings);
  const SampledEvidence sampled = sample_evidence(cohort, fit, settings);
  ASSERT_EQ(sampled.shapes.size(), 3U);
  EXPECT_LT(sampled.total.standard_error, 0.5);
  double sum = 0;
  for (std::size_t s = 0; s < 3; ++s) {
    const ShapeFit& shape = fit.shapes[s];
    EXPECT_GT(shape.effective_samples, 0.1 * shape.samples);
    EXPECT_NEAR(sampled.shapes[s].value, shape.log_evidence,
                4 * std::hypot(sampled.shapes[s].standard_error, std::sqrt(shape.variance)));
    sum += sampled.shapes[s].value;
  }
  EXPECT_EQ(sampled.total.value, sum);
}

INSTANTIATE_TEST_SUITE_P(Models, SampledEvidenceOf, testing::Values("none", "ch-sd:beta=0.05"),
                         [](const auto& row) { return row.index == 0 ? "Geodesic" : "Noise"; });

TEST(SampledEvidenceOfAComparison, RanksTheModels) {
  CompareOptions options;
  options.settings = cohort_settings();
  options.settings.lambda = 50;
  options.sampled_evidence = true;
  options.folds = 0;
  options.maps = false;
  options.forward_samples = 10;
  CohortShapes shapes;
  shapes.source = oval(6);
  shapes.targets = drawn_shapes(oval(6), "ch-sd:beta=0.3", 50, options.settings, 4, 2);
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd:beta=0.3"}, options);
  EXPECT_EQ(comparison.best, 1U);
  for (const ComparedModel& model : comparison.models) {
    ASSERT_TRUE(model.fit.sampled.has_value());
    EXPECT_EQ(model.fit.log_evidence, model.fit.sampled->total.value + model.fit.step_error.value);
    EXPECT_EQ(model.score, model.fit.score());
    EXPECT_NE(model.fit.log_evidence, model.fit.laplace);
  }
}

}  // namespace
}  // namespace pulson::compare
