// The discrete action (19) along paths of (20): stationary under every change of its positions and momenta between the
// two ends. The action is written out here, over dual numbers, with the potentials of noise_definition.hpp.

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "noise_definition.hpp"
#include "numbers.hpp"

namespace pulson {
namespace {

using ActionJet = ceres::Jet<double, 1>;

constexpr double kActionAlpha = 0.9;
constexpr const char* kActionKernel = "gaussian:alpha=0.9";

// H(q⁺, p), (12)
ActionJet energy(const Coordinates<ActionJet>& at) {
  ActionJet sum(0);
  for (int a = 0; a < at.n; ++a)
    for (int b = 0; b < at.n; ++b) {
      ActionJet product(0);
      for (int j = 0; j < at.d; ++j) product += at.p(a, j) * at.p(b, j);
      sum += 0.5 * product * exp(-at.squared_distance(a, b) / (kActionAlpha * kActionAlpha));
    }
  return sum;
}

/// A path as (19) has it: (qᵏ, pᵏ), k = 0…K, each with q before p.
using DiscretePath = std::vector<std::vector<ActionJet>>;

// pᴷ is in h(qᴷ, pᴷ) alone, which no derivative between the ends contains: p̂ᴷ stands in its place.
DiscretePath discrete_path(const Trajectory& path) {
  DiscretePath states;
  for (int k = 0; k <= path.grid.steps; ++k) {
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    const std::vector<double> x = coordinates({state.q, k < path.grid.steps ? path.step_momenta(k) : state.p});
    states.emplace_back(x.begin(), x.end());
  }
  return states;
}

/// S_d
ActionJet discrete_action(const Problem& problem, const DefinedNoise& noise, const DiscretePath& states) {
  const int d = problem.shape.dimension(), n = problem.shape.count();
  const auto half = static_cast<std::size_t>(d * n);
  std::vector<ActionJet> theta;
  for (const double value : noise.theta()) theta.emplace_back(value);
  ActionJet action(0);
  for (int k = 0; k < problem.grid.steps; ++k) {
    const std::vector<ActionJet>& now = states[static_cast<std::size_t>(k)];
    const std::vector<ActionJet>& next = states[static_cast<std::size_t>(k) + 1];
    std::vector<ActionJet> mixed = next;  // (qᵏ⁺¹, pᵏ)
    for (std::size_t i = 0; i < half; ++i) {
      action += now[half + i] * (next[i] - now[i]);
      mixed[half + i] = now[half + i];
    }
    action -= problem.grid.dt() * energy({mixed, d, n});
    const std::vector<ActionJet> h = noise.potentials(now, theta), h_next = noise.potentials(next, theta);
    for (std::size_t m = 0; m < h.size(); ++m)
      action -= 0.5 * (h[m] + h_next[m]) * problem.increments(static_cast<Eigen::Index>(m), k);
  }
  return action;
}

/// ∂S_d/∂xᵏ for coordinate i of (qᵏ, pᵏ).
double action_slope(const Problem& problem, const DefinedNoise& noise, DiscretePath states, int k, std::size_t i) {
  states[static_cast<std::size_t>(k)][i].v[0] = 1;
  return discrete_action(problem, noise, states).v[0];
}

class DiscreteAction : public testing::TestWithParam<std::string> {};

TEST_P(DiscreteAction, IsStationaryAlongPaths) {
  for (const int d : {1, 2}) {
    const int n = 3;
    Problem problem({"variational-paper", GetParam(), kActionKernel}, d, n, {0.6, 6});
    const DefinedNoise noise(GetParam(), problem.shape);
    const Trajectory path = problem.path();
    const DiscretePath states = discrete_path(path);
    const auto half = static_cast<std::size_t>(d * n);
    for (std::size_t i = 0; i < half; ++i) {
      for (int k = 0; k < problem.grid.steps; ++k) {
        if (k > 0) {
          EXPECT_NEAR(action_slope(problem, noise, states, k, i), 0, 1e-13) << "q, step " << k;
        }
        EXPECT_NEAR(action_slope(problem, noise, states, k, half + i), 0, 1e-13) << "p, step " << k;
      }
      // At the end that is held it is the momentum, minus: the adapted one, p̂.
      EXPECT_NEAR(action_slope(problem, noise, states, 0, i), -path.initial().p(static_cast<Eigen::Index>(i)), 1e-13);
    }
  }
}

// Of a path of another scheme it is not, so that the test can fail.
TEST(DiscreteActionOfOthers, IsNotStationary) {
  const std::string spec = "ch-sd:beta=0.3";
  const Problem problem({"midpoint", spec, kActionKernel}, 1, 3, {0.6, 6});
  const DiscretePath states = discrete_path(problem.path());
  EXPECT_GT(std::abs(action_slope(problem, DefinedNoise(spec, problem.shape), states, 3, 4)), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Noises, DiscreteAction,
                         testing::Values("none", "ch-sd:beta=0.3", "ch-sd-screened:beta=0.3,gamma=0.8",
                                         "p-sd:beta=0.3,fields=cos,wavenumber=1.3", "trouve-vialard:sigma=0.3",
                                         "potential:beta=0.3,gamma=0.8", "kunita:beta=0.3"),
                         [](const auto& row) {
                           return test_name({"noise", row.param, ""});
                         });

}  // namespace
}  // namespace pulson
