#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// Calls check(combination) for every integrator and kernel without noise.
template <class Check>
void for_each_quiet_combination(const Check& check) {
  for (const Combination& c : all_combinations()) {
    if (c.noise != "none") continue;
    SCOPED_TRACE(c);
    check(c);
  }
}

// Symplectic Euler has the modified Hamiltonian H̃ = H + (Δt/2) H_p·H_q + O(Δt²): the error of H is that of H̃'s second
// term, which does not grow, and H̃ is kept to second order, over however many steps.
TEST(Integrators, EnergyDoesNotDrift) {
  for_each_quiet_combination([](const Combination& c) {
    std::vector<double> sizes, errors, modified_errors;
    for (const int steps : {25'000, 50'000, 100'000}) {
      const Problem problem(c, 2, 3, {50, steps}, 0.3);
      const auto energies = [&](const PhaseState& s) {
        const KernelOperator& kernel = problem.system.kernel;
        const double correction =
            problem.grid.dt() / 2 * dot(hamiltonian_p(kernel, s.q, s.p), hamiltonian_q(kernel, s.q, s.p));
        return Eigen::Array2d(hamiltonian(kernel, s), hamiltonian(kernel, s) + correction);
      };
      const Trajectory path = problem.path();
      Eigen::Array2Xd quarters = Eigen::Array2Xd::Zero(2, 4);  // largest errors of H and of H̃
      for (int k = 0; k < steps; ++k) {
        auto quarter = quarters.col(4 * k / steps);
        quarter = quarter.max((energies(path.states[static_cast<std::size_t>(k)]) - energies(path.initial())).abs());
      }
      EXPECT_LE(quarters(0, 3), 1.5 * quarters(0, 0));
      EXPECT_LE(quarters(1, 3), 1.5 * quarters(1, 0));
      sizes.push_back(problem.grid.dt());
      errors.push_back(quarters.row(0).maxCoeff());
      modified_errors.push_back(quarters.row(1).maxCoeff());
    }
    EXPECT_NEAR(fitted_order(sizes, errors), 1, 0.1);
    EXPECT_NEAR(fitted_order(sizes, modified_errors), 2, 0.1);
  });
}

TEST(Integrators, IsOfFirstOrderWithoutNoise) {
  for_each_quiet_combination([](const Combination& c) {
    const PhaseState exact = Problem(c, 2, 4, {1, 10'240}).path().final();
    std::vector<double> sizes, errors;
    for (const int steps : {10, 20, 40, 80, 160}) {
      const PhaseState end = Problem(c, 2, 4, {1, steps}).path().final();
      sizes.push_back(1.0 / steps);
      errors.push_back(norm({end.q - exact.q, end.p - exact.p}));
    }
    EXPECT_NEAR(fitted_order(sizes, errors), 1, 0.1);
  });
}

// Two landmarks at 0 and `gap` with opposite momenta, one step of size 1.
Problem pair_on_a_line(const Combination& c, double gap, double first_momentum) {
  Problem pair(c, 1, 2, {1, 1});
  pair.start = {(Points(1, 2) << 0, gap).finished(), (Points(1, 2) << first_momentum, -first_momentum).finished()};
  return pair;
}

// The gap between the two after the step; none where the step has no solution.
std::optional<double> gap_after(const Problem& pair) {
  try {
    const Trajectory path = pair.path();
    EXPECT_LE(defect(pair, path), 8 * kEpsilon);
    return path.final().q(1) - path.final().q(0);
  } catch (const StepError&) {
    return std::nullopt;
  }
}

// Calls check(gap, gap after the step) for pairs that run into each other, with κ from 0.1 to 10⁴.
template <class Check>
void for_each_head_on_pair(const Check& check) {
  for_each_quiet_combination([&](const Combination& c) {
    for (const double gap : {0.01, 0.1, 1.0, 10.0}) {
      for (double p = 0.1; p < 1e4; p *= 3) {
        SCOPED_TRACE("gap " + std::to_string(gap) + ", p " + std::to_string(p));
        check(gap, gap_after(pair_on_a_line(c, gap, p)));
      }
    }
  });
}

// The gap g solves g + 2ΔtP(1 − K(g)) = gap, which has one root above 0, and that below `gap`, however large ΔtP is;
// roots below 0, where the landmarks have passed each other, are on other branches.
TEST(Integrators, HeadOnPairNeverPasses) {
  for_each_head_on_pair([](double gap, const std::optional<double>& g) {
    EXPECT_GT(g.value_or(gap / 2), 0);
    EXPECT_LT(g.value_or(gap / 2), gap);
  });
}

TEST(Integrators, HeadOnPairIsSolvedWhateverTheStep) {
  for_each_head_on_pair([](double /*gap*/, const std::optional<double>& g) { EXPECT_TRUE(g.has_value()); });
}

// The gap of a separating pair solves g = gap + A(1 − K(g)) with A = 2ΔtP. The branch that begins at A = 0 runs through
// A(g) = (g − gap)/(1 − K(g)) until A first turns down, and to all A where it never does.
TEST(Integrators, SeparatingPairFollowsItsBranchOrSaysThatItEnds) {
  int ends = 0;
  for_each_quiet_combination([&](const Combination& c) {
    for (const double gap : {0.02, 0.1, 1.0}) {
      const KernelOperator kernel = make_kernel(c.kernel, {});
      const auto strength = [&](double g) { return (g - gap) / (kernel.at_zero() - kernel.jet(g * g).value); };
      double last = gap;
      while (last < 200 && strength(last + 1e-4) > strength(last)) last += 1e-4;
      const bool has_end = last < 200;
      ends += has_end ? 1 : 0;
      for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99, 1.01, 1.5, 10.0, 1e3}) {
        if (part > 1 && !has_end) continue;
        SCOPED_TRACE("gap " + std::to_string(gap) + ", part " + std::to_string(part));
        const double a = part * strength(last);
        const std::optional<double> g = gap_after(pair_on_a_line(c, gap, -a / 2));
        EXPECT_EQ(g.has_value(), part < 1);
        if (!g || part > 1) continue;
        EXPECT_LE(*g, last);
        EXPECT_NEAR(strength(*g), a, 1e-9 * a);
      }
    }
  });
  EXPECT_GT(ends, 0);
}

TEST(Integrators, StepErrorNamesStepSizeAndRemedy) {
  Problem pair = pair_on_a_line({"variational", "none", "gaussian:alpha=1"}, 0.1, -50);
  pair.grid = {3, 3};
  pair.increments = MatrixXd(0, 3);
  try {
    pair.path();
    FAIL() << "no error";
  } catch (const StepError& error) {
    EXPECT_EQ(error.step(), 0);
    EXPECT_STREQ(error.what(),
                 "step 1 of 3 (dt = 1): the implicit equation (20) for the positions has no unique solution; use more "
                 "steps, as in --steps 6");
  }
}

TEST(Integrators, ActingIncrementsAreMovingAverages) {
  Numbers numbers(1);
  for (const int steps : {1, 2, 7}) {
    const MatrixXd dw = numbers(3, steps);
    const MatrixXd bar = numbers(3, steps);
    const MatrixXd w = acting_increments(dw);
    for (int k = 0; k < steps; ++k)
      EXPECT_LE(largest(w.col(k) - 0.5 * (dw.col(k) + (k > 0 ? VectorXd(dw.col(k - 1)) : VectorXd::Zero(3)))),
                kEpsilon);
    EXPECT_NEAR(dot(w, bar), dot(dw, acting_increments_transposed(bar)), 1e-14);
  }
}

// ΔW_{−1} = ΔW_K = 0: the first and the last increment act by halves, and the second half of the last never comes.
TEST(Integrators, FreeLandmarkShowsTheBoundaryRule) {
  for (const int steps : {1, 2, 5}) {
    const Problem free({"variational", "ch-sd:beta=0.3", "gaussian:alpha=0.9"}, 2, 1, {2, steps});
    const Trajectory path = free.path();
    ASSERT_EQ(path.states.size(), static_cast<std::size_t>(steps) + 1);
    const VectorXd noise = free.increments.rowwise().sum() - 0.5 * free.increments.col(steps - 1);
    EXPECT_LE(largest(path.final().q - free.start.q - 2 * free.start.p - 0.3 * noise), 1e-14);
    EXPECT_EQ(path.final().p, free.start.p);
  }
}

}  // namespace
}  // namespace pulson
