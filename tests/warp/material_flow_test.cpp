// The motion of the whole space under a landmark path: landmarks keep to their own, and points to their order.

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "material_flow_examples.hpp"

namespace pulson::warp {
namespace {

class MaterialFlowContract : public testing::TestWithParam<std::tuple<std::string, DefinedKernel, int>> {
 protected:
  const std::string integrator_ = std::get<0>(GetParam());
  const KernelOperator kernel_ = std::get<1>(GetParam()).make();
  const int d_ = std::get<2>(GetParam());
  const Points q0_ = spread_landmarks(d_);

  Motion motion(const std::string& noise) const { return random_motion(integrator_, kernel_, noise, d_); }

  // Simplices so small that the map is linear on them.
  void expect_orientation(const MaterialFlow& flow) const {
    const Points labels = 2 * random_points(d_, 500, 3);
    const double edge = 1e-6;
    const Points corner = flow.end(labels);
    std::vector<Points> edges;
    for (int axis = 0; axis < d_; ++axis)
      edges.emplace_back(flow.end(labels.colwise() + edge * Eigen::VectorXd::Unit(d_, axis)) - corner);
    for (Eigen::Index m = 0; m < labels.cols(); ++m) {
      Eigen::MatrixXd gradient(d_, d_);
      for (int axis = 0; axis < d_; ++axis) gradient.col(axis) = edges[static_cast<std::size_t>(axis)].col(m) / edge;
      EXPECT_GT(gradient.determinant(), 0) << labels.col(m).transpose();
    }
  }
};

std::vector<std::string> integrators_with_a_map() {
  return {"variational", "variational-paper", "variational-2", "midpoint", "heun"};
}

INSTANTIATE_TEST_SUITE_P(Tables, MaterialFlowContract,
                         testing::Combine(testing::ValuesIn(integrators_with_a_map()),
                                          testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param) + "_" + std::get<1>(instance.param).spec() +
                                            "_in_" + std::to_string(std::get<2>(instance.param)) + "d");
                         });

TEST_P(MaterialFlowContract, CarriesLandmarksOntoTheirOwnPath) {
  for (const std::string noise :
       {"none", "ch-sd:beta=0.5", "ch-sd:beta=2,on=2/3", "p-sd:beta=0.3,fields=grid,count=2",
        "p-sd:beta=0.3,fields=cos", "kunita:beta=0.3,width=0.6", "ch-sd-screened:beta=0.2,gamma=0.5",
        "ch-sd:beta=0.2+p-sd:beta=0.2,fields=cos", "trouve-vialard:sigma=0.01",
        "ch-sd-screened:beta=0.2,gamma=0.5+trouve-vialard:sigma=0.01+p-sd:beta=0.2"}) {
    const Motion motion = this->motion(noise);
    const std::vector<Points> paths = motion.flow().paths(q0_);
    ASSERT_EQ(paths.size(), motion.path.states.size());
    for (std::size_t k = 0; k < paths.size(); ++k)
      EXPECT_LE((paths[k] - motion.path.states[k].q).norm(), 1e-10) << noise << ", time " << k;
  }
}

TEST(MaterialFlow, CarriesLandmarksAlongWithSchemesThatTakeNoNoise) {
  for (const std::string integrator : {"rk4", "stormer-verlet"})
    for (const DefinedKernel& kernel : every_kernel())
      for (const int d : {1, 2, 3}) {
        const Motion motion = random_motion(integrator, kernel.make(), "none", d);
        const std::vector<Points> paths = motion.flow().paths(motion.path.initial().q);
        for (std::size_t k = 0; k < paths.size(); ++k)
          EXPECT_LE((paths[k] - motion.path.states[k].q).norm(), 1e-10) << integrator << ", " << kernel << ", " << d;
      }
}

TEST_P(MaterialFlowContract, EndIsTheLastPlace) {
  const MaterialFlow flow = motion("ch-sd:beta=0.5").flow();
  const Points labels = 2 * random_points(d_, 30, 3);
  const std::vector<Points> paths = flow.paths(labels);
  EXPECT_EQ(paths.front(), labels);
  EXPECT_EQ(paths.back(), flow.end(labels));
}

TEST_P(MaterialFlowContract, KeepsOrientationWithoutNoiseAndWithThatOfFields) {
  for (const std::string noise :
       {"none", "p-sd:beta=0.1,fields=grid,count=2", "kunita:beta=0.1,width=0.6", "trouve-vialard:sigma=0.01"})
    expect_orientation(motion(noise).flow());
}

TEST_P(MaterialFlowContract, IsTheIdentityAtRest) {
  const StochasticSystem system{kernel_, make_noise("none")};
  const Motion motion = move(integrator_, system, {q0_, Points::Zero(d_, 7)}, {1, 20}, Eigen::MatrixXd(0, 20));
  const Points labels = 2 * random_points(d_, 30, 3);
  EXPECT_EQ(motion.flow().end(labels), labels);
}

// With p = 0 and the same noise δ on all landmarks, x moves by Σ_a c_a(x) times δ.
TEST_P(MaterialFlowContract, CommonNoiseMovesPointsByTheSumOfTheCardinalFunctions) {
  const StochasticSystem system{kernel_, make_noise("ch-sd:beta=0.5")};
  const Points common = random_points(d_, 20, 4);
  const Motion motion = move(integrator_, system, {q0_, Points::Zero(d_, 7)}, {1, 20}, common.replicate(7, 1));
  const Points& end = motion.path.final().q;
  const Eigen::VectorXd shift = end.col(0) - q0_.col(0);
  EXPECT_LE(((end - q0_).colwise() - shift).norm(), 1e-13);
  const Points labels = 2 * random_points(d_, 30, 3);
  const Eigen::VectorXd share =
      kernel_.gram(labels, q0_) * kernel_.gram(q0_, q0_).partialPivLu().solve(Eigen::VectorXd::Ones(7));
  EXPECT_LE((motion.flow().end(labels) - (labels + shift * share.transpose())).norm(), 1e-10);
  EXPECT_LE((motion.flow().end(q0_) - end).norm(), 1e-10);
  const Points far = Points::Constant(d_, 1, 1e4);
  EXPECT_EQ(motion.flow().end(far), far);
}

// A step of size κ = Δt Lip(K)|p| < 1 past one landmark is a contraction: every point has its place, in order.
TEST_P(MaterialFlowContract, FindsEveryPlaceWhereStepsContract) {
  const TimeGrid grid{1, 2};
  const StochasticSystem system{kernel_, make_noise("none")};
  const Eigen::RowVectorXd along = Eigen::RowVectorXd::LinSpaced(401, -4, 4);
  for (const double kappa : {0.3, 0.6, 0.95}) {
    Points p0 = Points::Zero(d_, 1);
    p0(0) = kappa / (grid.dt() * kernel_.lipschitz());
    Points labels = Points::Zero(d_, 401);
    labels.row(0) = along;
    const Motion motion = move(integrator_, system, {Points::Zero(d_, 1), p0}, grid, Eigen::MatrixXd(0, 2));
    const Points end = motion.flow().end(labels);
    EXPECT_NEAR(end(0, 200), motion.path.final().q(0), 1e-10) << kappa;
    for (int m = 1; m < 401; ++m) EXPECT_LT(end(0, m - 1), end(0, m)) << kappa << ", " << along[m];
  }
}

// Noise that swaps two landmarks on a line: the points between them are flipped, and those outside stay in order.
TEST(MaterialFlow, TakesPointsBetweenSwappedLandmarksAlong) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.3", Points()), make_noise("ch-sd:beta=1")};
  const Points q0 = (Points(1, 2) << 0, 1).finished();
  const Points increments = (Points(2, 2) << 1, 0, -1, 0).finished();
  const Motion motion = move("variational", system, {q0, Points::Zero(1, 2)}, {1, 2}, increments);
  const Points end = motion.flow().end((Points(1, 6) << -2, 0, 0.45, 0.55, 1, 3).finished());
  EXPECT_NEAR(end(1), 1, 1e-12);
  EXPECT_NEAR(end(4), 0, 1e-12);
  EXPECT_EQ(end(0), -2);
  EXPECT_NEAR(end(5), 3, 1e-12);
}

// Steps of many widths have several roots: the right one or an error, but nothing else.
TEST(MaterialFlow, CarriesLandmarksOverLongStepsOrRefuses) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.1", Points()), make_noise("none")};
  for (const double momentum : {0.5, 2.0, 10.0}) {
    const PhaseState initial{Points::Zero(1, 1), Points::Constant(1, 1, momentum)};
    const Motion motion = move("variational", system, initial, {1, 4}, Eigen::MatrixXd(0, 4));
    try {
      const Points end = motion.flow().end((Points(1, 3) << -0.01, 0, 0.01).finished());
      EXPECT_NEAR(end(1), motion.path.final().q(0), 1e-10) << momentum;
      EXPECT_LT(end(0), end(1)) << momentum;
      EXPECT_LT(end(1), end(2)) << momentum;
    } catch (const StepError&) {
    }
  }
}

}  // namespace
}  // namespace pulson::warp
