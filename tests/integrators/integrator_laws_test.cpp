#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "numbers.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Calls check(combination) for every integrator and kernel without noise.
template <class Check>
void for_each_quiet_combination(const Check& check) {
  for (const Combination& c : all_combinations()) {
    if (c.noise != "none") continue;
    SCOPED_TRACE(c);
    check(c);
  }
}

// The variational integrators, which are one without noise, have more laws than the others.
template <class Check>
void for_each_variational_combination(const Check& check) {
  for_each_quiet_combination([&](const Combination& c) {
    if (c.integrator == "variational") check(c);
  });
}

// The largest |energy(state) − energy(start)| in each quarter of the path.
template <class Energy>
Eigen::Array4d errors_by_quarter(const Trajectory& path, const Energy& energy) {
  Eigen::Array4d quarters = Eigen::Array4d::Zero();
  const double start = energy(path.initial());
  for (int k = 0; k < path.grid.steps; ++k) {
    double& quarter = quarters[4 * k / path.grid.steps];
    quarter = std::max(quarter, std::abs(energy(path.states[static_cast<std::size_t>(k)]) - start));
  }
  return quarters;
}

// The error of H is that of the modified Hamiltonian's next term, which does not grow over however many steps.
TEST(Integrators, EnergyDoesNotDriftWhereSymplectic) {
  for (const auto& row : integrator_table().rows()) {
    const Combination c{row.name, "none", "gaussian:alpha=0.9"};
    SCOPED_TRACE(c);
    const IntegratorTraits traits = make_integrator(row.name)->traits();
    if (!traits.symplectic) continue;
    std::vector<double> sizes, errors;
    for (const int steps : {25'000, 100'000}) {
      const Problem problem(c, 2, 3, {50, steps}, 0.3);
      const Eigen::Array4d quarters =
          errors_by_quarter(problem.path(), [&](const PhaseState& s) { return hamiltonian(problem.system.kernel, s); });
      EXPECT_LE(quarters[3], std::max(1.5 * quarters[0], 1e-11));
      sizes.push_back(problem.grid.dt());
      errors.push_back(quarters.maxCoeff());
    }
    if (errors.back() > 1e-10) {
      EXPECT_NEAR(fitted_order(sizes, errors), traits.order, 0.1);
    }
  }
}

// Symplectic Euler has the modified Hamiltonian H + (Δt/2) H_p·H_q + O(Δt²).
TEST(Integrators, ModifiedEnergyIsKeptToSecondOrder) {
  for_each_variational_combination([](const Combination& c) {
    std::vector<double> sizes, errors;
    for (const int steps : {12'500, 25'000, 50'000}) {
      const Problem problem(c, 2, 3, {50, steps}, 0.3);
      const KernelOperator& kernel = problem.system.kernel;
      const Eigen::Array4d quarters = errors_by_quarter(problem.path(), [&](const PhaseState& s) {
        return hamiltonian(kernel, s) +
               problem.grid.dt() / 2 * dot(hamiltonian_p(kernel, s.q, s.p), hamiltonian_q(kernel, s.q, s.p));
      });
      EXPECT_LE(quarters[3], 1.5 * quarters[0]);
      sizes.push_back(problem.grid.dt());
      errors.push_back(quarters.maxCoeff());
    }
    EXPECT_NEAR(fitted_order(sizes, errors), 2, 0.1);
  });
}

TEST(Integrators, HasItsOrderWithoutNoise) {
  for_each_quiet_combination([](const Combination& c) {
    const int order = make_integrator(c.integrator)->traits().order;
    // Peakons' fields have kinks that no path here meets, but their derivatives are large beside one.
    const PhaseState exact = Problem({"rk4", "none", c.kernel}, 2, 4, {1, 5'120}).path().final();
    std::vector<double> sizes, errors;
    for (const int steps : {20, 40, 80, 160}) {
      const PhaseState end = Problem(c, 2, 4, {1, steps}).path().final();
      sizes.push_back(1.0 / steps);
      errors.push_back(norm({end.q - exact.q, end.p - exact.p}));
    }
    EXPECT_NEAR(fitted_order(sizes, errors), order, 0.05 + 0.05 * order);
  });
}

// Forward, momenta turned, forward again: back at the start with the momenta turned, or not.
TEST(Integrators, IsReversibleWhereItSaysSo) {
  for_each_quiet_combination([](const Combination& c) {
    const Problem problem(c, 2, 4, {1, 10});
    const PhaseState there = problem.path().final();
    const PhaseState back =
        problem.integrator->integrate(problem.system, {there.q, -there.p}, problem.grid, problem.increments).final();
    const double error = norm({back.q - problem.start.q, back.p + problem.start.p});
    if (problem.integrator->traits().reversible)
      EXPECT_LE(error, 1e-13);
    else
      EXPECT_GT(error, 1e-9);
  });
}

// Langevin's friction alone: dH = −λ|H_p|² dt.
TEST(Integrators, FrictionTakesEnergy) {
  for (const std::string integrator : {"variational", "variational-2", "midpoint", "heun"}) {
    Problem problem({integrator, "langevin:sigma=1,friction=0.7", "gaussian:alpha=0.9"}, 2, 4, {0.001, 1});
    problem.increments.setZero();
    const KernelOperator& kernel = problem.system.kernel;
    const double before = hamiltonian(kernel, problem.start);
    const double rate = -0.7 * hamiltonian_p(kernel, problem.start.q, problem.start.p).squaredNorm();
    EXPECT_NEAR((hamiltonian(kernel, problem.path().final()) - before) / 0.001, rate, 0.01 * std::abs(rate));
  }
}

// E q₂ and E p₁² of a pair over all paths whose increments are −√(3Δt), 0 and √(3Δt) with the weights 1/6, 2/3 and 1/6:
// five moments are those of Brownian increments, so weak orders up to 2 show, and no sampling hides them.
Eigen::Array2d three_point_means(const std::string& integrator, int steps) {
  Problem problem({integrator, "ch-sd:beta=1,on=2", "gaussian:alpha=1.4"}, 1, 2, {0.1, steps});
  problem.start = {Eigen::RowVector2d(0, 2), Eigen::RowVector2d(2, 1)};
  Eigen::Array2d means = Eigen::Array2d::Zero();
  const auto paths = static_cast<int>(std::pow(3, steps));
  for (int path = 0; path < paths; ++path) {
    double weight = 1;
    for (int k = 0, digits = path; k < steps; ++k, digits /= 3) {
      problem.increments(0, k) = (digits % 3 - 1) * std::sqrt(3 * problem.grid.dt());
      weight *= digits % 3 == 1 ? 2.0 / 3 : 1.0 / 6;
    }
    const PhaseState end = problem.path().final();
    means += weight * Eigen::Array2d(end.q(1), end.p(0) * end.p(0));
  }
  return means;
}

TEST(Integrators, HaveTheirWeakOrderWithAdditiveNoise) {
  for (const auto& [integrator, order] :
       {std::pair{"variational", 1}, {"variational-2", 2}, {"midpoint", 1}, {"heun", 2}}) {
    SCOPED_TRACE(integrator);
    std::vector<double> sizes, errors_q, errors_p;
    Eigen::Array2d coarse = three_point_means(integrator, 1);
    for (const int steps : {2, 4, 8}) {
      const Eigen::Array2d fine = three_point_means(integrator, steps);
      sizes.push_back(1.0 / steps);
      errors_q.push_back(std::abs(fine[0] - coarse[0]));
      errors_p.push_back(std::abs(fine[1] - coarse[1]));
      coarse = fine;
    }
    EXPECT_NEAR(fitted_order(sizes, errors_q), order, 0.4);
    EXPECT_NEAR(fitted_order(sizes, errors_p), order, 0.4);
  }
}

// The rule for steps that are too long: roots are those that lead continuously to Δt = 0, or there is an error. Here a
// violent step is taken with every part s of Δt: neighbouring parts must have neighbouring ends.
TEST(Integrators, LongStepsEndOnTheBranchFromZeroOrRefuse) {
  constexpr int kParts = 400;
  for (const auto& row : integrator_table().rows()) {
    const auto integrator = make_integrator(row.name);
    if (!integrator->traits().symplectic) continue;  // the others are explicit
    for (const int d : {1, 2}) {
      SCOPED_TRACE(row.name + " in " + std::to_string(d) + "D");
      Numbers numbers(7);
      const PhaseState start{0.05 * numbers.landmarks(d, 20), 50 * numbers(d, 20)};
      const StochasticSystem system{make_kernel("gaussian:alpha=0.5", start.q), make_noise("none")};
      std::optional<Points> before;
      int found = 0;
      for (int part = 1; part <= kParts; ++part) {
        const double dt = 0.01 * std::pow(double(part) / kParts, 2);
        try {
          const Points q = integrator->integrate(system, start, {dt, 1}, MatrixXd(0, 1)).final().q;
          EXPECT_LE(before ? largest(q - *before) : 0, 0.1) << "dt " << dt;
          before = q;
          ++found;
        } catch (const StepError&) {
          before.reset();
        }
      }
      EXPECT_GT(found, 20);
    }
  }
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
    EXPECT_LE(variational_defect(pair, path), 8 * kEpsilon);
    return path.final().q(1) - path.final().q(0);
  } catch (const StepError&) {
    return std::nullopt;
  }
}

// Calls check(gap, gap after the step) for pairs that run into each other, with κ from 0.1 to 10⁴.
template <class Check>
void for_each_head_on_pair(const Check& check) {
  for_each_variational_combination([&](const Combination& c) {
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
  for_each_variational_combination([&](const Combination& c) {
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

static_assert(std::is_base_of_v<NumericalError, StepError> && !std::is_base_of_v<InputError, StepError>);

TEST(Integrators, StepErrorNamesStepSizeAndRemedy) {
  Problem pair = pair_on_a_line({"variational", "none", "gaussian:alpha=1"}, 0.1, -50);
  pair.grid = {3, 3};
  pair.increments = MatrixXd(0, 3);
  try {
    pair.path();
    FAIL() << "no error";
  } catch (const StepError& error) {
    EXPECT_EQ(error.step(), 0);
    EXPECT_STREQ(
        error.what(),
        "step 1 of 3 (dt = 1): its implicit equation has no unique solution; use more steps, as in `grid.steps = 6`");
  }
}

TEST(Integrators, RefusesNoiseThatItIsNotFor) {
  for (const std::string integrator : {"rk4", "stormer-verlet"}) {
    const Problem problem({integrator, "ch-sd:beta=0.3", "gaussian:alpha=0.9"}, 2, 3);
    try {
      problem.path();
      FAIL() << "no error";
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), "integrator '" + integrator + "' takes no noise, and the noise is 'ch-sd:beta=0.3'");
    }
  }
}

// The momentum equation p + Σ h_i,q w = p̂ ceases to have a root on the branch from w = 0 where I + h_qp w is singular:
// for one landmark and ξ = cos x that is where sin(q) w = 1.
TEST(Integrators, StrongMultiplicativeNoiseIsSolvedOrRefused) {
  for (const double part : {0.5, 0.99, 1.01, 3.0}) {
    Problem problem({"variational", "p-sd:beta=1,fields=cos", "gaussian:alpha=1"}, 1, 1, {1, 1});
    problem.start = {Points::Constant(1, 1, 1), Points::Constant(1, 1, 0.1)};
    problem.increments = MatrixXd::Constant(1, 1, 2 * part / std::sin(1.0));
    if (part < 1)
      EXPECT_NEAR(problem.path().step_momenta(0)(0), 0.1 / (1 - part), 1e-12);
    else
      EXPECT_THROW(problem.path(), StepError) << part;
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
