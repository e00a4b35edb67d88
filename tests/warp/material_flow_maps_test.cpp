// The map of space under a landmark path as a map: its gradient, its inverse, and what is interpolated between labels.

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "material_flow_examples.hpp"

namespace pulson::warp {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kDiffeomorphisms = {"none", "p-sd:beta=0.2,fields=grid,count=2",
                                                   "p-sd:beta=0.2,fields=cos", "kunita:beta=0.2,width=0.6",
                                                   "trouve-vialard:sigma=0.05"};

// ∂X(T)/∂x by central differences of order 4, columns of d×d.
Eigen::MatrixXd differences(const MaterialFlow& flow, const Points& labels) {
  const Eigen::Index d = labels.rows();
  const double h = 1e-3;
  Eigen::MatrixXd gradients(d * d, labels.cols());
  for (Eigen::Index axis = 0; axis < d; ++axis) {
    const auto around = [&](double step) -> Points {
      const Eigen::VectorXd shift = step * Eigen::VectorXd::Unit(d, axis);
      return flow.end(labels.colwise() + shift) - flow.end(labels.colwise() - shift);
    };
    gradients.middleRows(axis * d, d) = (8 * around(h) - around(2 * h)) / (12 * h);
  }
  return gradients;
}

class MaterialMap : public testing::TestWithParam<std::tuple<std::string, int>> {
 protected:
  Motion motion(const std::string& noise) const { return random_motion(integrator_, kernel_, noise, d_); }
  bool takes_noise() const { return make_integrator(integrator_)->traits().noise; }

  // Of these, what the integrator takes.
  std::vector<std::string> taken(const std::vector<std::string>& noises) const {
    return takes_noise() ? noises : std::vector<std::string>{"none"};
  }

  const std::string integrator_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const KernelOperator kernel_ = make_kernel("gaussian:alpha=0.7+matern52:alpha=1.5,weight=0.4", Points());
  const Points labels_ = 2 * random_points(d_, 40, 3);
};

INSTANTIATE_TEST_SUITE_P(Integrators, MaterialMap,
                         testing::Combine(testing::Values("variational", "variational-paper", "variational-2",
                                                          "midpoint", "heun", "rk4", "stormer-verlet"),
                                          testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param) + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(MaterialMap, GradientsAreThoseOfTheEnd) {
  std::vector<std::string> noises = kDiffeomorphisms;
  for (const char* folding : {"ch-sd:beta=0.5", "ch-sd:beta=1,on=2/3", "ch-sd-screened:beta=0.2,gamma=0.5",
                              "ch-sd:beta=0.2+p-sd:beta=0.2,fields=cos+trouve-vialard:sigma=0.01",
                              "ch-sd:beta=0.2+kunita:beta=0.2,width=0.6"})
    noises.emplace_back(folding);
  for (const std::string& noise : taken(noises))
    for (const LabelKernel kernel : {LabelKernel::kMetric, LabelKernel::kThinPlate}) {
      const MaterialFlow flow = motion(noise).flow(kernel);
      const MovedPoints moved = flow.end_with_gradients(labels_);
      EXPECT_LE((moved.places - flow.end(labels_)).norm(), 1e-12 * labels_.norm()) << noise;
      EXPECT_LE((moved.gradients - differences(flow, labels_)).norm(), 1e-6 * moved.gradients.norm())
          << noise << ", " << label_kernel_name(kernel);
    }
}

TEST_P(MaterialMap, InverseUndoesTheMapAndItsGradient) {
  for (const std::string& noise : taken(kDiffeomorphisms)) {
    const MaterialFlow flow = motion(noise).flow();
    ASSERT_TRUE(flow.is_diffeomorphic()) << noise;
    const MovedPoints there = flow.end_with_gradients(labels_);
    const MovedPoints back = flow.inverse(there.places);
    const double size = labels_.cwiseAbs().maxCoeff();
    EXPECT_LE((back.places - labels_).cwiseAbs().maxCoeff(), 1e-12 * size) << noise;
    EXPECT_LE((flow.end(flow.inverse(labels_).places) - labels_).cwiseAbs().maxCoeff(), 1e-12 * size) << noise;
    EXPECT_GT(there.jacobians().minCoeff(), 0) << noise;
    for (Eigen::Index m = 0; m < labels_.cols(); ++m) {
      const Eigen::MatrixXd product = there.gradients.col(m).reshaped(d_, d_) * back.gradients.col(m).reshaped(d_, d_);
      EXPECT_LE((product - Eigen::MatrixXd::Identity(d_, d_)).norm(), 1e-10) << noise;
    }
  }
}

TEST_P(MaterialMap, SmallestJacobianIsThatOfDifferences) {
  const int side = d_ == 1 ? 400 : d_ == 2 ? 20 : 8;
  Points grid(d_, static_cast<Eigen::Index>(std::pow(side, d_)));
  for (Eigen::Index m = 0; m < grid.cols(); ++m) {
    Eigen::Index rest = m;
    for (int axis = 0; axis < d_; ++axis, rest /= side)
      grid(axis, m) = -2 + 4 * static_cast<double>(rest % side) / (side - 1);
  }
  const MaterialFlow flow = motion(taken({"p-sd:beta=0.2,fields=cos"}).front()).flow();
  const MovedPoints by_differences{grid, differences(flow, grid)};
  const double least = flow.end_with_gradients(grid).jacobians().minCoeff();
  EXPECT_GT(least, 0);
  EXPECT_NEAR(least, by_differences.jacobians().minCoeff(), 1e-6);
}

TEST_P(MaterialMap, RefusesTheInverseOfWhatMayFold) {
  if (!takes_noise()) return;
  const MaterialFlow flow = motion("ch-sd:beta=0.5").flow();
  EXPECT_FALSE(flow.is_diffeomorphic());
  EXPECT_THAT(error_of([&] { flow.inverse(labels_); }), HasSubstr("no inverse"));
}

// ---- labels

// At rest, noise that moves every landmark from q to q + A q + b.
Motion affine_motion(const std::string& integrator, const Points& q0, const Eigen::MatrixXd& a,
                     const Eigen::VectorXd& b) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.7", Points()), make_noise("ch-sd:beta=1")};
  Eigen::MatrixXd increments = Eigen::MatrixXd::Zero(q0.size(), 2);
  increments.col(0) = ((a * q0).colwise() + b).reshaped();
  return move(integrator, system, {q0, Points::Zero(q0.rows(), q0.cols())}, {1, 2}, increments);
}

TEST(LabelSpaces, ThinPlateCarriesSpaceByTheAffineMapOfTheLandmarksAndTheMetricDoesNot) {
  for (const std::string integrator : {"variational", "midpoint", "heun"})
    for (const int d : {1, 2, 3}) {
      const Points q0 = spread_landmarks(d);
      const Eigen::MatrixXd a = 0.3 * random_points(d, d, 21);
      const Eigen::VectorXd b = random_points(d, 1, 22);
      const Motion motion = affine_motion(integrator, q0, a, b);
      const Points labels = 5 * random_points(d, 30, 3);
      const Points right = labels + ((a * labels).colwise() + b);
      ASSERT_LE((motion.path.final().q - q0 - ((a * q0).colwise() + b)).norm(), 1e-12) << integrator << ", " << d;
      const MaterialFlow flow = motion.flow(LabelKernel::kThinPlate);
      EXPECT_LE((flow.end(labels) - right).norm(), 1e-10 * right.norm()) << integrator << ", " << d;
      EXPECT_LE(flow.landmark_error(), 1e-11);
      const Eigen::MatrixXd gradient = Eigen::MatrixXd::Identity(d, d) + a;
      EXPECT_LE((flow.end_with_gradients(labels).gradients.colwise() - gradient.reshaped()).norm(), 1e-9);
      EXPECT_GT((motion.flow().end(labels) - right).norm(), 0.1 * right.norm());
      EXPECT_LE(motion.flow().landmark_error(), 1e-11);
    }
}

TEST(LabelSpaces, ThinPlateRefusesLandmarksOnALine) {
  const Points line = (Points(2, 4) << 0, 1, 2, 4, 1, 3, 5, 9).finished();
  const Motion motion = affine_motion("variational", line, Eigen::Matrix2d::Identity(), Eigen::Vector2d(1, 0));
  EXPECT_THAT(error_of([&] { motion.flow(LabelKernel::kThinPlate); }), HasSubstr("do not all lie on one line"));
  EXPECT_LE(motion.flow().landmark_error(), 1e-10);
}

// Landmarks that are nearly at one place and that noise pulls apart cannot both be met; the error tells by how much.
TEST(LabelSpaces, RidgeIsTold) {
  Points q0 = spread_landmarks(2);
  q0.col(1) = q0.col(0) + Eigen::Vector2d(1e-9, 0);
  const StochasticSystem system{make_kernel("gaussian:alpha=0.7", Points()), make_noise("ch-sd:beta=1")};
  Points shift = Points::Zero(2, 7);
  shift.col(0) << 0.2, 0;
  shift.col(1) << -0.2, 0;
  Eigen::MatrixXd increments = Eigen::MatrixXd::Zero(14, 2);
  increments.col(0) = shift.reshaped();
  const Motion motion = move("variational", system, {q0, Points::Zero(2, 7)}, {1, 2}, increments);
  const MaterialFlow flow = motion.flow();
  EXPECT_GT(flow.ridge(), 0);
  const double missed = (flow.end(q0) - motion.path.final().q).colwise().norm().maxCoeff();
  EXPECT_GT(missed, 0.19);
  EXPECT_NEAR(flow.landmark_error(), missed, 1e-12);
  const Eigen::Vector2d still(0, 0);
  EXPECT_EQ(affine_motion("variational", spread_landmarks(2), Eigen::Matrix2d::Identity(), still).flow().ridge(), 0);
}

// By sweeps, and, of the same kernel as a sum of two halves, by a matrix; two labels coincide, so that there is a
// ridge.
TEST(LabelSpaces, AlongALineAreThoseOfTheDenseMatrix) {
  constexpr int kLabels = 80;
  for (const char* kernel : {"peakon", "matern32", "matern52"}) {
    for (const bool coincident : {false, true}) {
      Points labels(1, kLabels), delta(1, kLabels), x(1, 7);
      for (int a = 0; a < kLabels; ++a) {
        labels(a) = a * 37 % kLabels + 0.3 * std::sin(3.0 * a);
        delta(a) = std::cos(0.1 * labels(a));
      }
      x << -3, 0, 1.5, 20, 40.2, 79, 90;
      if (coincident) {
        labels(3) = labels(5);
        delta(3) = delta(5);
      }
      const std::string spec = std::string(kernel) + ":alpha=2", half = spec + ",weight=0.5";
      const auto sweeps = LabelSpace::make(LabelKernel::kMetric, make_kernel(spec), labels);
      const auto dense = LabelSpace::make(LabelKernel::kMetric, make_kernel(half + "+" + half), labels);
      EXPECT_EQ(sweeps->ridge() > 0, coincident) << kernel;
      EXPECT_NEAR(sweeps->ridge(), dense->ridge(), 1e-10 * dense->ridge()) << kernel;
      const Points by_sweeps = sweeps->coefficients(delta) * sweeps->basis(x);
      const Points by_matrix = dense->coefficients(delta) * dense->basis(x);
      EXPECT_LE((by_sweeps - by_matrix).norm(), 1e-8 * by_matrix.norm()) << kernel;
    }
  }
}

TEST(LabelSpaces, HaveNames) {
  for (const LabelKernel kernel : {LabelKernel::kMetric, LabelKernel::kThinPlate})
    EXPECT_EQ(parse_label_kernel(label_kernel_name(kernel)), kernel);
  EXPECT_EQ(error_of([] { parse_label_kernel("plate"); }), "unknown interpolation 'plate'; valid: metric, thin-plate");
}

}  // namespace
}  // namespace pulson::warp
