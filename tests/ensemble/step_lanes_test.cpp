// Paths of every noise that lanes know, by every integrator, against the integrator that takes one path at a time.

#include "step_lanes.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "forced_target.hpp"
#include "path_sampler.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {
namespace step_lanes_test {
namespace {

constexpr double kDt = 0.02;
constexpr std::uint64_t kSeed = 7;
const std::vector<std::string> kIntegrators = {"heun", "midpoint", "variational", "variational-paper", "variational-2"};

// Landmarks about a spacing apart in two groups, with speeds about 1.
Landmarks cloud(int dimension, int count) {
  std::mt19937 generator(static_cast<unsigned>(100 * dimension + count));
  std::uniform_real_distribution<double> uniform(-1, 1);
  Landmarks shape;
  shape.points.resize(dimension, count);
  for (int a = 0; a < count; ++a)
    for (int axis = 0; axis < dimension; ++axis)
      shape.points(axis, a) = 0.3 * uniform(generator) + (axis == 0 ? 0.8 * ((a * 3) % count) : uniform(generator));
  return shape;
}

struct Setting {
  Setting(const std::string& kernel, const std::string& noise, const std::string& integrator, const Landmarks& shape,
          double momentum = 0.4)
      : system{make_kernel(kernel, {}), make_noise(noise, shape)},
        start{shape.points, Points(shape.points.rows(), shape.points.cols())},
        model(system, integrator, shape.dimension(), shape.count(), kDt, kSeed) {
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> uniform(-momentum, momentum);
    for (double& p : start.p.reshaped()) p = uniform(generator);
  }

  LandmarkBatch run(std::uint64_t first_path, std::uint32_t steps) const {
    LandmarkBatch batch = landmark_batch(model.channels, first_path, start);
    advance_steps(model, batch, 0, steps);
    return batch;
  }
  Trajectory integrate(std::uint64_t path, int steps) const {
    const TimeGrid grid{steps * kDt, steps};
    return model.integrator->integrate(system, start, grid,
                                       brownian_increments(kSeed, path, static_cast<int>(model.channels), grid));
  }

  StochasticSystem system;
  PhaseState start;
  StepModel model;
};

PhaseState lane_state(const StepModel& model, const LandmarkBatch& batch, std::size_t lane) {
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

void expect_paths_of_the_integrator(const Setting& setting, int steps) {
  const LandmarkBatch batch = setting.run(3, static_cast<std::uint32_t>(steps));
  for (const std::size_t lane : {0U, 9U, 63U}) {
    ASSERT_EQ(batch.status[lane], LaneStatus::kRunning);
    const Trajectory path = setting.integrate(3 + lane, steps);
    EXPECT_LT(distance(lane_state(setting.model, batch, lane), path.final()), 1e-12) << "lane " << lane;
    double largest = 0;
    for (const PhaseState& state : path.states) largest = std::max(largest, state.p.colwise().norm().maxCoeff());
    EXPECT_NEAR(batch.largest_momentum[lane], largest, 1e-12 * std::max(1.0, largest));
  }
}

// d = 1 has the pair of the paper, too.
const std::vector<std::string> kNoises = {"none",
                                          "ch-sd:beta=0.2",
                                          "trouve-vialard:sigma=0.2,common=1",
                                          "ch-sd-screened:beta=0.1,gamma=0.8",
                                          "ch-sd-screened:beta=0.2,gamma=0.8,on=1",
                                          "kunita:beta=0.1,width=0.7",
                                          "p-sd:beta=0.1,fields=grid,count=3,width=0.8",
                                          "p-sd:beta=0.1",
                                          "ch-sd:beta=0.1+kunita:beta=0.1,width=0.7+p-sd:beta=0.1,fields=grid,count=2"};

TEST(StepLanes, AreThePathsOfTheIntegrator) {
  for (const std::string& noise : kNoises)
    for (const std::string& integrator : kIntegrators)
      for (const auto& [dimension, count] : {std::pair(1, 2), std::pair(2, 5), std::pair(3, 3)}) {
        SCOPED_TRACE(testing::Message() << noise << ' ' << integrator << " d=" << dimension << " N=" << count);
        expect_paths_of_the_integrator(Setting("gaussian:alpha=1", noise, integrator, cloud(dimension, count)), 12);
      }
}

TEST(StepLanes, TakeEveryKernel) {
  for (const std::string kernel : {"matern32:alpha=0.8", "matern52:alpha=1.3", "peakon:alpha=0.8",
                                   "gaussian:alpha=1+matern52:alpha=0.4,weight=0.5+peakon:alpha=1"})
    for (const std::string& integrator : kIntegrators) {
      SCOPED_TRACE(testing::Message() << kernel << ' ' << integrator);
      expect_paths_of_the_integrator(Setting(kernel, "ch-sd-screened:beta=0.1,gamma=0.8", integrator, cloud(2, 4)), 12);
    }
}

TEST(StepLanes, TakeOneLandmarkAndGroups) {
  for (const std::string& integrator : kIntegrators) {
    expect_paths_of_the_integrator(Setting("gaussian:alpha=1", "kunita:beta=0.1,width=1", integrator, cloud(2, 1)), 12);
    Landmarks groups = cloud(2, 6);
    groups.groups = {"a", "a", "a", "b", "b", "b"};
    expect_paths_of_the_integrator(Setting("gaussian:alpha=1", "ch-sd-screened:beta=0.1,gamma=0.8", integrator, groups),
                                   12);
  }
}

// Momenta so large that some steps of some lanes are hard, and the numbers of turns differ.
TEST(StepLanes, AreFunctionsOfTheirPathAloneForAnySplitOfTheSteps) {
  for (const std::string& integrator : kIntegrators)
    for (const double momentum : {0.4, 6.0}) {
      const Setting setting("gaussian:alpha=1", "ch-sd-screened:beta=0.3,gamma=0.8+kunita:beta=0.2,width=1", integrator,
                            cloud(2, 4), momentum);
      const LandmarkBatch a = setting.run(0, 21);
      LandmarkBatch b = landmark_batch(setting.model.channels, 5, setting.start);
      for (const auto& [first, last] : {std::pair(0U, 1U), std::pair(1U, 7U), std::pair(7U, 21U)})
        advance_steps(setting.model, b, first, last);
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

TEST(StepLanes, KeepTheTotalMomentum) {
  for (const std::string& integrator : kIntegrators) {
    const Setting setting("gaussian:alpha=1", "ch-sd-screened:beta=0.2,gamma=0.5+kunita:beta=0.1,width=1", integrator,
                          cloud(3, 7));
    const LandmarkBatch batch = setting.run(0, 50);
    const Eigen::VectorXd total = setting.start.p.rowwise().sum();
    for (std::size_t lane = 0; lane < kPathBatch; lane += 7) {
      const Eigen::VectorXd now = lane_state(setting.model, batch, lane).p.rowwise().sum();
      EXPECT_LT((now - total).norm(), 2e-14 * setting.start.p.colwise().norm().sum()) << integrator;
    }
  }
}

// Where iterations do not contract lanes do what the integrator does, and those without a root stop alone.
TEST(StepLanes, TakeHardStepsAsTheIntegratorDoes) {
  constexpr int kSteps = 10;
  int stopped = 0, continued = 0;
  for (const std::string& integrator : kIntegrators)
    for (const auto& [noise, momentum] :
         {std::pair("ch-sd-screened:beta=1,gamma=1", 25.0), std::pair("ch-sd-screened:beta=1,gamma=1", 60.0),
          std::pair("kunita:beta=8,width=0.5", 1.0)}) {
      const Setting setting("gaussian:alpha=1", noise, integrator, cloud(2, 4), momentum);
      const LandmarkBatch batch = setting.run(0, kSteps);
      for (std::size_t lane = 0; lane < kPathBatch; lane += 7) {
        SCOPED_TRACE(integrator + ", " + noise + ", lane " + std::to_string(lane));
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
  EXPECT_GT(stopped, 5);
  EXPECT_GT(continued, 10);
}

TEST(StepLanes, AreTheSameOnEveryVectorTarget) {
  const Setting setting("gaussian:alpha=1", kNoises.back(), "variational", cloud(2, 5));
  const LandmarkBatch expected = setting.run(0, 20);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(target);
    const LandmarkBatch batch = setting.run(0, 20);
    for (std::size_t lane = 0; lane < kPathBatch; ++lane)
      EXPECT_LT(distance(lane_state(setting.model, batch, lane), lane_state(setting.model, expected, lane)), 1e-11)
          << hwy::TargetName(target);
  }
}

TEST(StepLanes, OfOppositeNoiseAreThoseOfOppositeIncrements) {
  Setting setting("gaussian:alpha=1", "kunita:beta=0.2,width=1", "midpoint", cloud(2, 3));
  setting.model.antithetic = true;
  const LandmarkBatch batch = setting.run(0, 20);
  const TimeGrid grid{20 * kDt, 20};
  for (const std::size_t lane : {0U, 1U, 62U, 63U}) {
    const Eigen::MatrixXd increments =
        (lane % 2 == 1 ? -1 : 1) * brownian_increments(kSeed, lane / 2, static_cast<int>(setting.model.channels), grid);
    const Trajectory path = setting.model.integrator->integrate(setting.system, setting.start, grid, increments);
    EXPECT_LT(distance(lane_state(setting.model, batch, lane), path.final()), 1e-12);
  }
}

TEST(StepLanes, AreTakenWhereTheyKnowTheNoise) {
  const Landmarks shape = cloud(2, 4);
  const PhaseState start{shape.points, shape.points};
  const auto sampler_of = [&](const std::string& noise, const std::string& integrator) {
    const StochasticSystem system{make_kernel("gaussian:alpha=1", {}), make_noise(noise, shape)};
    return make_path_sampler(system, integrator, start, {.grid = {1, 10}, .records = {10}})->name();
  };
  for (const std::string& noise : kNoises)
    for (const std::string& integrator : kIntegrators) EXPECT_EQ(sampler_of(noise, integrator), "landmark lanes");
  for (const std::string noise : {"langevin:sigma=1", "potential:beta=1,gamma=1", "p-sd:beta=1,fields=cos"})
    EXPECT_EQ(sampler_of(noise, "heun"), "one path at a time");
  EXPECT_EQ(sampler_of("none", "rk4"), "one path at a time");
  EXPECT_THROW(Setting("gaussian:alpha=1", "langevin:sigma=1", "heun", shape), InputError);
}

// Sums of such kernels over landmarks of a line are sweeps for one path, and pairs in lanes.
TEST(StepLanes, AreNotTakenOnLinesOfManyLandmarks) {
  const auto sampler_of = [&](const std::string& kernel, const std::string& noise, int dimension, int count) {
    const Landmarks shape = cloud(dimension, count);
    const StochasticSystem system{make_kernel(kernel, {}), make_noise(noise, shape)};
    return make_path_sampler(system, "heun", {shape.points, shape.points}, {.grid = {1, 10}, .records = {10}})->name();
  };
  EXPECT_EQ(sampler_of("matern32:alpha=1", "ch-sd:beta=1", 1, 299), "landmark lanes");
  EXPECT_EQ(sampler_of("matern32:alpha=1", "ch-sd:beta=1", 1, 300), "one path at a time");
  EXPECT_EQ(sampler_of("peakon:alpha=1", "ch-sd:beta=1", 1, 300), "one path at a time");
  EXPECT_EQ(sampler_of("gaussian:alpha=1", "ch-sd:beta=1", 1, 300), "landmark lanes");
  EXPECT_EQ(sampler_of("matern32:alpha=1", "ch-sd:beta=1", 2, 300), "landmark lanes");
  EXPECT_EQ(sampler_of("matern32:alpha=1", "kunita:beta=1,width=1", 1, 300), "landmark lanes");
}

}  // namespace
}  // namespace step_lanes_test
}  // namespace pulson::ensemble
