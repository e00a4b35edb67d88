// Shooting through the paper's integrator: metamorphosis as the flow of H_tot, J as steps tend to 0, drawn noise.

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "dynamics/effective_hamiltonian.hpp"
#include "plain_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"
#include "registration_problem.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::vector<std::string> kLinearNoises = {"ch-sd:beta=0.4", "ch-sd-screened:beta=0.4,gamma=0.5",
                                                "p-sd:beta=0.4,fields=bump,center=0/0/0.5/0.2,width=0.7",
                                                "kunita:beta=0.4,width=0.6"};

Landmarks landmarks_of(const Points& points) {
  Landmarks shape;
  shape.points = points;
  return shape;
}

// The derivatives of (λ/2)Σh² against differences of the sum itself.
TEST(ControlEnergy, HasTheDerivativesOfItsSum) {
  for (const std::string& spec : kLinearNoises) {
    SCOPED_TRACE(spec);
    Numbers numbers(3);
    const PhaseState at{numbers.landmarks(2, 4), numbers(2, 4)};
    const auto noise = make_noise(spec, landmarks_of(at.q));
    const auto energy = control_energy(noise, 0.7);
    const PhaseState change{numbers(2, 4), numbers(2, 4)};
    const double h = 1e-5;
    const auto moved = [&](double by) { return PhaseState{at.q + by * change.q, at.p + by * change.p}; };
    const auto value = [&](double by) { return 0.35 * noise->potentials(moved(by)).squaredNorm(); };
    const PhaseState slope = energy->compensation_gradient(at);
    const double along = slope.q.cwiseProduct(change.q).sum() + slope.p.cwiseProduct(change.p).sum();
    EXPECT_NEAR(along, (value(h) - value(-h)) / (2 * h), 1e-8 * (1 + std::abs(along)));
    const PhaseState bent = energy->compensation_hessian(at, change);
    const PhaseState after = energy->compensation_gradient(moved(h)), before = energy->compensation_gradient(moved(-h));
    EXPECT_LE((bent.q - (after.q - before.q) / (2 * h)).norm(), 1e-7 * (1 + bent.q.norm()));
    EXPECT_LE((bent.p - (after.p - before.p) / (2 * h)).norm(), 1e-7 * (1 + bent.p.norm()));
  }
}

// J over p0 alone: the gradient by adjoints and the changes of the end against differences of J and of the end.
TEST(ShotMetamorphosis, HasExactDerivatives) {
  for (const std::string& spec : kLinearNoises) {
    SCOPED_TRACE(spec);
    Numbers numbers(5);
    const Points source = numbers.landmarks(2, 4), target = source + 0.3 * numbers(2, 4);
    const auto noise = make_noise(spec, landmarks_of(source));
    MatchingProblem problem{{make_kernel("gaussian:alpha=0.8"), noise},
                            make_integrator("variational"),
                            {1.5, 12},
                            source,
                            std::make_shared<LandmarkTerm>(LandmarkObservations{target, 0.1}),
                            0.1,
                            0.6};
    problem.along_path = true;
    const MatchingObjective objective(problem);
    ASSERT_EQ(objective.unknowns(), 8);
    const Points p0 = 0.4 * numbers(2, 4);
    const VectorXd z = objective.white(p0, MatrixXd());
    const auto at = objective.evaluate(z);
    ASSERT_TRUE(at);
    const EffectiveHamiltonian total(problem.system, problem.lambda);
    EXPECT_NEAR(at->cost.energy, 0.6 * 1.5 * total.value({source, p0}), 1e-9 * at->cost.energy);
    const VectorXd direction = numbers(8, 1);
    const double h = 1e-5;
    const auto after = objective.evaluate(z + h * direction), before = objective.evaluate(z - h * direction);
    const double slope = (z + objective.data_gradient(*at)).dot(direction);
    EXPECT_NEAR(slope, (after->cost.total() - before->cost.total()) / (2 * h), 1e-6 * std::abs(slope));
    const VectorXd ends = objective.endpoint_changes(at->path()) * direction;
    const Points difference = (after->path().final().q - before->path().final().q) / (2 * h);
    EXPECT_LE((ends - difference.reshaped()).norm(), 1e-7 * ends.norm());
  }
}

RegistrationOptions shooting(std::string noise) {
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  options.noise = std::move(noise);
  options.minimise.solver = Solver::kShooting;
  options.more_steps = true;
  return options;
}

// q⁺ = q + Δt(K(q⁺)p + λβ²p), p⁺ = p − Δt H_q(q⁺, p), by plain loops.
Points end_by_loops(const Registration& found, double beta) {
  Eigen::RowVectorXd q = found.source.points, p = found.momenta;
  const double dt = found.grid.dt();
  for (int k = 0; k < found.grid.steps; ++k) {
    Eigen::RowVectorXd next = q;
    for (int turn = 0; turn < 200; ++turn) {
      const double kernel = std::exp(-std::pow(next[0] - next[1], 2));
      Eigen::RowVectorXd velocity(2);
      velocity << p[0] + kernel * p[1], p[1] + kernel * p[0];
      next = q + dt * (velocity + found.lambda * beta * beta * p);
    }
    q = next;
    const double r = q[0] - q[1], slope = -2 * r * std::exp(-r * r) * p[0] * p[1];
    p[0] -= dt * slope;
    p[1] += dt * slope;
  }
  return q;
}

// Two landmarks on a line that change places: J = (∫₀¹ dr / √((1 − K(r))/λ + β²))², (mathematics §4.1).
TEST(ShotMetamorphosis, TendsToTheClosedFormOfASwap) {
  const Landmarks source = landmarks_of(Eigen::RowVector2d(0, 1)), target = landmarks_of(Eigen::RowVector2d(1, 0));
  for (const auto& [beta, exact] : std::vector<std::pair<double, double>>{{0.5, 2.2539}, {1, 0.8132}, {2, 0.2355}}) {
    RegistrationOptions options = shooting("ch-sd:beta=" + std::to_string(beta));
    options.sigma = 0.001;
    options.lambda = 1;
    const Registration found = register_shapes(source, target, options);
    EXPECT_EQ(found.mode, MatchingMode::kMetamorphosis);
    EXPECT_EQ(found.integrator, "variational");
    EXPECT_TRUE(found.converged && found.matched()) << found.stop_reason;
    ASSERT_TRUE(found.extrapolated);
    EXPECT_NEAR(found.extrapolated->cost.total(), exact, 3e-3 * exact);
    EXPECT_GT(std::abs(found.cost.total() - exact), std::abs(found.extrapolated->cost.total() - exact));
    EXPECT_LE((end_by_loops(found, beta) - found.result).norm(), 1e-12);
    EXPECT_EQ(replay(found).final().q, found.result);
  }
}

// Where landmarks keep their places nothing tells the two ways apart but their steps.
TEST(ShotMetamorphosis, CostsWhatTheSearchOverPathsFinds) {
  for (const int d : {1, 2, 3}) {
    Numbers numbers(11);
    const Points source = numbers.landmarks(d, 5);
    const Landmarks from = landmarks_of(source), to = landmarks_of(source + 0.2 * numbers(d, 5));
    for (const std::string noise : {"ch-sd:beta=0.3", "ch-sd-screened:beta=0.3,gamma=0.5", "kunita:beta=0.3"}) {
      SCOPED_TRACE(noise + " in " + std::to_string(d) + "D");
      RegistrationOptions options = shooting(noise);
      options.sigma = 0.05;
      const Registration shot = register_shapes(from, to, options);
      options.minimise.solver = Solver::kAuto;
      options.more_steps = false;
      options.grid.steps = 80;
      const Registration path = register_shapes(from, to, options);
      ASSERT_TRUE(shot.extrapolated);
      EXPECT_NEAR(shot.extrapolated->cost.total(), path.cost.total(), 5e-3 * path.cost.total());
    }
  }
}

TEST(DrawnPaths, AreOneBrownianPathOnGridsThatHalveEachOther) {
  const Points q0 = Numbers(2).landmarks(2, 3);
  const auto noise = make_noise("ch-sd:beta=1", landmarks_of(q0));
  const std::vector<MatrixXd> coarse = realisations(*noise, q0, {2, 20}, 7, 3),
                              fine = realisations(*noise, q0, {2, 80}, 7, 3);
  for (std::size_t s = 0; s < 3; ++s) EXPECT_LE((coarsened(fine[s], 4) - coarse[s]).norm(), 1e-13);
  EXPECT_GT((coarse[0] - coarse[1]).norm(), 1);
}

// Noise as large as the distance of the landmarks: p0 undoes one realisation, and of many the target is their mean.
TEST(DrawnNoise, IsFollowedOrAveraged) {
  const Landmarks source = landmarks_of((Points(2, 4) << 0, 1, 1, 0, 0, 0, 1, 1).finished());
  Landmarks target = source;
  target.points.row(0).array() += 0.4;
  RegistrationOptions options = shooting("ch-sd:beta=0.4");
  options.sigma = 0.02;
  options.mode = MatchingMode::kPathwise;
  const Registration one = register_shapes(source, target, options);
  EXPECT_TRUE(one.converged && one.matched()) << one.stop_reason;
  EXPECT_FALSE(one.extrapolated);
  ASSERT_TRUE(one.noise_displacement);
  EXPECT_NEAR(*one.noise_displacement,
              0.4 * std::sqrt((realisations(*make_noise(one.noise, source), source.points, one.grid, 1, 1)[0]
                                   .rowwise()
                                   .sum()
                                   .squaredNorm()) /
                              4),
              0.05);
  options.mode = MatchingMode::kExpected;
  options.samples = 6;
  const Registration many = register_shapes(source, target, options);
  EXPECT_TRUE(many.converged) << many.stop_reason;
  EXPECT_FALSE(many.matched());
  EXPECT_LE((many.result - target.points).norm(), 0.5);
}

// Every noise in every dimension and way: docs/shooting_checked.md shows the same for larger shapes.
TEST(Shooting, MatchesThroughThePapersIntegratorInEveryWay) {
  const std::vector<std::string> noises = {"none",
                                           "ch-sd:beta=0.2",
                                           "ch-sd-screened:beta=0.2,gamma=0.5",
                                           "p-sd:beta=0.2,fields=grid,count=2",
                                           "kunita:beta=0.2",
                                           "trouve-vialard:sigma=0.5",
                                           "potential:beta=0.2,gamma=0.5",
                                           "langevin:sigma=0.5"};
  for (const int d : {1, 2, 3}) {
    Numbers numbers(4);
    const Points source = numbers.landmarks(d, 4);
    const Landmarks from = landmarks_of(source), to = landmarks_of(source + 0.2 * numbers(d, 4));
    for (const std::string& noise : noises)
      for (const MatchingMode mode : {MatchingMode::kDeterministic, MatchingMode::kMetamorphosis, MatchingMode::kMap,
                                      MatchingMode::kPathwise, MatchingMode::kExpected}) {
        SCOPED_TRACE(noise + " in " + std::to_string(d) + "D, mode " + mode_name(mode));
        RegistrationOptions options = shooting(noise);
        options.sigma = 0.05;
        options.mode = mode;
        options.samples = 2;
        const bool noisy = noise != "none";
        const bool linear = make_noise(noise, from)->traits().linear;
        if ((mode != MatchingMode::kDeterministic && !noisy) || (mode == MatchingMode::kMetamorphosis && !linear)) {
          EXPECT_THROW(register_shapes(from, to, options), InputError);
          continue;
        }
        const Registration found = register_shapes(from, to, options);
        EXPECT_EQ(found.integrator, "variational");
        EXPECT_TRUE(found.converged) << found.stop_reason;
        EXPECT_TRUE(found.matched() || mode == MatchingMode::kExpected);
        const bool drawn = mode == MatchingMode::kPathwise || mode == MatchingMode::kExpected;
        EXPECT_EQ(found.extrapolated.has_value(), !drawn);
        EXPECT_EQ(found.noise_displacement.has_value(), drawn);
      }
  }
}

TEST(Shooting, RefusesWhatItCannotDo) {
  const Landmarks source = landmarks_of(Eigen::RowVector2d(0, 1)), target = landmarks_of(Eigen::RowVector2d(0.1, 1.3));
  const auto refusal = [&](const std::string& integrator, Solver solver) {
    RegistrationOptions options = shooting("ch-sd:beta=1");
    options.mode = MatchingMode::kMetamorphosis;
    options.integrator = integrator;
    options.minimise.solver = solver;
    try {
      register_shapes(source, target, options);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal("heun", Solver::kShooting).find("'variational'"), std::string::npos);
  EXPECT_NE(refusal("variational", Solver::kPaths).find("solver shooting"), std::string::npos);
  EXPECT_EQ(refusal("variational-paper", Solver::kShooting), "");
}

}  // namespace
}  // namespace pulson::matching
