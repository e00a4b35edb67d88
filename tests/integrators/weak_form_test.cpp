// The stochastic EPDiff equation, (8) to (10), in its weak form: for every smooth φ, with m = Σ p_a δ(x − q_a),
//
//     <m, φ>(T) − <m, φ>(0) = ∫ <m, u φ' − u' φ> dt + Σ_i ∫ <m, ξ_i φ' − ξ_i' φ> ∘ dW_i
//
// which is (10) with its derivatives moved to φ. Fields, kernel and sums over landmarks are written out here.

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson {
namespace {

/// A function on the line and its derivative.
struct LineFunction {
  std::function<double(double)> value;
  std::function<double(double)> slope;
};

struct WeakFormCase {
  std::string noise;
  std::vector<LineFunction> fields;  // ξ_i
};

LineFunction bump(double height, double centre, double width) {
  const auto value = [=](double x) { return height * std::exp(-(x - centre) * (x - centre) / (width * width)); };
  return {value, [=](double x) { return -2 * (x - centre) / (width * width) * value(x); }};
}

LineFunction cosine(double height, double wavenumber) {
  return {[=](double x) { return height * std::cos(wavenumber * x); },
          [=](double x) { return -height * wavenumber * std::sin(wavenumber * x); }};
}

LineFunction constant_field(double height) {
  return {[=](double) { return height; }, [](double) { return 0.0; }};
}

const std::vector<WeakFormCase>& weak_form_cases() {
  static const std::vector<WeakFormCase> kCases = {
      {"p-sd:beta=0.5", {constant_field(0.5)}},
      {"p-sd:beta=0.5,fields=cos,wavenumber=1.3", {cosine(0.5, 1.3)}},
      {"p-sd:beta=0.5,fields=bump,center=-0.2/0.9,width=0.8", {bump(0.5, -0.2, 0.8), bump(0.5, 0.9, 0.8)}}};
  return kCases;
}

const std::array<LineFunction, 2>& test_functions() {
  static const std::array<LineFunction, 2> kFunctions = {bump(1, 0.6, 0.9), cosine(1, 0.8)};
  return kFunctions;
}

// K(x) = exp(−x²)
LineFunction velocity(const PhaseState& state) {
  const auto sum = [state](double x, bool derivative) {
    double total = 0;
    for (Eigen::Index b = 0; b < state.q.size(); ++b) {
      const double z = x - state.q(b);
      total += state.p(b) * std::exp(-z * z) * (derivative ? -2 * z : 1);
    }
    return total;
  };
  return {[sum](double x) { return sum(x, false); }, [sum](double x) { return sum(x, true); }};
}

double pairing(const PhaseState& state, const LineFunction& phi) {
  double sum = 0;
  for (Eigen::Index a = 0; a < state.q.size(); ++a) sum += state.p(a) * phi.value(state.q(a));
  return sum;
}

/// <m, v φ' − v' φ>: minus <v m_x + 2 m v_x, φ>
double transported(const PhaseState& state, const LineFunction& v, const LineFunction& phi) {
  double sum = 0;
  for (Eigen::Index a = 0; a < state.q.size(); ++a) {
    const double x = state.q(a);
    sum += state.p(a) * (v.value(x) * phi.slope(x) - v.slope(x) * phi.value(x));
  }
  return sum;
}

/// Left side minus right side, both integrals by the trapezoidal rule, which for increments is Stratonovich's.
double weak_residual(const Trajectory& path, const WeakFormCase& setting, const LineFunction& phi) {
  double residual = pairing(path.final(), phi) - pairing(path.initial(), phi);
  const double dt = path.grid.dt();
  for (int k = 0; k < path.grid.steps; ++k)
    for (const int end : {k, k + 1}) {
      const PhaseState& state = path.states[static_cast<std::size_t>(end)];
      residual -= dt / 2 * transported(state, velocity(state), phi);
      for (std::size_t i = 0; i < setting.fields.size(); ++i)
        residual -= path.increments(static_cast<Eigen::Index>(i), k) / 2 * transported(state, setting.fields[i], phi);
    }
  return residual;
}

constexpr int kFinest = 256;

/// The root mean square over paths and test functions of the residual on a grid of `steps`.
double weak_form_error(const WeakFormCase& setting, const std::string& integrator, int steps) {
  constexpr int kPaths = 24;
  const StochasticSystem system{make_kernel("gaussian:alpha=1", {}), make_noise(setting.noise)};
  const PhaseState start{(Points(1, 3) << 0, 0.7, 1.5).finished(), (Points(1, 3) << 1.2, -0.4, 0.6).finished()};
  double squares = 0;
  for (std::uint64_t path = 0; path < kPaths; ++path) {
    const Eigen::MatrixXd fine =
        brownian_increments(5, path, static_cast<int>(setting.fields.size()), TimeGrid{1, kFinest});
    const Trajectory trajectory =
        make_integrator(integrator)->integrate(system, start, TimeGrid{1, steps}, coarsened(fine, kFinest / steps));
    for (const LineFunction& phi : test_functions()) squares += std::pow(weak_residual(trajectory, setting, phi), 2);
  }
  return std::sqrt(squares / (kPaths * static_cast<double>(test_functions().size())));
}

// Each step of these schemes takes the noise at its middle to second order, as the trapezoidal rule does: what is left
// is a sum of terms in ΔW³ without mean, of first order.
TEST(WeakForm, HoldsAlongPaths) {
  const std::vector<double> steps = {32, 64, 128, 256};
  for (const std::string integrator : {"variational-2", "midpoint"})
    for (const WeakFormCase& setting : weak_form_cases()) {
      std::vector<double> errors;
      for (const double count : steps) errors.push_back(weak_form_error(setting, integrator, static_cast<int>(count)));
      EXPECT_NEAR(fitted_order(steps, errors), -1, 0.25) << integrator << ", " << setting.noise;
      EXPECT_LT(errors.back(), 2e-3) << integrator << ", " << setting.noise;
    }
}

// (1): both integrators and the trapezoidal rule are of second order.
TEST(WeakForm, HoldsWithoutNoise) {
  const std::vector<double> steps = {32, 64, 128};
  for (const std::string integrator : {"variational-2", "midpoint"}) {
    std::vector<double> errors;
    for (const double count : steps)
      errors.push_back(weak_form_error({"none", {}}, integrator, static_cast<int>(count)));
    EXPECT_NEAR(fitted_order(steps, errors), -2, 0.05) << integrator;
    EXPECT_LT(errors.back(), 1e-4) << integrator;
  }
}

// So that the test can fail: the noise as it would be with a sign of (10) the other way, m_x ξ − 2 m ξ'.
TEST(WeakForm, NeedsTheSignsOfThePaper) {
  WeakFormCase flipped = weak_form_cases()[1];
  for (LineFunction& field : flipped.fields) field.slope = [slope = field.slope](double x) { return -slope(x); };
  EXPECT_GT(weak_form_error(flipped, "variational-2", kFinest), 0.1);
}

}  // namespace
}  // namespace pulson
