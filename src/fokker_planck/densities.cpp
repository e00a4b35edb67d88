#include <cmath>
#include <numbers>

#include "core/number_checks.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson {
namespace {

void check(const FreePulson& pulson) {
  require_finite("the free pulson's position", pulson.q);
  require_finite("the free pulson's momentum", pulson.p);
  require_positive("the free pulson's beta", pulson.beta);
  require_positive("the free pulson's K(0)", pulson.at_zero);
}

}  // namespace

double NormalLaw::density(double x) const {
  const double z = x - mean;
  return std::exp(-z * z / (2 * variance)) / std::sqrt(2 * std::numbers::pi * variance);
}

// The complementary error function keeps the digits of the lower tail.
double NormalLaw::cdf(double x) const { return 0.5 * std::erfc((mean - x) / std::sqrt(2 * variance)); }

NormalLaw position_law(const FreePulson& pulson, double time) {
  check(pulson);
  require_positive("the time", time);
  return {pulson.q + pulson.at_zero * pulson.p * time, pulson.beta * pulson.beta * time};
}

NormalLaw position_law_of_scheme(const FreePulson& pulson, const TimeGrid& grid) {
  NormalLaw law = position_law(pulson, grid.time);
  require_positive("the number of steps", grid.steps);
  law.variance = pulson.beta * pulson.beta * (grid.time - 0.75 * grid.dt());
  return law;
}

std::array<NormalLaw, 2> pair_marginals(const FreePulson& first, const FreePulson& second, double time) {
  return {position_law(first, time), position_law(second, time)};
}

NormalLaw gap_law(const FreePulson& first, const FreePulson& second, double time) {
  const auto [law1, law2] = pair_marginals(first, second, time);
  return {law2.mean - law1.mean, law1.variance + law2.variance};
}

}  // namespace pulson
