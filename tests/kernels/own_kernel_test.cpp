#include "pulson/kernels/own_kernel.hpp"

#include <cmath>
#include <functional>
#include <initializer_list>
#include <memory>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "own_kernels.hpp"
#include "pair_loops.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

struct OwnGaussian : OwnProfile {
  ProfileValues at(const Eigen::ArrayXd& s, int order) const override {
    ++calls;
    ProfileValues values{(-s).exp(), {}, {}};
    if (order > 0) values.first = -values.value;
    if (order > 1) values.second = values.value;
    return values;
  }
  double lipschitz() const override { return std::sqrt(2 / std::numbers::e); }
  mutable int calls = 0;
};

struct OwnKernel : testing::Test {
  std::shared_ptr<const OwnGaussian> profile = std::make_shared<OwnGaussian>();
  KernelProfile number = name_kernel("bell", profile);

  void expect_same(const Points& own, const Points& theirs) const {
    EXPECT_LE((own - theirs).cwiseAbs().maxCoeff(), 1e-13 * (1 + theirs.cwiseAbs().maxCoeff()));
  }
};

struct OwnKernelSums : OwnKernel, testing::WithParamInterface<int> {};

TEST_P(OwnKernelSums, AreThoseOfTheTable) {
  const int d = GetParam(), n = 70;  // on a line of so many landmarks kernels of the table are swept
  const Points q = random_points(d, n, 1), x = random_points(d, 9, 2), a = random_points(d, n, 3),
               b = random_points(d, n, 4);
  Points p = random_points(d, n, 5), dp = random_points(d, n, 6);
  p.rightCols(5).setZero();
  for (const std::string end : {"", "+matern32:alpha=0.7,weight=0.5"}) {
    const KernelOperator own = make_kernel("bell:alpha=0.4,weight=2" + end);
    const KernelOperator theirs = make_kernel("gaussian:alpha=0.4,weight=2" + end);
    expect_same(own.apply(x, q, p), theirs.apply(x, q, p));
    Eigen::MatrixXd jacobian, their_jacobian;
    expect_same(own.apply_with_jacobian(x, q, p, jacobian), theirs.apply_with_jacobian(x, q, p, their_jacobian));
    expect_same(jacobian, their_jacobian);
    expect_same(own.apply_tangent(q, p, a), theirs.apply_tangent(q, p, a));
    expect_same(own.gradient(q, a, p), theirs.gradient(q, a, p));
    expect_same(own.hessian(q, p, a), theirs.hessian(q, p, a));
    const Flow flow = own.flow(q, p), their_flow = theirs.flow(q, p);
    expect_same(flow.velocity, their_flow.velocity);
    expect_same(flow.force, their_flow.force);
    const Flow tangent = own.flow_tangent(q, p, b, dp), their_tangent = theirs.flow_tangent(q, p, b, dp);
    expect_same(tangent.velocity, their_tangent.velocity);
    expect_same(tangent.force, their_tangent.force);
    expect_same(own.gram(x, q), theirs.gram(x, q));
    const StepMatrices step = own.step_matrices(q, p, 0.1), their_step = theirs.step_matrices(q, p, 0.1);
    expect_same(step.gram, their_step.gram);
    expect_same(step.tangent, their_step.tangent);
    expect_same(step.hessian, their_step.hessian);
    EXPECT_NEAR(own.lipschitz(), theirs.lipschitz(), 1e-13);
    EXPECT_NEAR(own.at_zero(), theirs.at_zero(), 1e-15);
    EXPECT_NEAR(own.jet(0.3).second, theirs.jet(0.3).second, 1e-12);
  }
}
INSTANTIATE_TEST_SUITE_P(Dimensions, OwnKernelSums, testing::Values(1, 2, 3));

TEST_F(OwnKernel, OneCallServesAllPairs) {
  const Points q = random_points(2, 200, 7), p = random_points(2, 200, 8);
  const KernelOperator kernel = make_kernel("bell:alpha=0.4");
  for (const auto& sum : std::initializer_list<std::function<void()>>{
           [&] { kernel.flow(q, p); }, [&] { kernel.gram(q, q); }, [&] { kernel.hessian(q, p, p); }}) {
    const int before = profile->calls;
    sum();
    EXPECT_EQ(profile->calls, before + 1);
  }
  const int before = profile->calls;
  kernel.step_matrices(q, p, 0.1);
  EXPECT_LE(profile->calls, before + 2);  // and K(0)
}

TEST_F(OwnKernel, ASpecificationMakesIt) {
  const KernelOperator kernel =
      make_kernel("gaussian:alpha=1+bell:alpha=auto,weight=3", (Points(1, 2) << 0, 1).finished());
  EXPECT_EQ(kernel.spec(), "gaussian:alpha=1+bell:alpha=0.5,weight=3");
  EXPECT_EQ(make_kernel(kernel.spec()).terms().back().profile, number);
  EXPECT_THAT(own_profiles(kernel), testing::ElementsAre(profile));
  EXPECT_THAT(own_profiles(make_kernel("gaussian:alpha=1")), testing::IsEmpty());
}

TEST_F(OwnKernel, ANameLivesWithItsProfile) {
  const KernelOperator first = make_kernel("bell:alpha=1");
  auto second = std::make_shared<OwnGaussian>();
  const KernelProfile newer = name_kernel("bell", second);
  EXPECT_EQ(make_kernel("bell:alpha=1").terms().front().profile, newer);
  EXPECT_EQ(first.at_zero(), 1);  // stays what it was
  second.reset();
  EXPECT_EQ(make_kernel("bell:alpha=1").terms().front().profile, number);
  profile.reset();
  EXPECT_THROW(make_kernel("bell:alpha=1"), InputError);
  EXPECT_THROW(first.at_zero(), InputError);
}

TEST_F(OwnKernel, NamesThatCannotBeAreRefused) {
  for (const char* name : {"gaussian", "", "1st", "a:b", "a+b", "a b"})
    EXPECT_THROW(name_kernel(name, profile), InputError) << name;
}

}  // namespace
}  // namespace pulson
