#include "pulson/cohort/transport.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "error_of.hpp"

namespace pulson::cohort {
namespace {

struct Setting {
  KernelOperator kernel = make_kernel("gaussian:alpha=0.8");
  Points q0 = oval(5), along = 0.3 * standard_normals(1, 0, 10, 1).reshaped(2, 5),
         momentum = 0.3 * standard_normals(1, 1, 10, 1).reshaped(2, 5);

  PhaseState end() const { return Geodesics(kernel, 400).shoot(q0, along); }
  double product(const Points& q, const Points& p, const Points& other) const {
    return (p * kernel.gram(q, q)).cwiseProduct(other).sum();
  }
};

TEST(Transport, CarriesTheGeodesicsOwnMomentaAlong) {
  const Setting s;
  const Points found = transported(s.kernel, s.q0, s.along, s.along, {20, 20});
  EXPECT_LT((found - s.end().p).norm(), 1e-3 * s.end().p.norm());
}

TEST(Transport, KeepsInnerProductsToSecondOrder) {
  const Setting s;
  const PhaseState end = s.end();
  const double norm = s.product(s.q0, s.momentum, s.momentum), angle = s.product(s.q0, s.momentum, s.along);
  std::vector<double> errors;
  for (const int rungs : {5, 10, 20}) {
    const Points found = transported(s.kernel, s.q0, s.along, s.momentum, {rungs, 20});
    errors.push_back(std::abs(s.product(end.q, found, found) / norm - 1) +
                     std::abs(s.product(end.q, found, end.p) - angle) / norm);
  }
  EXPECT_LT(errors.back(), 2e-3);
  EXPECT_GT(errors[0] / errors[2], 10);  // 16 at order 2
}

// Parallel transport by Jacobi fields (L. Younes 2007; M. Louis et al. 2018, the fanning scheme), of order 1 in its
// pieces: exp(p + εw) − exp(p) over ε and the length of the piece, with the norm restored.
Points fanned(const Setting& s, int pieces) {
  const double h = 1.0 / pieces, epsilon = 1e-4;
  const Geodesics geodesics(s.kernel, 4);
  PhaseState state{s.q0, s.along};
  Points w = s.momentum;
  for (int k = 0; k < pieces; ++k) {
    const PhaseState next = geodesics.shoot(state.q, h * state.p);
    const Points field = (geodesics.shoot(state.q, h * (state.p + epsilon * w)).q -
                          geodesics.shoot(state.q, h * (state.p - epsilon * w)).q) /
                         (2 * epsilon * h);
    w = s.kernel.gram(next.q, next.q).llt().solve(field.transpose()).transpose();
    state = {next.q, next.p / h};
  }
  return w;
}

TEST(Transport, IsOfSecondOrderAndAgreesWithJacobiFields) {
  const Setting s;
  const Points fine = 2 * fanned(s, 800) - fanned(s, 400);  // Richardson's extrapolation
  std::vector<double> errors;
  for (const int rungs : {4, 8, 16})
    errors.push_back((transported(s.kernel, s.q0, s.along, s.momentum, {rungs, 20}) - fine).norm() / fine.norm());
  EXPECT_LT(errors.back(), 3e-3);
  const double order = std::log2(errors[0] / errors[2]) / 2;
  EXPECT_NEAR(order, 2, 0.3);
}

TEST(Transport, RefusesWrongOptions) {
  const Setting s;
  EXPECT_THAT(error_of([&] {
                transported(s.kernel, s.q0, s.along, s.momentum, {0, 20});
              }),
              testing::HasSubstr("rungs is 0"));
  EXPECT_THAT(error_of([&] { transported(s.kernel, s.q0, s.along, Points(2, 3)); }), testing::HasSubstr("the momenta"));
}

}  // namespace
}  // namespace pulson::cohort
