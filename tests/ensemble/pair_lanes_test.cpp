// The pair in vector lanes against the integrator that takes one path at a time.

#include "pair_lanes.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {
namespace {

struct PairCase {
  std::string kernel;
  std::string noise;
  PairModel model;
};

PairCase pair_case(const std::string& kernel, const std::string& noise) {
  PairCase setting{kernel, noise, PairModel(make_kernel(kernel, {}).terms().front())};
  setting.model.seed = 7;
  const auto made = make_noise(noise);
  const PhaseState state{Points::Zero(1, 2), Points::Zero(1, 2)};
  setting.model.channels = made->channels(1, 2);
  for (int i = 0; i < setting.model.channels; ++i) {
    const PhaseState load = made->gradient(state, Eigen::VectorXd::Unit(setting.model.channels, i));
    for (int a = 0; a < 2; ++a) {
      setting.model.position[static_cast<std::size_t>(i)][static_cast<std::size_t>(a)] = load.p(a);
      setting.model.momentum[static_cast<std::size_t>(i)][static_cast<std::size_t>(a)] = load.q(a);
    }
  }
  return setting;
}

const std::vector<std::pair<std::string, std::string>> kPairCases = {
    {"gaussian:alpha=1", "ch-sd:beta=1.5,on=2"},      {"peakon:alpha=0.5", "ch-sd:beta=1.5,on=2"},
    {"gaussian:alpha=1", "ch-sd:beta=0.5"},           {"gaussian:alpha=1", "p-sd:beta=1"},
    {"gaussian:alpha=1", "trouve-vialard:sigma=0.1"}, {"matern32:alpha=0.8,weight=0.5", "ch-sd:beta=1,on=1"},
    {"matern52:alpha=0.8", "ch-sd:beta=1,on=1"},      {"gaussian:alpha=1", "none"}};

TEST(PairLanes, AreThePathsOfTheIntegrator) {
  for (const auto& [kernel, noise] : kPairCases) {
    SCOPED_TRACE(kernel + " " + noise);
    const PairCase setting = pair_case(kernel, noise);
    constexpr int kSteps = 250;
    PairBatch batch = pair_batch(setting.model, 3, 0, 4, 4, 1);
    advance_pair(setting.model, batch, 0, kSteps);
    const StochasticSystem system{make_kernel(kernel, {}), make_noise(noise)};
    const PhaseState start{(Points(1, 2) << 0, 4).finished(), (Points(1, 2) << 4, 1).finished()};
    for (std::size_t lane = 0; lane < kPathBatch; lane += 5) {
      const TimeGrid grid{kSteps * 0.02, kSteps};
      const Trajectory path =
          make_integrator("variational")
              ->integrate(system, start, grid, brownian_increments(7, 3 + lane, setting.model.channels, grid));
      EXPECT_NEAR(batch.q1[lane], path.final().q(0), 1e-9);
      EXPECT_NEAR(batch.gap[lane], path.final().q(1) - path.final().q(0), 1e-9);
      EXPECT_NEAR(batch.p1[lane], path.final().p(0), 1e-9);
      EXPECT_NEAR(batch.p2[lane], path.final().p(1), 1e-9);
    }
  }
}

TEST(PairLanes, AreTheSameForAnySplitOfTheSteps) {
  const PairCase setting = pair_case("gaussian:alpha=1", "ch-sd:beta=1.5");
  PairBatch whole = pair_batch(setting.model, 0, 0, 4, 4, 1);
  PairBatch parts = whole;
  advance_pair(setting.model, whole, 0, 203);
  for (const auto& [first, last] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}, {1, 50}, {50, 57}, {57, 203}})
    advance_pair(setting.model, parts, first, last);
  EXPECT_EQ(whole.gap, parts.gap);
  EXPECT_EQ(whole.p2, parts.p2);
  EXPECT_EQ(whole.smallest_side, parts.smallest_side);
}

TEST(PairLanes, AreFunctionsOfTheirPathAlone) {
  const PairCase setting = pair_case("peakon:alpha=0.5", "ch-sd:beta=1.5,on=2");
  PairBatch a = pair_batch(setting.model, 0, 0, 4, 4, 1);
  PairBatch b = pair_batch(setting.model, 5, 0, 4, 4, 1);
  advance_pair(setting.model, a, 0, 200);
  advance_pair(setting.model, b, 0, 200);
  for (std::size_t lane = 5; lane < kPathBatch; ++lane) EXPECT_EQ(a.gap[lane], b.gap[lane - 5]);
}

// Where κ ≥ 1 the root is the one on the branch from Δt = 0, as the integrator finds it.
TEST(PairLanes, TakeHardStepsAsTheIntegratorDoes) {
  int hard = 0;
  for (const std::string kernel : {"gaussian:alpha=1", "peakon:alpha=0.5"}) {
    const StochasticSystem system{make_kernel(kernel, {}), make_noise("none")};
    const KernelTerm term = system.kernel.terms().front();
    for (const double gap : {-3.0, -0.5, 1e-3, 0.1, 1.0, 5.0}) {
      for (double a = -300; a < 300; a += 7.3) {
        const PhaseState start{(Points(1, 2) << 0, gap).finished(), (Points(1, 2) << -a / 2, a / 2).finished()};
        double g = 0;
        const bool found = solve_gap(term, gap, a, g);
        try {
          const PhaseState end =
              make_integrator("variational")->integrate(system, start, {1, 1}, Eigen::MatrixXd(0, 1)).final();
          ASSERT_TRUE(found) << kernel << ", gap " << gap << ", a " << a;
          EXPECT_NEAR(g, end.q(1) - end.q(0), 1e-9 * std::abs(g)) << kernel << ", gap " << gap << ", a " << a;
        } catch (const StepError&) {
          EXPECT_FALSE(found) << kernel << ", gap " << gap << ", a " << a;
        }
        hard += std::abs(a) * PairModel(term).lipschitz >= 1 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(hard, 100);
}

}  // namespace
}  // namespace pulson::ensemble
