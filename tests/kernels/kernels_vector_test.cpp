// What vectors, threads and text do to a kernel: the exponential, the vector targets, thread counts, and names.

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "forced_target.hpp"
#include "kernel_definition.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// ---- vector targets

std::vector<Eigen::MatrixXd> every_sum(const KernelOperator& kernel, int dimension, int count) {
  const Points q = random_points(dimension, count, 1);
  const Points p = random_points(dimension, count, 2);
  const Points a = random_points(dimension, count, 3);
  Eigen::MatrixXd jacobian;
  const Points u = kernel.apply_with_jacobian(q, q, p, jacobian);
  const Flow flow = kernel.flow(q, p), change = kernel.flow_tangent(q, p, a, u);
  return {kernel.apply(q, q, p),
          u,
          jacobian,
          kernel.apply_tangent(q, p, a),
          kernel.gradient(q, a, p),
          kernel.hessian(q, p, a),
          flow.velocity,
          flow.force,
          change.velocity,
          change.force};
}

TEST(VectorTarget, ForcingATargetIsSeen) {
  const std::string best = vector_target();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(target);
    EXPECT_EQ(vector_target(), hwy::TargetName(target));
  }
  EXPECT_EQ(vector_target(), best);
}

TEST(VectorTarget, AllGiveTheSame) {
  for (const DefinedKernel& definition : every_kernel()) {
    const KernelOperator kernel = definition.make();
    for (const int dimension : {1, 2, 3}) {
      for (const int count : {1, 3, 9, 65}) {
        const std::vector<Eigen::MatrixXd> expected = every_sum(kernel, dimension, count);
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
          const ForcedTarget forced(target);
          const std::vector<Eigen::MatrixXd> actual = every_sum(kernel, dimension, count);
          for (std::size_t i = 0; i < expected.size(); ++i)
            EXPECT_LE((actual[i] - expected[i]).cwiseAbs().maxCoeff(), 1e-14 * expected[i].cwiseAbs().maxCoeff())
                << hwy::TargetName(target) << ", " << definition << ", d = " << dimension << ", N = " << count
                << ", sum " << i;
        }
      }
    }
  }
}

// Squares of numbers of 24 bits are exact, so the argument of the exponential is too.
TEST(VectorExponential, IsWithinOneUnitInTheLastPlace) {
  constexpr int kSamples = 200'000;
  const KernelOperator gaussian = make_kernel("gaussian:alpha=1", Points());
  Points r(1, kSamples);
  std::vector<double> exact(kSamples);
  for (int i = 0; i < kSamples; ++i) {
    r(i) = static_cast<float>(std::sqrt(700 * static_cast<double>(i) / kSamples));
    exact[static_cast<std::size_t>(i)] = r(i) * r(i);
  }
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(target);
    const Points k = gaussian.apply(r, Points::Zero(1, 1), Points::Ones(1, 1));
    long double worst = 0;
    for (int i = 0; i < kSamples; ++i) {
      const long double e = std::exp(-static_cast<long double>(exact[static_cast<std::size_t>(i)]));
      const auto rounded = static_cast<double>(e);
      const double unit = rounded - std::nextafter(rounded, 0.0);
      worst = std::max(worst, std::abs(k(i) - e) / unit);
    }
    EXPECT_LE(worst, 1) << hwy::TargetName(target);
    EXPECT_EQ(k(0), 1) << hwy::TargetName(target);
  }
}

// ---- threads

TEST(Threads, DoNotChangeABit) {
  for (const DefinedKernel& definition : every_kernel()) {
    const KernelOperator kernel = definition.make();
    set_thread_count(1);
    const std::vector<Eigen::MatrixXd> expected = every_sum(kernel, 2, 700);
    for (const int threads : {2, 3}) {
      set_thread_count(threads);
      const std::vector<Eigen::MatrixXd> actual = every_sum(kernel, 2, 700);
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(actual[i], expected[i]) << definition << ", " << threads << " threads, sum " << i;
    }
  }
  set_thread_count(0);
}

// ---- errors and names

TEST(KernelOperator, RefusesWhatIsNoKernel) {
  const auto make = [](double alpha, double weight) {
    return [=] { KernelOperator({{KernelProfile::kGaussian, alpha, weight}}); };
  };
  EXPECT_THAT([] { KernelOperator({}); }, ThrowsMessage<InputError>("a kernel needs at least one term"));
  EXPECT_THAT(make(0, 1), ThrowsMessage<InputError>("kernel: alpha is 0; it must be greater than 0"));
  EXPECT_THAT(make(1, 0), ThrowsMessage<InputError>("kernel: weight is 0; it must be greater than 0"));
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(make(bad, 1), ThrowsMessage<InputError>(HasSubstr("alpha is ")));
    EXPECT_THAT(make(1, bad), ThrowsMessage<InputError>(HasSubstr("weight is ")));
  }
}

void expect_messages(const std::string& name) {
  const auto refuses = [&name](int count, const std::string& parameters, const std::string& message) {
    EXPECT_THAT([&] { make_kernel(name + parameters, random_points(2, count, 1)); },
                ThrowsMessage<InputError>(HasSubstr("kernel '" + name + "'" + message)));
  };
  refuses(3, ":width=1", " has no parameter 'width'; it has: alpha, weight");
  refuses(3, ":alpha=0", ": alpha is 0; it must be greater than 0");
  refuses(3, ":alpha=-1", ": alpha is -1; it must be greater than 0");
  refuses(3, ":alpha=nan", ": alpha is 'nan'; it must be finite");
  refuses(3, ":alpha=wide", ": alpha is 'wide'; a number is needed");
  refuses(3, ":weight=0", ": weight is 0; it must be greater than 0");
  refuses(1, "", ": alpha=auto needs at least two distinct landmarks; give a number");
  refuses(1, ":alpha=auto", ": alpha=auto needs at least two distinct landmarks; give a number");
  const auto unknown = [](const std::string& spec, const std::string& message) {
    EXPECT_THAT([&] { make_kernel(spec, Points()); },
                ThrowsMessage<InputError>(AllOf(HasSubstr("unknown kernel '" + spec + "'"), HasSubstr(message))));
  };
  unknown("no-such", name);
  unknown(name + "x", "did you mean '" + name + "'");
}

TEST(MakeKernel, SaysWhatIsWrong) {
  for (const auto& row : kernel_table().rows()) expect_messages(row.name);
}

TEST(MakeKernel, AutomaticWidthFollowsItsRule) {
  // Distances 1, 2, 3, nearest ones 1, 1, 2: half the median distance.
  EXPECT_EQ(automatic_alpha((Points(1, 3) << 0, 1, 3).finished()), 1);
  // Distances ¼, ¼, 9¾, 10, 10, 10¼, nearest ones ¼: twice the nearest.
  EXPECT_EQ(automatic_alpha((Points(1, 4) << 0, 0.25, 10, 10.25).finished()), 0.5);
  EXPECT_EQ(automatic_alpha(Points::Zero(2, 1)), 0);
  EXPECT_EQ(automatic_alpha(Points::Ones(2, 4)), 0);
  const KernelOperator kernel = make_kernel("gaussian", (Points(1, 3) << 0, 1, 3).finished());
  EXPECT_EQ(kernel.spec(), "gaussian:alpha=1");
}

TEST(MakeKernel, SpecMakesTheSameKernel) {
  for (const DefinedKernel& definition : every_kernel()) {
    std::vector<KernelTerm> terms = definition.make().terms();
    for (const double awkward : {1.0, 1.0 / 3, 0.1 + 0.2, 1.2345e-9, 9.87654321e12}) {
      for (KernelTerm& term : terms) {
        term.alpha *= awkward;
        term.weight /= awkward;
      }
      const std::string spec = KernelOperator(terms).spec();
      const KernelOperator again = make_kernel(spec, Points());
      EXPECT_EQ(again.spec(), spec);
      ASSERT_EQ(again.terms().size(), terms.size()) << spec;
      for (std::size_t i = 0; i < terms.size(); ++i) {
        EXPECT_EQ(again.terms()[i].profile, terms[i].profile) << spec;
        EXPECT_EQ(again.terms()[i].alpha, terms[i].alpha) << spec;
        EXPECT_EQ(again.terms()[i].weight, terms[i].weight) << spec;
      }
    }
  }
}

TEST(MakeKernel, SpecForPeopleHasFewerDigits) {
  EXPECT_EQ(KernelOperator({{KernelProfile::kGaussian, 1.0 / 3, 2.0 / 3}}).spec(4),
            "gaussian:alpha=0.3333,weight=0.6667");
}

}  // namespace
}  // namespace pulson
