// What an accurate integrator makes of recorded momenta, and how much a shot amplifies errors.

#include "accuracy.hpp"

#include <cmath>

#include <Eigen/SVD>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "plain_options.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

Registration registered(const std::string& noise, const std::string& integrator, int steps, double displacement = 0.3) {
  Landmarks source, target;
  source.points = Numbers(2).landmarks(2, 6);
  target.points = source.points + displacement * Numbers(3)(2, 6);
  RegistrationOptions options = plain_options();
  options.noise = noise;
  options.integrator = integrator;
  options.grid = {0.7, steps};
  return register_shapes(source, target, options);
}

TEST(StepError, FallsWithTheOrderOfTheIntegrator) {
  struct Case {
    std::string noise, integrator;
    double least, most;  // by which factor the error falls
  };
  for (const Case& one : {Case{"none", "variational", 1.7, 2.5}, Case{"none", "midpoint", 3.5, 4.5},
                          Case{"none", "variational-2", 3.5, 4.5}, Case{"ch-sd:beta=0.5", "midpoint", 3.5, 4.5},
                          Case{"p-sd:beta=0.5,fields=grid,count=2,width=0.5", "midpoint", 3.5, 4.5}}) {
    const auto coarse = registered(one.noise, one.integrator, 20), fine = registered(one.noise, one.integrator, 40);
    EXPECT_GT(coarse.step_error->rms / fine.step_error->rms, one.least) << one.noise << ' ' << one.integrator;
    EXPECT_LT(coarse.step_error->rms / fine.step_error->rms, one.most) << one.noise << ' ' << one.integrator;
  }
}

// J of a long accurate shot, its energy by the same rule on ten times as many steps.
TEST(StepError, HasTheCostOfAnAccuratePath) {
  const Registration coarse = registered("none", "midpoint", 10, 1);
  const StochasticSystem system = registration_system(coarse);
  const TimeGrid grid{coarse.grid.time, 400};
  const Trajectory path = make_integrator("rk4")->integrate(system, {coarse.source.points, coarse.momenta}, grid,
                                                            Eigen::MatrixXd(0, grid.steps));
  const double energy = coarse.lambda * grid.time * hamiltonian(system.kernel, path.initial());  // H is conserved
  const double data = 0.5 * (path.final().q - coarse.target.points).squaredNorm() / (coarse.sigma * coarse.sigma);
  EXPECT_NEAR(coarse.cost.total() + coarse.step_error->cost, energy + data, 1e-4 * energy);
  EXPECT_GT(std::abs(coarse.step_error->cost), 1e-3 * energy);
}

TEST(Amplification, IsTheLargestSingularValueOfTheEndByTheStart) {
  for (const char* noise : {"none", "ch-sd:beta=0.5", "trouve-vialard:sigma=0.3"}) {
    const Registration registration = registered(noise, "auto", 40, 1);
    const StochasticSystem system = registration_system(registration);
    const auto integrator = make_integrator(registration.integrator);
    const Trajectory path = replay(registration);
    const Eigen::Index size = registration.momenta.size();
    Eigen::MatrixXd derivative(size, size);
    PathChange change;
    change.increments = Eigen::MatrixXd::Zero(path.increments.rows(), path.increments.cols());
    for (Eigen::Index i = 0; i < size; ++i) {
      change.initial = {Eigen::VectorXd::Unit(size, i).reshaped(2, size / 2), Points::Zero(2, size / 2)};
      derivative.col(i) = integrator->tangent(system, path, change).q.reshaped();
    }
    const double largest = Eigen::JacobiSVD<Eigen::MatrixXd>(derivative).singularValues()[0];
    EXPECT_GT(largest, 1.5) << noise;
    EXPECT_LE(*registration.amplification, 1.01 * largest) << noise;
    EXPECT_GE(*registration.amplification, 0.8 * largest) << noise;
  }
}

TEST(Amplification, OfLandmarksAtRestIsOne) {
  Landmarks shape;
  shape.points = Numbers(2).landmarks(2, 6);
  const Registration registration = register_shapes(shape, shape, plain_options());
  EXPECT_DOUBLE_EQ(*registration.amplification, 1);
  EXPECT_EQ(registration.step_error->rms, 0);
  EXPECT_EQ(registration.step_error->cost, 0);
}

TEST(StepError, IsOfOneRealisationAtMost) {
  RegistrationOptions options = plain_options();
  options.noise = "ch-sd:beta=0.1";
  options.mode = MatchingMode::kExpected;
  Landmarks source, target;
  source.points = Numbers(2).landmarks(2, 4);
  target.points = source.points + 0.1 * Numbers(3)(2, 4);
  const Registration registration = register_shapes(source, target, options);
  EXPECT_FALSE(registration.step_error);
  EXPECT_FALSE(registration.amplification);
}

}  // namespace
}  // namespace pulson::matching
