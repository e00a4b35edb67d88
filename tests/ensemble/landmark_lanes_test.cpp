// N landmarks in vector lanes against the integrator that takes one path at a time.

#include "landmark_lanes.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "forced_target.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {
namespace {

constexpr double kDt = 0.02;
constexpr std::uint64_t kSeed = 7;

// Landmarks about a spacing apart, with speeds about 1.
PhaseState cloud(int dimension, int count, double momentum = 0.4) {
  std::mt19937 generator(static_cast<unsigned>(100 * dimension + count));
  std::uniform_real_distribution<double> uniform(-1, 1);
  PhaseState state{Points(dimension, count), Points(dimension, count)};
  for (int a = 0; a < count; ++a) {
    for (int axis = 0; axis < dimension; ++axis) {
      state.q(axis, a) = 0.3 * uniform(generator) + (axis == 0 ? 0.8 * ((a * 3) % count) : uniform(generator));
      state.p(axis, a) = momentum * uniform(generator);
    }
  }
  return state;
}

struct Setting {
  Setting(const std::string& kernel, const std::string& noise, PhaseState its_start)
      : system{make_kernel(kernel, {}), make_noise(noise)},
        start(std::move(its_start)),
        model(system, static_cast<int>(start.q.rows()), static_cast<int>(start.q.cols()), kDt, kSeed) {}

  LandmarkBatch run(std::uint64_t first_path, std::uint32_t steps) const {
    LandmarkBatch batch = landmark_batch(model.channels, first_path, start);
    advance_landmarks(model, batch, 0, steps);
    return batch;
  }

  Trajectory integrate(std::uint64_t path, int steps) const {
    const TimeGrid grid{steps * kDt, steps};
    return make_integrator("variational")
        ->integrate(system, start, grid, brownian_increments(kSeed, path, static_cast<int>(model.channels), grid));
  }

  StochasticSystem system;
  PhaseState start;
  LandmarkModel model;
};

PhaseState lane_state(const LandmarkModel& model, const LandmarkBatch& batch, std::size_t lane) {
  const auto rows = static_cast<Eigen::Index>(model.dimension);
  const auto cols = static_cast<Eigen::Index>(model.count);
  PhaseState state{Points(rows, cols), Points(rows, cols)};
  for (Eigen::Index i = 0; i < state.q.size(); ++i) {
    state.q.reshaped()[i] = batch.q[static_cast<std::size_t>(i) * kPathBatch + lane];
    state.p.reshaped()[i] = batch.p[static_cast<std::size_t>(i) * kPathBatch + lane];
  }
  return state;
}

double distance(const PhaseState& a, const PhaseState& b) {
  const double q = (a.q - b.q).cwiseAbs().maxCoeff() / std::max(1.0, b.q.cwiseAbs().maxCoeff());
  return std::max(q, (a.p - b.p).cwiseAbs().maxCoeff() / std::max(1.0, b.p.cwiseAbs().maxCoeff()));
}

void expect_paths_of_the_integrator(const Setting& setting, int steps, double tolerance) {
  const LandmarkBatch batch = setting.run(3, static_cast<std::uint32_t>(steps));
  for (std::size_t lane = 0; lane < kPathBatch; lane += 9) {
    ASSERT_EQ(batch.status[lane], LaneStatus::kRunning);
    const Trajectory path = setting.integrate(3 + lane, steps);
    EXPECT_LT(distance(lane_state(setting.model, batch, lane), path.final()), tolerance) << "lane " << lane;
    double largest = 0;
    double side = std::numeric_limits<double>::infinity();
    for (const PhaseState& state : path.states) {
      largest = std::max(largest, state.p.colwise().norm().maxCoeff());
      for (std::size_t i = 1; i < batch.order.size(); ++i)
        side = std::min(side, state.q(static_cast<Eigen::Index>(batch.order[i])) -
                                  state.q(static_cast<Eigen::Index>(batch.order[i - 1])));
    }
    EXPECT_NEAR(batch.largest_momentum[lane], largest, tolerance * std::max(1.0, largest));
    if (batch.order.size() > 1) {
      EXPECT_NEAR(batch.smallest_side[lane], side, tolerance);
    }
  }
}

struct LandmarkCase {
  std::string kernel, noise;
};

const std::vector<LandmarkCase> kLandmarkCases = {
    {"gaussian:alpha=1", "ch-sd:beta=0.2"},
    {"gaussian:alpha=0.7,weight=2", "none"},
    {"peakon:alpha=0.8", "ch-sd:beta=0.2,on=1"},
    {"matern32:alpha=0.8,weight=0.5", "p-sd:beta=0.3"},
    {"matern52:alpha=1.3", "trouve-vialard:sigma=0.2"},
    {"gaussian:alpha=1", "trouve-vialard:sigma=0.2,common=1"},
    {"gaussian:alpha=1.5", "ch-sd:beta=0.1+trouve-vialard:sigma=0.1+p-sd:beta=0.2"},
    {"gaussian:alpha=1+matern52:alpha=0.4,weight=0.5+peakon:alpha=1+matern32:alpha=2,weight=0.3", "ch-sd:beta=0.2"}};

TEST(LandmarkLanes, AreThePathsOfTheIntegrator) {
  for (const auto& [kernel, noise] : kLandmarkCases) {
    for (const int dimension : {1, 2, 3}) {
      for (const int count : {1, 2, 5}) {
        SCOPED_TRACE(kernel + " " + noise + " d=" + std::to_string(dimension) + " N=" + std::to_string(count));
        expect_paths_of_the_integrator(Setting(kernel, noise, cloud(dimension, count)), 50, 1e-10);
      }
    }
  }
}

TEST(LandmarkLanes, StayThePathsOfTheIntegrator) {
  expect_paths_of_the_integrator(Setting("gaussian:alpha=1", "ch-sd:beta=0.2", cloud(2, 6)), 250, 1e-9);
}

// Units are powers of two, so lengths and times far from 1 are as good.
TEST(LandmarkLanes, TakeAnyUnits) {
  PhaseState start = cloud(2, 4);
  start.q *= 1e30;
  start.p *= 1e60;
  const Setting setting("gaussian:alpha=1e30,weight=1e-30", "ch-sd:beta=1e29", start);
  const LandmarkBatch batch = setting.run(0, 50);
  for (const std::size_t lane : {0U, 63U}) {
    const PhaseState end = lane_state(setting.model, batch, lane);
    const PhaseState expected = setting.integrate(lane, 50).final();
    EXPECT_LT((end.q - expected.q).cwiseAbs().maxCoeff(), 1e-10 * expected.q.cwiseAbs().maxCoeff());
    EXPECT_LT((end.p - expected.p).cwiseAbs().maxCoeff(), 1e-10 * expected.p.cwiseAbs().maxCoeff());
  }
}

TEST(LandmarkLanes, OfTwoLandmarksOnALineAreThePairs) {
  PairModel pair(make_kernel("gaussian:alpha=1", {}).terms().front());
  pair.seed = kSeed;
  pair.channels = 1;
  pair.position[0] = {0, 1.5};
  PairBatch expected = pair_batch(pair, 0, 0, 4, 4, 1);
  advance_pair(pair, expected, 0, 250);
  const PhaseState start{(Points(1, 2) << 0, 4).finished(), (Points(1, 2) << 4, 1).finished()};
  const Setting setting("gaussian:alpha=1", "ch-sd:beta=1.5,on=2", start);
  const LandmarkBatch batch = setting.run(0, 250);
  for (std::size_t lane = 0; lane < kPathBatch; ++lane) {
    const PhaseState end = lane_state(setting.model, batch, lane);
    EXPECT_NEAR(end.q(0), expected.q1[lane], 1e-9);
    EXPECT_NEAR(end.q(1) - end.q(0), expected.gap[lane], 1e-9);
    EXPECT_NEAR(end.p(1), expected.p2[lane], 1e-9);
    EXPECT_NEAR(batch.smallest_side[lane], expected.smallest_side[lane], 1e-9);
  }
}

TEST(LandmarkLanes, AreTheSameForAnySplitOfTheSteps) {
  const Setting setting("gaussian:alpha=1", "ch-sd:beta=0.2+trouve-vialard:sigma=0.1", cloud(2, 5));
  const LandmarkBatch whole = setting.run(0, 103);
  LandmarkBatch parts = landmark_batch(setting.model.channels, 0, setting.start);
  for (const auto& [first, last] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}, {1, 50}, {50, 57}, {57, 103}})
    advance_landmarks(setting.model, parts, first, last);
  EXPECT_EQ(whole.q, parts.q);
  EXPECT_EQ(whole.p, parts.p);
  EXPECT_EQ(whole.largest_momentum, parts.largest_momentum);
}

// Momenta so large that some steps of some lanes are hard, and the numbers of turns differ.
TEST(LandmarkLanes, AreFunctionsOfTheirPathAlone) {
  for (const double momentum : {0.5, 8.0}) {
    const Setting setting("gaussian:alpha=1", "ch-sd:beta=0.5", cloud(2, 5, momentum));
    const LandmarkBatch a = setting.run(0, 60);
    const LandmarkBatch b = setting.run(5, 60);
    for (std::size_t lane = 5; lane < kPathBatch; ++lane) {
      EXPECT_EQ(a.status[lane], b.status[lane - 5]);
      EXPECT_EQ(a.stopped[lane], b.stopped[lane - 5]);
      for (std::size_t i = 0; i < a.q.size(); i += kPathBatch) {
        EXPECT_EQ(a.q[i + lane], b.q[i + lane - 5]);
        EXPECT_EQ(a.p[i + lane], b.p[i + lane - 5]);
      }
    }
  }
}

TEST(LandmarkLanes, KeepTheTotalMomentum) {
  for (const std::string kernel : {"gaussian:alpha=1", "matern32:alpha=1", "peakon:alpha=1"}) {
    const Setting setting(kernel, "ch-sd:beta=0.2+p-sd:beta=0.1", cloud(3, 12));
    const LandmarkBatch batch = setting.run(0, 250);
    const Eigen::VectorXd total = setting.start.p.rowwise().sum();
    for (std::size_t lane = 0; lane < kPathBatch; ++lane) {
      const Eigen::VectorXd now = lane_state(setting.model, batch, lane).p.rowwise().sum();
      EXPECT_LT((now - total).norm(), 1e-13 * setting.start.p.colwise().norm().sum()) << kernel;
    }
  }
}

// A step ends at the root of its equation to round-off, which symplecticity needs.
TEST(LandmarkLanes, EndStepsAtTheirRoots) {
  for (const std::string kernel : {"gaussian:alpha=1", "matern52:alpha=1", "matern32:alpha=1", "peakon:alpha=1"}) {
    for (const double momentum : {0.1, 0.5, 2.0}) {
      const Setting setting(kernel, "none", cloud(2, 12, momentum));
      LandmarkBatch batch = landmark_batch(setting.model.channels, 0, setting.start);
      PhaseState before = setting.start;
      for (std::uint32_t step = 0; step < 20; ++step) {
        advance_landmarks(setting.model, batch, step, step + 1);
        const PhaseState end = lane_state(setting.model, batch, 0);
        const Points q = before.q + kDt * hamiltonian_p(setting.system.kernel, end.q, before.p);
        const Points p = before.p - kDt * hamiltonian_q(setting.system.kernel, end.q, before.p);
        EXPECT_LT((end.q - q).cwiseAbs().maxCoeff(), 8e-16 * q.cwiseAbs().maxCoeff()) << kernel << ", " << momentum;
        EXPECT_LT((end.p - p).cwiseAbs().maxCoeff(), 2e-15 * p.cwiseAbs().maxCoeff()) << kernel << ", " << momentum;
        before = end;
      }
    }
  }
}

// Where κ > 1 lanes do what the integrator does, and those without a root stop alone.
TEST(LandmarkLanes, TakeHardStepsAsTheIntegratorDoes) {
  constexpr int kSteps = 30;
  int stopped = 0;
  int continued = 0;
  for (const std::string kernel : {"gaussian:alpha=1", "peakon:alpha=1"}) {
    for (const double momentum : {15.0, 20.0, 25.0}) {
      const Setting setting(kernel, "ch-sd:beta=1", cloud(2, 4, momentum));
      const LandmarkBatch batch = setting.run(0, kSteps);
      for (std::size_t lane = 0; lane < kPathBatch; lane += 3) {
        SCOPED_TRACE(kernel + ", momentum " + std::to_string(momentum) + ", lane " + std::to_string(lane));
        try {
          const Trajectory path = setting.integrate(lane, kSteps);
          continued += path.continuation_steps;
          ASSERT_EQ(batch.status[lane], LaneStatus::kRunning) << batch.stopped[lane];
          EXPECT_LT(distance(lane_state(setting.model, batch, lane), path.final()), 1e-7);
        } catch (const StepError& error) {
          ++stopped;
          EXPECT_EQ(batch.status[lane], LaneStatus::kNoRoot);
          EXPECT_EQ(batch.stopped[lane], static_cast<std::uint32_t>(error.step()));
        }
      }
    }
  }
  EXPECT_GT(stopped, 5);
  EXPECT_GT(continued, 10);
}

TEST(LandmarkLanes, AreTheSameOnEveryVectorTarget) {
  const Setting setting("gaussian:alpha=1", "ch-sd:beta=0.2", cloud(2, 7));
  const LandmarkBatch expected = setting.run(0, 100);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(target);
    const LandmarkBatch batch = setting.run(0, 100);
    for (std::size_t lane = 0; lane < kPathBatch; ++lane)
      EXPECT_LT(distance(lane_state(setting.model, batch, lane), lane_state(setting.model, expected, lane)), 1e-9)
          << hwy::TargetName(target);
  }
}

TEST(LandmarkLanes, OfOppositeNoiseMirrorEachOther) {
  Setting setting("gaussian:alpha=1", "ch-sd:beta=0.2", {cloud(2, 1).q, Points::Zero(2, 1)});
  setting.model.antithetic = true;
  const LandmarkBatch batch = setting.run(0, 50);
  for (std::size_t lane = 0; lane < kPathBatch; lane += 2) {
    const Points there = lane_state(setting.model, batch, lane).q - setting.start.q;
    const Points back = lane_state(setting.model, batch, lane + 1).q - setting.start.q;
    EXPECT_LT((there + back).norm(), 1e-13);
    EXPECT_LT((there - (setting.integrate(lane / 2, 50).final().q - setting.start.q)).norm(), 1e-13);
  }
}

TEST(LandmarkLanes, RefuseOtherNoise) {
  const PhaseState start = cloud(2, 4);
  EXPECT_THROW(Setting("gaussian:alpha=1", "ch-sd-screened", start), InputError);
  EXPECT_THROW(Setting("gaussian:alpha=1", "langevin", start), InputError);
}

}  // namespace
}  // namespace pulson::ensemble
