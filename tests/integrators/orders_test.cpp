#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "convergence.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::convergence {
namespace {

Case case_of(const std::string& noise) {
  const std::vector<Case> all = cases();
  return *std::ranges::find_if(all, [&](const Case& setting) { return setting.noise.starts_with(noise + ":"); });
}

Plan small_plan(int paths, std::vector<std::string> integrators = {}) {
  return {.steps = {16, 32, 64, 128}, .reference_steps = 1024, .paths = paths, .integrators = std::move(integrators)};
}

double at_most(const Estimate& e) { return e.value + 4 * e.error; }
double at_least(const Estimate& e) { return e.value - 4 * e.error; }

Verdict verdict(const Case& setting, const Measurement& measurement, const Row& row, Quantity quantity) {
  const Claim claim = claim_of(setting, row, quantity);
  if (claim.kind == Claim::Kind::kStalls) return stalls(setting, measurement, quantity);
  return compare(row.orders[quantity], claim, quantity);
}

std::string describe(const Case& setting, const Row& row, Quantity quantity) {
  const Estimate& slope = row.orders[quantity].slope;
  return row.integrator + (row.limit == Limit::kPaper ? " against its own limit" : "") + ", quantity " +
         std::to_string(quantity) + ": " + std::to_string(slope.value) + " +- " + std::to_string(slope.error) +
         ", claimed " + std::to_string(claim_of(setting, row, quantity).order);
}

class Orders : public testing::TestWithParam<Case> {};

// Every integrator that takes noise is measured by being in the table. All tolerances are four standard errors: of the
// multiples of ½ that a strong order may be, the slope has to be nearest to the one claimed by more than that.
TEST_P(Orders, AreThoseClaimed) {
  const Case& setting = GetParam();
  const Plan plan = small_plan(setting.commutes ? 256 : 96);  // more channels cost more
  const Measurement measurement = measure(setting, plan);
  EXPECT_EQ(measurement.reference_failed, 0);
  for (const Row& row : measurement.rows) {
    EXPECT_EQ(row.paths, plan.paths);
    EXPECT_LT(at_most(measurement.references_apart), at_least(row.means[kState].back()));
    for (const Quantity quantity : {kPosition, kState})
      EXPECT_EQ(verdict(setting, measurement, row, quantity), Verdict::kAgrees) << describe(setting, row, quantity);
    for (const Quantity quantity : {kMeanQ, kSquareQ, kMeanP, kSquareP})
      EXPECT_NE(verdict(setting, measurement, row, quantity), Verdict::kDiffers) << describe(setting, row, quantity);
    // With additive noise the half order of (20) is the half of the last increment, and nothing else.
    if (!setting.system.noise->traits().additive) continue;
    EXPECT_EQ(claim_of(setting, row, kCompleted).order, 1);
    EXPECT_EQ(verdict(setting, measurement, row, kCompleted), Verdict::kAgrees) << describe(setting, row, kCompleted);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, Orders, testing::ValuesIn(cases()), [](const auto& test) {
  std::string name = test.param.noise + "_" + std::to_string(test.param.start.q.rows()) + "D";
  std::ranges::replace_if(
      name, [](unsigned char x) { return std::isalnum(x) == 0; }, '_');
  return name;
});

TEST(OrdersOfVariational, WeakOrderIsOneForNoiseInTheMomenta) {
  for (const char* const noise : {"trouve-vialard", "langevin", "potential"}) {
    SCOPED_TRACE(noise);
    const Case setting = case_of(noise);
    const Measurement measurement = measure(setting, small_plan(96, {"variational"}));
    const Row& row = measurement.rows.front();
    for (const Quantity quantity : {kMeanP, kSquareP})
      EXPECT_EQ(verdict(setting, measurement, row, quantity), Verdict::kAgrees) << describe(setting, row, quantity);
  }
}

// (20) as printed has another mean than the Stratonovich equation; compensated it has the same.
TEST(OrdersOfVariational, CompensationMendsTheMeanOfScreenedNoise) {
  const Case setting = case_of("ch-sd-screened");
  const Measurement measurement = measure(setting, small_plan(128, {"variational", "variational-paper"}));
  const auto off = [&](const std::string& integrator) {
    return std::ranges::find(measurement.rows, integrator, &Row::integrator)->means[kMeanQ].back();
  };
  const Estimate& apart = measurement.limits_apart[kMeanQ];
  EXPECT_GT(at_least(apart), 0);
  EXPECT_EQ(stalls(setting, measurement, kMeanQ), Verdict::kAgrees);
  EXPECT_GT(at_least(off("variational-paper")), at_most(off("variational")));
  EXPECT_LT(at_most(off("variational")), at_least(apart));
}

TEST(OrdersCases, CoverTheTableOfNoises) {
  const std::vector<Case> all = cases();
  for (const auto& row : noise_table().rows()) {
    const bool has_case =
        std::ranges::any_of(all, [&](const Case& setting) { return setting.noise.starts_with(row.name + ":"); });
    EXPECT_TRUE(has_case || row.name == "none") << row.name;
  }
}

TEST(OrdersCases, CountThePathsThatHaveNoSolution) {
  Case setting = case_of("p-sd");
  setting.system.noise = make_noise("p-sd:beta=3,fields=cos");
  const Plan plan{.steps = {4, 8}, .reference_steps = 64, .paths = 20, .integrators = {"variational"}};
  const Row row = measure(setting, plan).rows.front();
  EXPECT_GT(row.failed[0], 0);
  EXPECT_LE(row.paths, plan.paths - std::ranges::max(row.failed));
  EXPECT_GE(row.paths, plan.paths - row.failed[0] - row.failed[1]);
}

TEST(OrdersCases, DoNotDependOnTheNumberOfThreads) {
  const Plan plan{.steps = {4, 8, 16}, .reference_steps = 32, .paths = 10};
  const auto means = [&](int threads) {
    set_thread_count(threads);
    const Measurement measurement = measure(case_of("p-sd"), plan);
    set_thread_count(0);
    std::vector<double> all;
    for (const Row& row : measurement.rows)
      for (const auto& quantity : row.means)
        for (const Estimate& mean : quantity) all.insert(all.end(), {mean.value, mean.error});
    return all;
  };
  EXPECT_EQ(means(1), means(3));
}

}  // namespace
}  // namespace pulson::convergence
