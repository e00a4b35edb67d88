// The densities (15) and (18) of free pulsons, and the law of the scheme (20).

#include <array>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "numbers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::fokker_planck {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const FreePulson kPulson{.q = -1, .p = 2, .beta = 0.7, .at_zero = 1.5};

TEST(FreePulsonDensity, SolvesTheFokkerPlanckEquation) {
  const double h = 1e-3;
  const auto rho = [](double t, double q) { return position_law(kPulson, t).density(q); };
  for (const double q : {0.0, 1.5, 3.0}) {
    const double rate = (rho(1 + h, q) - rho(1 - h, q)) / (2 * h);
    const double slope = (rho(1, q + h) - rho(1, q - h)) / (2 * h);
    const double curvature = (rho(1, q + h) - 2 * rho(1, q) + rho(1, q - h)) / (h * h);
    EXPECT_NEAR(rate + kPulson.at_zero * kPulson.p * slope, kPulson.beta * kPulson.beta / 2 * curvature, 1e-4) << q;
  }
}

/// (18) of momenta that are normal about p̄ in place of δ(p − p̄), which superposes its solutions, as the sum that is
/// printed or as the product of the two.
struct TwoPulsons {
  std::array<double, 2> betas{0.6, 0.9};
  double gap = 10;
  bool product = false;

  double density(const std::array<double, 5>& x) const {  // of (t, q₁, q₂, p₁, p₂)
    constexpr double kDeviation = 0.5;
    const std::array<double, 2> starts{0, gap}, momenta{1.5, 0.7};
    std::array<double, 2> terms{};
    for (std::size_t a = 0; a < 2; ++a) {
      const double p = x.at(3 + a);
      terms.at(a) = position_law({starts.at(a), p, betas.at(a)}, x[0]).density(x.at(1 + a)) *
                    NormalLaw{momenta.at(a), kDeviation * kDeviation}.density(p);
    }
    return product ? terms[0] * terms[1] : terms[0] + terms[1];
  }

  /// The left side of (16) with (17), by central differences of width h, where both densities are large.
  double residual(double h) const {
    const auto flux = [&](std::size_t i, const std::array<double, 5>& x) {
      const double r = x[1] - x[2], k = std::exp(-r * r), slope = -2 * r * k;
      const std::array<double, 5> a = {1, x[3] + x[4] * k, x[4] + x[3] * k, -x[3] * x[4] * slope, x[3] * x[4] * slope};
      return a.at(i) * density(x);
    };
    const std::array<double, 5> at = {1, 1.2, gap + 0.9, 1.4, 0.8};
    double sum = 0;
    for (std::size_t i = 0; i < 5; ++i) {
      std::array<double, 5> up = at, down = at;
      up.at(i) += h;
      down.at(i) -= h;
      sum += (flux(i, up) - flux(i, down)) / (2 * h);
      if (i == 1 || i == 2)
        sum -= betas.at(i - 1) * betas.at(i - 1) / 2 * (density(up) - 2 * density(at) + density(down)) / (h * h);
    }
    return sum;
  }
};

// (18) "satisfies (16) asymptotically": with the pulsons far apart what is left is the error of the differences, of
// second order; near each other it is the kernel's.
TEST(PairDensity, SolvesTheFokkerPlanckEquationOfAPairFarApart) {
  for (const bool product : {false, true}) {
    const TwoPulsons far{.product = product};
    EXPECT_NEAR(std::log2(far.residual(0.04) / far.residual(0.02)), 2, 0.02) << product;
    EXPECT_NEAR(std::log2(far.residual(0.02) / far.residual(0.01)), 2, 0.02) << product;
    EXPECT_LT(std::abs(far.residual(0.002)), 1e-5) << product;
    const auto at_gap = [&](double gap) {
      return std::abs(TwoPulsons{.gap = gap, .product = product}.residual(0.002));
    };
    EXPECT_GT(at_gap(0.7), 1e-2) << product;
    EXPECT_LT(at_gap(3.5), 1e-2 * at_gap(0.7)) << product;
  }
}

TEST(FreePulsonDensity, IsTheSlopeOfItsCdf) {
  const NormalLaw law = position_law(kPulson, 2);
  EXPECT_DOUBLE_EQ(law.mean, 5);
  const double h = 1e-4;
  for (const double x : {2.0, 5.0, 7.0}) EXPECT_NEAR((law.cdf(x + h) - law.cdf(x - h)) / (2 * h), law.density(x), 1e-8);
  EXPECT_DOUBLE_EQ(law.cdf(5), 0.5);
  EXPECT_EQ(law.cdf(-kInfinity), 0);
  EXPECT_EQ(law.cdf(kInfinity), 1);
}

// q(T) is linear in the increments: the integrator's answers to unit increments give the variance to round-off.
TEST(FreePulsonDensity, OfTheSchemeIsThatOfTheIntegrator) {
  const TimeGrid grid{2, 8};
  const StochasticSystem system{make_kernel("gaussian:alpha=1,weight=1.5", {}), make_noise("ch-sd:beta=0.7")};
  const PhaseState start{Points::Constant(1, 1, kPulson.q), Points::Constant(1, 1, kPulson.p)};
  const NormalLaw law = position_law_of_scheme(kPulson, grid);
  double variance = 0;
  for (int k = 0; k < grid.steps; ++k) {
    const Eigen::MatrixXd unit = Eigen::RowVectorXd::Unit(grid.steps, k);
    const double q = make_integrator("variational")->integrate(system, start, grid, unit).final().q(0);
    variance += (q - law.mean) * (q - law.mean) * grid.dt();
  }
  EXPECT_NEAR(law.variance, variance, 1e-12);
  EXPECT_NEAR(law.variance, 0.49 * (2 - 0.75 * 0.25), 1e-12);
}

TEST(FreePulsonDensity, OfAPairIsEachPulsonsOwn) {
  const FreePulson second{.q = 4, .p = 1, .beta = 0.2};
  const auto [law1, law2] = pair_marginals(kPulson, second, 3);
  EXPECT_EQ(law1.mean, position_law(kPulson, 3).mean);
  EXPECT_EQ(law2.variance, position_law(second, 3).variance);
  const NormalLaw gap = gap_law(kPulson, second, 3);
  EXPECT_DOUBLE_EQ(gap.mean, (4 + 3) - (-1 + 1.5 * 2 * 3));
  EXPECT_DOUBLE_EQ(gap.variance, 3 * (0.49 + 0.04));
}

TEST(FreePulsonDensity, RefusesWhatHasNone) {
  const auto message = [](const FreePulson& pulson, double time, const std::string& text) {
    EXPECT_THAT([&] { position_law(pulson, time); }, ThrowsMessage<InputError>(HasSubstr(text)));
  };
  message({.beta = 0}, 1, "beta is 0");
  message({.q = kInfinity}, 1, "position is inf");
  message({.at_zero = -1}, 1, "K(0) is -1");
  message({}, 0, "time is 0");
  EXPECT_THAT([] { position_law_of_scheme({}, {1, 0}); }, ThrowsMessage<InputError>(HasSubstr("steps is 0")));
}

}  // namespace
}  // namespace pulson::fokker_planck
