// The contracts of KernelOperator for every kernel: the sums against plain loops over pairs, and the derivatives
// against automatic differentiation of the definition.

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Eigenvalues>
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pair_loops.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

// Around the lane counts of every vector target (2, 4, 8) and around the block of 64 targets.
const std::vector<int> kCounts = {1, 2, 3, 7, 8, 9, 63, 64, 65, 130};

class KernelContract : public testing::TestWithParam<std::tuple<DefinedKernel, int>> {
 protected:
  const DefinedKernel definition_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const KernelOperator kernel_ = definition_.make();

  void expect_field_sums(const Points& x, const Points& y, const Points& p) const {
    pulson::expect_field_sums(definition_, kernel_, x, y, p);
  }
  void expect_self_sums(const Points& q, const Points& a, const Points& p, const Points& delta) const {
    pulson::expect_self_sums(definition_, kernel_, q, a, p, delta);
  }
};

INSTANTIATE_TEST_SUITE_P(Table, KernelContract,
                         testing::Combine(testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param).spec() + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

// ---- sums

TEST_P(KernelContract, FieldsAreSumsOverTheSources) {
  for (const int targets : kCounts) {
    for (const int sources : {1, 5, targets}) {
      SCOPED_TRACE(std::to_string(targets) + " targets, " + std::to_string(sources) + " sources");
      expect_field_sums(random_points(d_, targets, 1), random_points(d_, sources, 2), random_points(d_, sources, 3));
    }
  }
}

TEST_P(KernelContract, DerivativesAreSumsOverPairs) {
  for (const int count : kCounts) {
    SCOPED_TRACE(std::to_string(count) + " landmarks");
    expect_self_sums(random_points(d_, count, 1), random_points(d_, count, 2), random_points(d_, count, 3),
                     random_points(d_, count, 4));
  }
}

TEST_P(KernelContract, CoincidentPointsAreAtTheTopOfTheKernel) {
  Points q = random_points(d_, 9, 1);
  q.col(8) = q.col(0);
  q.col(4) = q.col(0);
  expect_field_sums(q, q, random_points(d_, 9, 3));
  expect_self_sums(q, random_points(d_, 9, 2), random_points(d_, 9, 3), random_points(d_, 9, 4));
  EXPECT_EQ(kernel_.gradient(Points::Zero(d_, 3), Points::Ones(d_, 3), Points::Ones(d_, 3)), Points::Zero(d_, 3));
}

TEST_P(KernelContract, GramIsTheKernelOfEachPair) {
  const Points x = random_points(d_, 5, 1);
  const Points y = random_points(d_, 7, 2);
  const Eigen::MatrixXd gram = kernel_.gram(x, y);
  ASSERT_EQ(gram.rows(), 5);
  ASSERT_EQ(gram.cols(), 7);
  for (Eigen::Index i = 0; i < 5; ++i)
    for (Eigen::Index j = 0; j < 7; ++j)
      EXPECT_NEAR(gram(i, j), definition_.value((x.col(i) - y.col(j)).norm()), 1e-14 * kernel_.at_zero());
}

TEST_P(KernelContract, GramIsPositiveDefinite) {
  Points q(d_, static_cast<Eigen::Index>(std::pow(4, d_)));  // a lattice, a little shaken
  for (Eigen::Index i = 0; i < q.cols(); ++i)
    for (int axis = 0; axis < d_; ++axis) q(axis, i) = 0.7 * static_cast<double>((i >> (2 * axis)) % 4);
  q += 0.1 * random_points(d_, static_cast<int>(q.cols()), 1);
  const Eigen::VectorXd eigenvalues = kernel_.gram(q, q).selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_GT(eigenvalues.minCoeff(), 1e-10 * eigenvalues.maxCoeff());
}

TEST_P(KernelContract, MatricesEqualTheProducts) {
  for (const int count : {1, 2, 9}) {
    const Points q = random_points(d_, count, 1);
    const Points p = random_points(d_, count, 2);
    const Points delta = random_points(d_, count, 3);
    const auto [gram, tangent, hessian] = kernel_.step_matrices(q, p, 1);
    const StepMatrices by_axis = kernel_.step_matrices(q, p, 0.25, CoordinateOrder::kByAxis);
    EXPECT_LE((gram - kernel_.gram(q, q)).norm(), 1e-14 * gram.norm()) << count;
    EXPECT_EQ(by_axis.gram, 0.25 * gram) << count;
    for (Eigen::Index i = 0; i < q.size(); ++i)
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Eigen::Index row = i % d_ * count + i / d_, column = j % d_ * count + j / d_;
        EXPECT_EQ(by_axis.tangent(row, column), 0.25 * tangent(i, j)) << count;
        EXPECT_EQ(by_axis.hessian(row, column), 0.25 * hessian(i, j)) << count;
      }
    const Eigen::VectorXd tangent_product = kernel_.apply_tangent(q, p, delta).reshaped();
    const Eigen::VectorXd hessian_product = kernel_.hessian(q, p, delta).reshaped();
    EXPECT_LE((tangent * delta.reshaped() - tangent_product).norm(), 1e-13 * tangent.norm()) << count;
    EXPECT_LE((hessian * delta.reshaped() - hessian_product).norm(), 1e-13 * hessian.norm()) << count;
    EXPECT_LE((hessian - hessian.transpose()).norm(), 1e-14 * hessian.norm()) << count;
  }
}

// exp(−708) is the smallest of the vector exponential; the scalar one goes on to 0.
TEST_P(KernelContract, ScalarsEqualVectorsAtEveryDistance) {
  const Points p = random_points(d_, 2, 2);
  const Points delta = random_points(d_, 2, 3);
  const double dots = std::abs(p.col(0).dot(p.col(1)));
  for (const double r : {1e-100, 1e-30, 1e-9, 1e-4, 0.1, 1.0, 10.0, 100.0, 300.0, 1e3, 1e6}) {
    Points q = Points::Zero(d_, 2);
    q.col(1) = r * random_points(d_, 1, 1).col(0).normalized();
    const auto expect_near = [r](const Eigen::MatrixXd& actual, const Eigen::MatrixXd& expected, double size) {
      EXPECT_LE((actual - expected).norm(), 1e-12 * size + 1e-280) << r << "\n" << actual << "\n\n" << expected;
    };
    const RadialJet k = kernel_.jet(q.col(1).squaredNorm());
    const StepMatrices step = kernel_.step_matrices(q, p, 1);
    const Points velocities = p * kernel_.gram(q, q);
    expect_near(kernel_.apply(q, q, p), velocities, velocities.norm());
    const Points tangent = (step.tangent * delta.reshaped()).reshaped(d_, 2);
    expect_near(kernel_.apply_tangent(q, p, delta), tangent, tangent.norm());
    const Points gradient = 2 * p.col(0).dot(p.col(1)) * k.first * (q.col(0) - q.col(1));
    expect_near(kernel_.gradient(q, p, p).col(0), gradient, gradient.norm());
    const Points hessian = (step.hessian * delta.reshaped()).reshaped(d_, 2);
    expect_near(kernel_.hessian(q, p, delta), hessian,
                dots * (std::abs(k.first) + std::abs(k.second) * r * r) * delta.norm());
  }
}

TEST_P(KernelContract, HugeDistancesGiveNumbers) {
  for (const double r : {1e6, 1e30, 1e100, 1e150}) {
    Points q = Points::Zero(d_, 2);
    q.col(1).setConstant(r);
    const Points p = random_points(d_, 2, 1);
    Eigen::MatrixXd jacobian;
    EXPECT_TRUE(kernel_.apply_with_jacobian(q, q, p, jacobian).allFinite()) << r;
    EXPECT_TRUE(jacobian.allFinite()) << r;
    EXPECT_TRUE(kernel_.apply_tangent(q, p, p).allFinite()) << r;
    EXPECT_TRUE(kernel_.gradient(q, p, p).allFinite()) << r;
    EXPECT_TRUE(kernel_.hessian(q, p, random_points(d_, 2, 2)).allFinite()) << r;
    EXPECT_NEAR(kernel_.gram(q.col(0), q.col(1)).value(), 0, 1e-300) << r;
    EXPECT_EQ(kernel_.step_matrices(q, p, 1).tangent, Eigen::MatrixXd::Zero(2 * d_, 2 * d_)) << r;
    EXPECT_EQ(kernel_.step_matrices(q, p, 1).hessian, Eigen::MatrixXd::Zero(2 * d_, 2 * d_)) << r;
  }
}

// ---- derivatives

TEST_P(KernelContract, SmallDistancesHaveTheLimitsOfTheDefinition) {
  const RadialJet limit = definition_.factors(0);
  for (const double r : {0.0, 1e-100, 1e-30, 1e-9}) {
    const RadialJet jet = kernel_.jet(r * r);
    EXPECT_NEAR(jet.value, kernel_.at_zero(), 1e-15 * kernel_.at_zero() + 2 * kernel_.lipschitz() * r) << r;
    if (!definition_.smooth()) continue;
    EXPECT_NEAR(jet.first, limit.first, 1e-7 * std::abs(limit.first)) << r;
    EXPECT_LE(std::abs(jet.second) * r * r, 1e-7 * std::abs(limit.first)) << r;
  }
}

TEST_P(KernelContract, JetIsTheDerivativeOfTheDefinition) {
  using First = ceres::Jet<long double, 3>;  // the digits of smooth kernels cancel at small r
  using Second = ceres::Jet<First, 3>;
  for (const double r : {1e-3, 0.1, 0.5, 1.0, 3.0}) {
    const Eigen::VectorXd z = r * random_points(d_, 1, 1).col(0).normalized();
    Second squared(First(0));
    for (int axis = 0; axis < d_; ++axis) {
      Second coordinate(First(z[axis], axis));
      coordinate.v[axis] = First(1);
      squared += coordinate * coordinate;
    }
    const Second k = definition_.value(Second(sqrt(squared)));
    const RadialJet jet = kernel_.jet(z.squaredNorm());
    EXPECT_NEAR(jet.value, static_cast<double>(k.a.a), 1e-14 * kernel_.at_zero()) << r;
    const double size = std::abs(jet.first) + std::abs(jet.second) * r * r;
    for (int e = 0; e < d_; ++e) {
      EXPECT_NEAR(jet.first * z[e], static_cast<double>(k.v[e].a), 1e-13 * size * r) << r;
      for (int f = 0; f < d_; ++f) {
        const auto expected = static_cast<double>(k.v[e].v[f]);
        EXPECT_NEAR((e == f ? jet.first : 0) + jet.second * z[e] * z[f], expected, 1e-13 * size) << r;
      }
    }
  }
}

TEST_P(KernelContract, TangentIsTheDerivativeOfApply) {
  using Jet = ceres::Jet<double, 1>;
  const Points q = random_points(d_, 9, 1);
  const Points p = random_points(d_, 9, 2);
  const Points delta = random_points(d_, 9, 3);
  PointsOf<Jet> moving = q.cast<Jet>();
  for (Eigen::Index i = 0; i < q.size(); ++i) moving(i).v[0] = delta(i);
  const PointsOf<Jet> u = velocities<Jet>(definition_, moving, p.cast<Jet>());
  const Points tangent = kernel_.apply_tangent(q, p, delta);
  for (Eigen::Index i = 0; i < q.size(); ++i) EXPECT_NEAR(tangent(i), u(i).v[0], 1e-13 * tangent.norm());
}

TEST_P(KernelContract, GradientIsTheTransposeOfTheTangent) {
  for (const int count : {2, 9, 65}) {
    const Points q = random_points(d_, count, 1);
    const Points a = random_points(d_, count, 2);
    const Points p = random_points(d_, count, 3);
    const Points delta = random_points(d_, count, 4);
    const Points tangent = kernel_.apply_tangent(q, p, delta);
    const Points gradient = kernel_.gradient(q, a, p);
    EXPECT_NEAR(a.cwiseProduct(tangent).sum(), gradient.cwiseProduct(delta).sum(),
                1e-12 * (a.norm() * tangent.norm() + gradient.norm() * delta.norm()));
  }
}

TEST_P(KernelContract, HessianIsTheSecondDerivativeOfTheEnergy) {
  constexpr int kCount = 4;
  using Along = ceres::Jet<double, 1>;
  using Jet = ceres::Jet<Along, 3 * kCount>;
  const Points q = random_points(d_, kCount, 1);
  const Points p = random_points(d_, kCount, 2);
  const Points delta = random_points(d_, kCount, 3);
  PointsOf<Jet> moving(d_, kCount);
  PointsOf<Jet> momenta(d_, kCount);
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    moving(i) = Jet(Along(q(i)), static_cast<int>(i));
    moving(i).a.v[0] = delta(i);
    momenta(i) = Jet(Along(p(i)));
  }
  const Jet h = energy<Jet>(definition_, moving, momenta);
  const Points gradient = 0.5 * kernel_.gradient(q, p, p);
  const Points hessian = kernel_.hessian(q, p, delta);
  for (int i = 0; i < q.size(); ++i) {
    EXPECT_NEAR(gradient(i), h.v[i].a, 1e-13 * gradient.norm());
    EXPECT_NEAR(hessian(i), h.v[i].v[0], 1e-13 * hessian.norm());
  }
}

TEST_P(KernelContract, HessianIsSymmetric) {
  const Points q = random_points(d_, 65, 1);
  const Points p = random_points(d_, 65, 2);
  const Points a = random_points(d_, 65, 3);
  const Points b = random_points(d_, 65, 4);
  const Points ha = kernel_.hessian(q, p, a);
  const Points hb = kernel_.hessian(q, p, b);
  EXPECT_NEAR(ha.cwiseProduct(b).sum(), hb.cwiseProduct(a).sum(),
              1e-12 * (ha.norm() * b.norm() + hb.norm() * a.norm()));
}

// ---- bounds

TEST_P(KernelContract, AtZeroIsTheSumOfTheWeights) { EXPECT_EQ(kernel_.at_zero(), definition_.value(0.0)); }

TEST_P(KernelContract, LipschitzBoundsTheSlopeAndIsTightForOneTerm) {
  double steepest = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double r = 1e-8 + 1e-4 * i;
    steepest = std::max(steepest, std::abs(definition_.factors(r).first * r));
  }
  EXPECT_LE(steepest, kernel_.lipschitz() * (1 + 1e-14));
  if (definition_.terms.size() == 1) {
    EXPECT_GE(steepest, kernel_.lipschitz() * (1 - 1e-6));
  }
}

TEST_P(KernelContract, FarPointsDoNotFeelEachOther) {
  Points q = Points::Zero(d_, 2);
  q.col(1).setConstant(1e3 * 1.25);  // at least a thousand times every width
  const Points p = 0.1 * random_points(d_, 2, 1);
  const Points delta = random_points(d_, 2, 2);
  Eigen::MatrixXd jacobian;
  const auto vanishes = [](const Eigen::MatrixXd& x) { return (x.array().abs() <= 1e-300).all(); };  // false for NaN
  EXPECT_TRUE(vanishes(kernel_.apply(q.col(1), q.col(0), p.col(0))));
  EXPECT_TRUE(vanishes(kernel_.apply_with_jacobian(q.col(1), q.col(0), p.col(0), jacobian)));
  EXPECT_TRUE(vanishes(jacobian));
  EXPECT_TRUE(vanishes(kernel_.apply_tangent(q, p, delta)));
  EXPECT_TRUE(vanishes(kernel_.gradient(q, p, p)));
  EXPECT_TRUE(vanishes(kernel_.hessian(q, p, delta)));
  EXPECT_TRUE(vanishes(kernel_.gram(q.col(0), q.col(1))));
}

}  // namespace
}  // namespace pulson
