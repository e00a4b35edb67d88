// The pair's crossing probability on a grid against sampling, exact limits and itself.

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "numbers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson::fokker_planck {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

PairEquation paper_pair(const std::string& kernel, double beta, double p1) {
  return {.kernel = make_kernel(kernel, {}), .beta = beta, .time = 100, .q1 = 0, .q2 = 10, .p1 = p1, .p2 = 1};
}

// Soon decided, and so quickly solved.
PairEquation near_pair(const std::string& kernel, double beta = 1.5) {
  return {.kernel = make_kernel(kernel, {}), .beta = beta, .time = 3, .q1 = 1, .q2 = 3, .p1 = 3, .p2 = 1};
}

// Δt → 0 of (20): 50,048 samples at Δt = 0.00125, with a standard error of 0.002.
TEST(PairCrossing, IsThatOfFineMonteCarlo) {
  struct Known {
    std::string kernel;
    double beta, probability;
  };
  const std::vector<Known> all = {{"gaussian:alpha=1", 1.5, 0.278}, {"gaussian:alpha=1", 3, 0.591},
                                  {"gaussian:alpha=1", 6.5, 0.857}, {"peakon:alpha=0.5", 1.5, 0.459},
                                  {"peakon:alpha=0.5", 3, 0.756},   {"peakon:alpha=0.5", 6.5, 0.941}};
  for (const Known& known : all) {
    SCOPED_TRACE(known.kernel + " beta = " + std::to_string(known.beta));
    const PairCrossing crossing = crossing_probability(paper_pair(known.kernel, known.beta, 4));
    EXPECT_TRUE(crossing.converged);
    EXPECT_LE(crossing.error, 1e-3);
    EXPECT_NEAR(crossing.probability, known.probability, 4 * 0.002);
  }
}

// K and K' in the paper's own terms.
struct PlainKernel {
  std::string spec;
  std::function<double(double)> value, slope;
};

const std::vector<PlainKernel> kPlainKernels = {
    {"gaussian:alpha=1", [](double r) { return std::exp(-r * r); }, [](double r) { return -2 * r * std::exp(-r * r); }},
    {"peakon:alpha=0.5", [](double r) { return std::exp(-2 * std::abs(r)); },
     [](double r) { return std::copysign(2, -r) * std::exp(-2 * std::abs(r)); }},
    {"matern32:alpha=1.7320508075688772,weight=0.5+gaussian:alpha=0.6,weight=0.3",
     [](double r) { return 0.5 * (1 + std::abs(r)) * std::exp(-std::abs(r)) + 0.3 * std::exp(-r * r / 0.36); },
     [](double r) { return -0.5 * r * std::exp(-std::abs(r)) - 0.6 * r / 0.36 * std::exp(-r * r / 0.36); }}};

// Euler–Maruyama for the unreduced equations with the coefficients (17), noise in both positions.
double sampled_crossing(const PairEquation& pair, const PlainKernel& kernel, int samples, int steps) {
  std::mt19937_64 generator(20);
  std::normal_distribution<double> normal;
  const double dt = pair.time / steps;
  const double noise = pair.beta * std::sqrt(dt / 2);
  const double at_zero = kernel.value(0);
  int crossed = 0;
  for (int sample = 0; sample < samples; ++sample) {
    double q1 = pair.q1, q2 = pair.q2, p1 = pair.p1, p2 = pair.p2;
    for (int k = 0; k < steps; ++k) {
      const double value = kernel.value(q1 - q2);
      const double force = p1 * p2 * kernel.slope(q1 - q2);
      q1 += (at_zero * p1 + p2 * value) * dt + noise * normal(generator);
      q2 += (at_zero * p2 + p1 * value) * dt + noise * normal(generator);
      p1 -= force * dt;
      p2 += force * dt;
    }
    crossed += (q2 < q1);
  }
  return static_cast<double>(crossed) / samples;
}

TEST(PairCrossing, IsThatOfSamplesOfTheUnreducedEquations) {
  constexpr int kSamples = 4000;
  for (const PlainKernel& kernel : kPlainKernels) {
    SCOPED_TRACE(kernel.spec);
    const PairEquation pair = near_pair(kernel.spec);
    const PairCrossing crossing = crossing_probability(pair);
    const double p = crossing.probability;
    const double standard_error = std::sqrt(p * (1 - p) / kSamples);
    EXPECT_NEAR(p, sampled_crossing(pair, kernel, kSamples, 1500), 4 * standard_error + crossing.error);
  }
}

// A kernel that is nearly nothing: q₂ − q₁ is a Brownian motion. All times, the first of which are the hardest.
TEST(PairCrossing, WithoutKernelIsTheNormalLaw) {
  for (const double beta : {0.5, 2.0, 30.0}) {
    const PairEquation pair = near_pair("gaussian:alpha=1,weight=1e-12", beta);
    const PairCrossing crossing = crossing_probability(pair);
    for (std::size_t k = 1; k < crossing.times.size(); ++k)
      EXPECT_NEAR(crossing.curve[k], (NormalLaw{2, beta * beta * crossing.times[k]}.cdf(0)), crossing.curve_error)
          << beta << " " << k;
    EXPECT_NEAR(crossing.probability, (NormalLaw{2, beta * beta * pair.time}.cdf(0)), crossing.error + 1e-6);
  }
}

// Of a small probability, too, the tolerance is a part: of one in a million, where the first three grids are not
// enough.
TEST(PairCrossing, HasARelativeTolerance) {
  const PairEquation pair = near_pair("gaussian:alpha=1,weight=1e-12", 0.243);
  const double exact = NormalLaw{2, pair.beta * pair.beta * pair.time}.cdf(0);
  EXPECT_LT(exact, 2e-6);
  for (const double tolerance : {0.5, 0.05}) {
    const PairCrossing crossing = crossing_probability(pair, {.tolerance = tolerance, .most_grids = 6});
    EXPECT_TRUE(crossing.converged);
    EXPECT_LE(crossing.error, tolerance * crossing.probability);
    EXPECT_NEAR(crossing.probability, exact, tolerance * exact);
  }
}

// A narrow one: the pulsons hardly meet, and keep their momenta. What remains of meeting is proportional to α, and
// extrapolation removes it.
TEST(PairCrossing, WithANarrowKernelIsThatOfFreePulsons) {
  const PairEquation wide = near_pair("gaussian:alpha=0.01");
  const PairEquation narrow = near_pair("gaussian:alpha=0.005");
  const double limit = 2 * crossing_probability(narrow).probability - crossing_probability(wide).probability;
  const FreePulson first{.q = wide.q1, .p = wide.p1, .beta = 1.2};
  const FreePulson second{.q = wide.q2, .p = wide.p2, .beta = 0.9};  // β² = β₁² + β₂²
  EXPECT_NEAR(limit, gap_law(first, second, wide.time).cdf(0), 2e-3);
}

TEST(PairCrossing, ConvergesInSecondOrder) {
  for (const std::string kernel : {"gaussian:alpha=1", "peakon:alpha=0.5", "matern52:alpha=0.8"}) {
    SCOPED_TRACE(kernel);
    const PairEquation pair = near_pair(kernel);
    const PairCrossing fine = crossing_probability(pair, {.tolerance = 1e-12, .most_grids = 4});
    const PairCrossing coarse = crossing_probability(pair, {.tolerance = 1, .most_grids = 4});
    EXPECT_FALSE(fine.converged);
    ASSERT_EQ(fine.grids.size(), 4U);
    ASSERT_EQ(coarse.grids.size(), 3U);
    EXPECT_GE(fine.order, 1.75);  // more where terms of the error cancel
    EXPECT_LE(std::abs(coarse.probability - fine.probability), coarse.error);
    EXPECT_LT(fine.error, coarse.error / 2);
    EXPECT_EQ(fine.grids[2], coarse.probability);
  }
}

TEST(PairCrossing, DependsOnShapeAlone) {
  const PairEquation pair = near_pair("gaussian:alpha=1+peakon:alpha=0.5,weight=0.5");
  const double expected = crossing_probability(pair).probability;
  const auto same = [&](PairEquation other, const std::string& what) {
    EXPECT_NEAR(crossing_probability(other).probability, expected, 1e-9) << what;
  };
  const KernelOperator& k = pair.kernel;
  const double b = pair.beta;
  same({k, b, 3, 3, 1, 1, 3}, "labels exchanged");
  same({k, b, 3, -1, -3, -3, -1}, "mirrored");
  same({k, b, 3, -3, -1, -1, -3}, "mirrored with labels exchanged");
  same({k, b, 3, 11, 13, 3, 1}, "moved");
  same({make_kernel("gaussian:alpha=2+peakon:alpha=1,weight=0.5", {}), 2 * b, 3, 2, 6, 6, 2}, "lengths doubled");
  same({make_kernel("gaussian:alpha=1,weight=4+peakon:alpha=0.5,weight=2", {}), b, 3, 1, 3, 0.75, 0.25}, "heavier");
  same({k, b * std::sqrt(0.5), 6, 1, 3, 1.5, 0.5}, "slower");
}

TEST(PairCrossing, AtATimeIsThatOfAShorterProblem) {
  PairEquation pair = near_pair("peakon:alpha=0.5");
  const PairCrossing whole = crossing_probability(pair);
  ASSERT_EQ(whole.times.size(), whole.curve.size());
  EXPECT_EQ(whole.times.back(), pair.time);
  EXPECT_EQ(whole.curve.back(), whole.probability);
  EXPECT_EQ(whole.curve.front(), 0);
  const std::size_t third = 33;
  pair.time = whole.times[third];
  const PairCrossing part = crossing_probability(pair);
  EXPECT_NEAR(part.probability, whole.curve[third], part.error + whole.curve_error);
}

TEST(PairCrossing, HasTheRightLimits) {
  for (const std::string kernel : {"gaussian:alpha=1", "peakon:alpha=0.5"}) {
    EXPECT_EQ(crossing_probability(near_pair(kernel, 0)).probability, 0);
    double before = 0;
    for (const double beta : {0.05, 0.4, 0.8, 1.6, 3.0}) {
      const PairCrossing crossing = crossing_probability(near_pair(kernel, beta), {.most_grids = 3});
      EXPECT_GE(crossing.probability, before - crossing.error);
      before = crossing.probability;
    }
    EXPECT_NEAR(crossing_probability(near_pair(kernel, 0.05)).probability, 0, 1e-6);
    EXPECT_NEAR(crossing_probability(near_pair(kernel, 1e5)).probability, 0.5, 1e-4);
  }
}

TEST(PairCrossing, IsTheSameForAnyNumberOfThreads) {
  std::vector<PairEquation> pairs;
  for (const double beta : {0.5, 1.0, 2.0, 4.0}) pairs.push_back(near_pair("peakon:alpha=0.5", beta));
  std::vector<std::vector<PairCrossing>> all;
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    all.push_back(crossing_probabilities(pairs));
  }
  set_thread_count(0);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(all[0][i].probability, crossing_probability(pairs[i]).probability);
    for (const std::size_t other : {1U, 2U}) {
      EXPECT_EQ(all[0][i].curve, all[other][i].curve);
      EXPECT_EQ(all[0][i].error, all[other][i].error);
    }
  }
}

TEST(PairCrossing, RefusesWhatItCannotSolve) {
  const auto message = [](const std::function<void(PairEquation&, PairEquationOptions&)>& change,
                          const std::string& text) {
    PairEquation pair = near_pair("gaussian:alpha=1");
    PairEquationOptions options;
    change(pair, options);
    EXPECT_THAT([&] { crossing_probability(pair, options); }, ThrowsMessage<InputError>(HasSubstr(text)));
  };
  message([](auto& pair, auto&) { pair.beta = -1; }, "beta is -1; it must not be negative");
  message([](auto& pair, auto&) { pair.beta = 1e200; }, "is inf");
  message([](auto& pair, auto&) { pair.time = 0; }, "time is 0");
  message([](auto& pair, auto&) { pair.q1 = pair.q2; }, "both pulsons are at 3");
  message([](auto& pair, auto&) { pair.p2 = -1; }, "momenta are 3 and -1");
  message([](auto& pair, auto&) { pair.p1 = 0; }, "both positive or both negative");
  message([](auto& pair, auto&) { pair.q2 = kInfinity; }, "must be finite");
  message([](auto& pair, auto&) { pair.time = 1e9; }, "takes steps in proportion");
  message([](auto&, auto& options) { options.tolerance = 0; }, "tolerance of the pair equation is 0");
  message([](auto&, auto& options) { options.most_grids = 1; }, "it must be 2 to 8");
}

}  // namespace
}  // namespace pulson::fokker_planck
