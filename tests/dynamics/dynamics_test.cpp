// The Hamiltonian's gradients against automatic differentiation, and what bounds its steps.

#include <algorithm>
#include <string>
#include <tuple>

#include <Eigen/Core>
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {
namespace {

class HamiltonianContract : public testing::TestWithParam<std::tuple<DefinedKernel, int>> {
 protected:
  const DefinedKernel definition_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const KernelOperator kernel_ = definition_.make();
};

INSTANTIATE_TEST_SUITE_P(Table, HamiltonianContract,
                         testing::Combine(testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param).spec() + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(HamiltonianContract, HasTheGradientsOfItsDefinition) {
  constexpr int kCount = 5;
  using Jet = ceres::Jet<double, 2 * 3 * kCount>;
  const PhaseState state{random_points(d_, kCount, 1), random_points(d_, kCount, 2)};
  const int size = static_cast<int>(state.q.size());
  PointsOf<Jet> q(d_, kCount);
  PointsOf<Jet> p(d_, kCount);
  for (int i = 0; i < size; ++i) {
    q(i) = Jet(state.q(i), i);
    p(i) = Jet(state.p(i), size + i);
  }
  const Jet h = energy<Jet>(definition_, q, p);
  const Points h_q = hamiltonian_q(kernel_, state.q, state.p);
  const Points h_p = hamiltonian_p(kernel_, state.q, state.p);
  EXPECT_NEAR(hamiltonian(kernel_, state), h.a, 1e-14 * state.p.squaredNorm() * kernel_.at_zero());
  for (int i = 0; i < size; ++i) {
    EXPECT_NEAR(h_q(i), h.v[i], 1e-13 * h_q.norm());
    EXPECT_NEAR(h_p(i), h.v[size + i], 1e-13 * h_p.norm());
  }
}

TEST_P(HamiltonianContract, ContractionBoundOfTwoLandmarksIsTheirMomentumDifference) {
  const Points p = random_points(d_, 2, 1);
  const double expected = 0.05 * (p.col(0) - p.col(1)).norm() * kernel_.lipschitz();
  EXPECT_NEAR(contraction_bound(kernel_, p, 0.05), expected, 1e-15 * expected);
  EXPECT_EQ(contraction_bound(kernel_, p.leftCols(1), 0.05), 0);
}

// Of landmarks without momentum two stand for all.
TEST_P(HamiltonianContract, ContractionBoundIsTheLargestOverAllPairs) {
  const auto expect_largest = [&](const Points& p) {
    double largest = 0;
    for (Eigen::Index a = 0; a < p.cols(); ++a)
      for (Eigen::Index b = 0; b < a; ++b) {
        double others = 0;
        for (Eigen::Index c = 0; c < p.cols(); ++c)
          if (c != a && c != b) others += p.col(c).norm();
        largest = std::max(largest, (p.col(a) - p.col(b)).norm() + 2 * others);
      }
    const double expected = 0.05 * kernel_.lipschitz() * largest;
    EXPECT_NEAR(contraction_bound(kernel_, p, 0.05), expected, 1e-14 * expected);
  };
  for (const int count : {1, 2, 3, 7}) {
    for (unsigned moving = 0; moving < (1U << count); ++moving) {
      SCOPED_TRACE(std::to_string(count) + " landmarks, with momenta: " + std::to_string(moving));
      Points p = random_points(d_, count, moving);
      for (int a = 0; a < count; ++a)
        if ((moving >> a & 1U) == 0) p.col(a).setZero();
      expect_largest(p);
    }
  }
}

// The largest change of a gap of dt K(q)p, over the largest change of a gap of q.
TEST_P(HamiltonianContract, ContractionBoundBoundsTheChangeOfGaps) {
  const double dt = 0.05;
  for (const int count : {2, 3, 8}) {
    const auto largest_gap = [count](const Points& x) {
      double largest = 0;
      for (Eigen::Index a = 0; a < count; ++a)
        largest = std::max(largest, (x.colwise() - x.col(a)).colwise().norm().maxCoeff());
      return largest;
    };
    for (unsigned seed = 0; seed < 50; ++seed) {
      const Points p = random_points(d_, count, 3 * seed);
      const Points q = random_points(d_, count, 3 * seed + 1);
      const Points r = q + (seed % 2 == 0 ? 1 : 1e-3) * random_points(d_, count, 3 * seed + 2);
      const Points change = dt * (hamiltonian_p(kernel_, r, p) - hamiltonian_p(kernel_, q, p));
      EXPECT_LE(largest_gap(change), contraction_bound(kernel_, p, dt) * largest_gap(r - q)) << count << ", " << seed;
    }
  }
}

}  // namespace
}  // namespace pulson
