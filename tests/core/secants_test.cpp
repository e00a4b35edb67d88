// Anderson's acceleration against what it is on linear maps.

#include "core/secants.hpp"

#include <gtest/gtest.h>

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// F(x) = A(x − root): of m unknowns the (m + 1)th place is the root, as of GMRES (Walker and Ni 2011).
TEST(Secants, FindTheRootOfALinearMapInAsManyStepsAsItHasUnknowns) {
  const MatrixXd a = (MatrixXd(3, 3) << 1.5, 0.4, 0, -0.3, 0.4, 0.2, 0.1, 0, 2.2).finished();
  const VectorXd root = VectorXd::LinSpaced(3, 1, 2);
  Secants secants(3);
  VectorXd x = VectorXd::Zero(3);
  EXPECT_FALSE(secants.any());
  EXPECT_EQ(secants.next(x, a * (x - root)), x - a * (x - root));
  x -= a * (x - root);
  for (int i = 0; i < 3; ++i) x = secants.next(x, a * (x - root));
  EXPECT_TRUE(secants.any());
  EXPECT_NEAR((x - root).norm(), 0, 1e-10);
  secants.forget();
  EXPECT_FALSE(secants.any());
  EXPECT_EQ(secants.next(root, VectorXd::Ones(3)), root - VectorXd::Ones(3));
}

// Of a window of one it is the secant method.
TEST(Secants, KeepNoMoreThanTheirWindow) {
  Secants secants(1);
  const auto f = [](double x) { return VectorXd::Constant(1, x * x - 2); };
  double before = 1;
  double x = secants.next(VectorXd::Constant(1, before), f(before))[0];
  EXPECT_EQ(x, 2);
  for (int i = 0; i < 3; ++i) {
    const double expected = x - f(x)[0] * (x - before) / (f(x)[0] - f(before)[0]);
    before = x;
    x = secants.next(VectorXd::Constant(1, x), f(x))[0];
    EXPECT_NEAR(x, expected, 1e-14);
  }
}

}  // namespace
}  // namespace pulson
