// Products with a stored symmetric matrix and solves with its factor, against Eigen's, on every vector target.

#include "kernels/symmetric_matrix.hpp"

#include <cstdint>
#include <string>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "forced_target.hpp"
#include "kernel_definition.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd positive_definite(Index n) {
  const MatrixXd root = random_points(static_cast<int>(n), static_cast<int>(n), 1);
  return root * root.transpose() + MatrixXd::Identity(n, n);
}

// Around the lanes of each target (2, 4, 8) and the two columns that are read together.
class SymmetricMatrix : public testing::TestWithParam<std::int64_t> {
 protected:
  const ForcedTarget forced_{GetParam()};

  template <class Check>
  void for_every_size(const Check& check) const {
    for (const int n : {1, 2, 3, 7, 8, 9, 16, 17, 65, 130})
      for (const int columns : {1, 2, 3, 4}) {
        SCOPED_TRACE(std::to_string(n) + " rows, " + std::to_string(columns) + " columns");
        check(positive_definite(n), MatrixXd(random_points(n, columns, 2)));
      }
  }
};

INSTANTIATE_TEST_SUITE_P(Targets, SymmetricMatrix, testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& instance) { return std::string(hwy::TargetName(instance.param)); });

TEST_P(SymmetricMatrix, ProductsAreThoseOfTheTriangleAboveTheDiagonal) {
  for_every_size([](const MatrixXd& a, const MatrixXd& x) {
    MatrixXd stored = a;
    stored.triangularView<Eigen::Lower>().setConstant(1e3);  // is not read
    const MatrixXd product = symmetric_product(stored, a.diagonal(), x);
    EXPECT_LE((product - a * x).cwiseAbs().maxCoeff(), 1e-14 * (a.cwiseAbs() * x.cwiseAbs()).maxCoeff());
  });
}

TEST_P(SymmetricMatrix, SolvesAreThoseOfTheFactor) {
  for_every_size([](const MatrixXd& a, const MatrixXd& x) {
    MatrixXd stored = a;
    ASSERT_TRUE(factorise_in_place(stored));
    EXPECT_EQ(MatrixXd(stored.triangularView<Eigen::StrictlyUpper>()),
              MatrixXd(a.triangularView<Eigen::StrictlyUpper>()));
    MatrixXd solved = a * x;
    solve_factorised(stored, solved);
    // The condition of A is at most its norm, since its least eigenvalue is at least 1.
    EXPECT_LE((solved - x).norm(), 1e-14 * a.norm() * x.norm() * static_cast<double>(a.rows()));
  });
}

TEST(FactoriseInPlace, RefusesIndefiniteMatrices) {
  MatrixXd indefinite = positive_definite(5);
  indefinite(3, 3) = -1;
  EXPECT_FALSE(factorise_in_place(indefinite));
  MatrixXd none(0, 0);
  EXPECT_TRUE(factorise_in_place(none));
}

}  // namespace
}  // namespace pulson
