#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "integrator_oracle.hpp"
#include "numbers.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class IntegratorContract : public testing::TestWithParam<Combination> {
 protected:
  // Calls check(problem) for N = 1 … `most` in d = 1, 2, 3, where the noise can be had; `on=1/3` needs three landmarks.
  template <class Check>
  static void for_each_problem(int most, const Check& check) {
    const int least = GetParam().noise.find("on=") == std::string::npos ? 1 : 3;
    for (int d = 1; d <= 3; ++d) {
      for (int n = least; n <= most; ++n) {
        SCOPED_TRACE("d = " + std::to_string(d) + ", N = " + std::to_string(n));
        Problem problem(GetParam(), d, n);
        check(problem);
      }
    }
  }
  static bool symplectic(const Problem& problem) {
    return problem.integrator->traits().symplectic && problem.system.noise->traits().hamiltonian;
  }
};

INSTANTIATE_TEST_SUITE_P(All, IntegratorContract, testing::ValuesIn(all_combinations()),
                         [](const auto& row) { return test_name(row.param); });

using Jet = ceres::Jet<double, 3>;

// Entries of x; the derivative of entry i along direction `part` is change[i].
std::vector<Jet> with_change(const MatrixXd& x, const MatrixXd& change, int part) {
  std::vector<Jet> jets;
  for (Index i = 0; i < x.size(); ++i) {
    jets.emplace_back(x.reshaped()[i]);
    jets.back().v[part] = change.reshaped()[i];
  }
  return jets;
}

MatrixXd values(const std::vector<Jet>& jets, int d) {
  MatrixXd x(d, static_cast<Index>(jets.size()) / d);
  for (Index i = 0; i < x.size(); ++i) x.reshaped()[i] = jets[static_cast<std::size_t>(i)].a;
  return x;
}

MatrixXd changes(const std::vector<Jet>& jets, int d, int part) {
  MatrixXd x(d, static_cast<Index>(jets.size()) / d);
  for (Index i = 0; i < x.size(); ++i) x.reshaped()[i] = jets[static_cast<std::size_t>(i)].v[part];
  return x;
}

// Random directions of q0, of p0 and of the increments are the three parts of the dual numbers. The oracle of noise
// that is not additive is slow.
TEST_P(IntegratorContract, AgreesWithTheOracleAndItsDualNumbers) {
  const bool additive = Problem(GetParam(), 2, 3).system.noise->traits().additive;
  for_each_problem(additive ? 5 : 3, [&](Problem& problem) {
    const int d = static_cast<int>(problem.start.q.rows());
    const int n = static_cast<int>(problem.start.q.cols());
    if (!additive && d + n > 5) return;
    const DefinedNoise noise(GetParam().noise, problem.shape);
    const Oracle oracle(GetParam().integrator, noise, problem.system.noise->traits().compensated,
                        problem.system.kernel.terms(), d, n, problem.grid);
    const PhaseState u = problem.random_state();
    const MatrixXd dw = problem.numbers(problem.increments.rows(), problem.increments.cols());
    const auto end = oracle.run<Jet>({with_change(problem.start.q, u.q, 0), with_change(problem.start.p, u.p, 1)},
                                     with_change(problem.increments, dw, 2));

    const Trajectory path = problem.path();
    EXPECT_LE(largest(path.final().q - values(end.q, d)), 1e-13 * std::max(1.0, largest(path.final().q)));
    EXPECT_LE(largest(path.final().p - values(end.p, d)), 1e-13 * std::max(1.0, largest(path.final().p)));

    const Points zero = Points::Zero(d, n);
    const MatrixXd still = MatrixXd::Zero(dw.rows(), dw.cols());
    const PhaseState bar = problem.random_state();
    const PathGradient gradient = problem.integrator->adjoint(problem.system, path, bar);
    const std::array<PathChange, 3> changes_of{PathChange{{u.q, zero}, still, {}}, PathChange{{zero, u.p}, still, {}},
                                               PathChange{{zero, zero}, dw, {}}};
    const std::array<double, 3> along{dot(gradient.q0_bar, u.q), dot(gradient.p0_bar, u.p),
                                      dot(gradient.increments_bar, dw)};
    for (int part = 0; part < 3; ++part) {
      SCOPED_TRACE("part " + std::to_string(part));
      const auto i = static_cast<std::size_t>(part);
      const PhaseState expected{changes(end.q, d, part), changes(end.p, d, part)};
      const PhaseState tangent = problem.integrator->tangent(problem.system, path, changes_of[i]);
      EXPECT_LE(norm({tangent.q - expected.q, tangent.p - expected.p}), 1e-10 * norm(expected));
      EXPECT_NEAR(along[i], dot(bar, expected), 1e-10 * norm(bar) * norm(expected));
    }
  });
}

TEST_P(IntegratorContract, AdjointIsTheTransposeOfTheTangent) {
  for_each_problem(12, [](Problem& problem) {
    const Trajectory path = problem.path();
    const PathChange change = problem.random_change();
    const PhaseState bar = problem.random_state();
    const PhaseState tangent = problem.integrator->tangent(problem.system, path, change);
    EXPECT_NEAR(dot(problem.integrator->adjoint(problem.system, path, bar), change), dot(tangent, bar),
                1e-12 * norm(tangent) * norm(bar));
  });
}

// The parameters of the noise change along.
TEST_P(IntegratorContract, TaylorRemainderIsOfSecondOrder) {
  Problem problem(GetParam(), 2, 5);
  const PhaseState bar = problem.random_state();
  const PathChange change = problem.random_change();
  const Trajectory path = problem.path();
  const double slope = dot(problem.integrator->tangent(problem.system, path, change), bar);
  std::vector<double> sizes;
  std::vector<double> remainders;
  for (double h = 2e-3; h > 1e-4; h /= 2) {
    const StochasticSystem system{
        problem.system.kernel,
        problem.system.noise->with_parameters(problem.system.noise->parameters() + h * change.parameters)};
    const Trajectory moved = problem.integrator->integrate(
        system, {problem.start.q + h * change.initial.q, problem.start.p + h * change.initial.p}, problem.grid,
        problem.increments + h * change.increments);
    sizes.push_back(h);
    remainders.push_back(std::abs(dot(moved.final(), bar) - dot(path.final(), bar) - h * slope));
  }
  EXPECT_NEAR(fitted_order(sizes, remainders), 2, 0.1);
}

TEST_P(IntegratorContract, RowsOfTheEndpointJacobianAreAdjoints) {
  for_each_problem(5, [](Problem& problem) {
    const Trajectory path = problem.path();
    const EndpointJacobian jacobian = problem.integrator->endpoint_jacobian(problem.system, path);
    ASSERT_EQ(jacobian.momenta.rows(), problem.start.q.size());
    ASSERT_EQ(jacobian.increments.cols(), problem.increments.size());
    for (Index r = 0; r < problem.start.q.size(); ++r) {
      PhaseState unit{Points::Zero(problem.start.q.rows(), problem.start.q.cols()), {}};
      unit.p = unit.q;
      unit.q.reshaped()[r] = 1;
      const PathGradient row = problem.integrator->adjoint(problem.system, path, unit);
      EXPECT_LE(largest(jacobian.momenta.row(r).transpose() - row.p0_bar.reshaped()), 1e-12 * largest(row.p0_bar));
      EXPECT_LE(largest(jacobian.increments.row(r).transpose() - row.increments_bar.reshaped()),
                1e-12 * largest(row.increments_bar));
    }
  });
}

// With momenta, and without, where there are no rows of theirs.
TEST_P(IntegratorContract, RowsAreAdjoints) {
  for_each_problem(4, [](Problem& problem) {
    const Index size = problem.start.q.size();
    for (const bool rest : {false, true}) {
      if (rest) problem.start.p.setZero();
      const bool at_rest = is_at_rest(problem.system, problem.start);
      EXPECT_EQ(at_rest, rest && problem.system.noise->traits().linear);
      const Trajectory path = problem.path();
      const MatrixXd by_end = problem.numbers(3, at_rest ? size : 2 * size);
      const PathRows rows = problem.integrator->adjoint_rows(problem.system, path, by_end);
      for (Index r = 0; r < by_end.rows(); ++r) {
        PhaseState bar{by_end.row(r).head(size).reshaped(problem.start.q.rows(), problem.start.q.cols()),
                       Points::Zero(problem.start.q.rows(), problem.start.q.cols())};
        if (!at_rest) bar.p.reshaped() = by_end.row(r).tail(size);
        const PathGradient row = problem.integrator->adjoint(problem.system, path, bar);
        EXPECT_LE(largest(rows.start.row(r).head(size).transpose() - row.q0_bar.reshaped()),
                  1e-12 * (1 + largest(row.q0_bar)));
        if (!at_rest) {
          EXPECT_LE(largest(rows.start.row(r).tail(size).transpose() - row.p0_bar.reshaped()),
                    1e-12 * (1 + largest(row.p0_bar)));
        }
        EXPECT_LE(largest(rows.increments.row(r).transpose() - row.increments_bar.reshaped()),
                  1e-12 * (1 + largest(row.increments_bar)));
      }
    }
  });
}

// Of the others the defect shows, so that the test can fail.
TEST_P(IntegratorContract, IsSymplecticWithFrozenIncrementsWhereItSaysSo) {
  for_each_problem(4, [](Problem& problem) {
    const Trajectory path = problem.path();
    const Index d = problem.start.q.rows();
    const Index half = problem.start.q.size();
    const MatrixXd still = MatrixXd::Zero(problem.increments.rows(), problem.increments.cols());
    MatrixXd m(2 * half, 2 * half);
    for (Index i = 0; i < 2 * half; ++i) {
      const VectorXd unit = VectorXd::Unit(2 * half, i);
      const PhaseState column = problem.integrator->tangent(
          problem.system, path,
          {{unit.head(half).reshaped(d, half / d), unit.tail(half).reshaped(d, half / d)}, still, {}});
      m.col(i) << column.q.reshaped(), column.p.reshaped();
    }
    MatrixXd form = MatrixXd::Zero(2 * half, 2 * half);
    form.topRightCorner(half, half).setIdentity();
    form.bottomLeftCorner(half, half) = -MatrixXd::Identity(half, half);
    const double defect = largest(m.transpose() * form * m - form);
    if (symplectic(problem)) {
      EXPECT_LE(defect, 1e-11);
    } else if (half / d > 2) {
      EXPECT_GT(defect, 1e-11);
    }
  });
}

// The oracle compares the others.
class VariationalContract : public IntegratorContract {};

std::vector<Combination> variational_combinations() {
  std::vector<Combination> all = all_combinations();
  std::erase_if(
      all, [](const Combination& c) { return c.integrator != "variational" && c.integrator != "variational-paper"; });
  return all;
}

INSTANTIATE_TEST_SUITE_P(All, VariationalContract, testing::ValuesIn(variational_combinations()),
                         [](const auto& row) { return test_name(row.param); });

TEST_P(VariationalContract, SolvesItsEquationsToRoundOff) {
  for_each_problem(12, [](Problem& problem) { EXPECT_LE(variational_defect(problem, problem.path()), 8 * kEpsilon); });
}

// Where the potentials do not change under translation and there is no friction; else it changes for all to see.
TEST_P(IntegratorContract, KeepsTheTotalMomentumWhereItShould) {
  const NoiseTraits traits = Problem(GetParam(), 2, 3).system.noise->traits();
  const bool kept = traits.translation_invariant && traits.hamiltonian;
  // Noise that is not additive drives landmarks into one another in the long run.
  const TimeGrid grid = !kept ? TimeGrid{4, 400} : TimeGrid{traits.additive ? 100.0 : 4.0, 10'000};
  const Problem problem(GetParam(), 2, 3, grid, 0.3);
  const VectorXd total = problem.start.p.rowwise().sum();
  double worst = 0;
  for (const PhaseState& state : problem.path().states)
    worst = std::max(worst, largest(state.p.rowwise().sum() - total));
  if (kept)
    EXPECT_LE(worst, 1e-12 * problem.start.p.cwiseAbs().sum());
  else
    EXPECT_GT(worst, 1e-3 * problem.start.p.cwiseAbs().sum());
}

}  // namespace
}  // namespace pulson
