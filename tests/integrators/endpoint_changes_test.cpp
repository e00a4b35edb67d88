// Many tangents of a path at once, and the linear systems of long steps.

#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "implicit_step.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Landmarks whose momenta are zero, and landmarks whose momenta change.
struct Pattern {
  std::string name;
  bool (*at_rest)(Index landmark);
  bool (*changed)(Index landmark);
};

const std::vector<Pattern> kPatterns = {
    {"all move", [](Index) { return false; }, [](Index) { return true; }},
    {"some are carried", [](Index a) { return a % 3 != 1; }, [](Index a) { return a == 1; }},
    {"some start to move", [](Index a) { return a % 3 != 1; }, [](Index a) { return a == 0 || a == 1; }},
    {"changes touch some", [](Index) { return false; }, [](Index a) { return a == 2; }},
    {"all at rest, one changed", [](Index) { return true; }, [](Index a) { return a == 1; }},
    {"nothing happens", [](Index) { return true; }, [](Index) { return false; }}};

// The path with those momenta zero, and `columns` changes of those momenta.
struct Changed {
  Changed(Problem& problem, const Pattern& pattern, Index columns) {
    for (Index a = 0; a < problem.start.p.cols(); ++a)
      if (pattern.at_rest(a)) problem.start.p.col(a).setZero();
    path = problem.path();
    const Index d = problem.start.p.rows();
    changes = problem.numbers(problem.start.p.size(), columns);
    for (Index a = 0; a < problem.start.p.cols(); ++a)
      if (!pattern.changed(a)) changes.middleRows(a * d, d).setZero();
  }
  MatrixXd ends(const Problem& problem) const {
    return problem.integrator->endpoint_changes(problem.system, path, changes);
  }

  Trajectory path;
  MatrixXd changes;
};

void expect_tangents(const Problem& problem, const Changed& of, const MatrixXd& ends) {
  const Index d = problem.start.q.rows();
  const Index n = problem.start.q.cols();
  ASSERT_EQ(ends.rows(), d * n);
  ASSERT_EQ(ends.cols(), of.changes.cols());
  const MatrixXd still = MatrixXd::Zero(problem.increments.rows(), problem.increments.cols());
  for (Index i = 0; i < ends.cols(); ++i) {
    const PathChange change{{Points::Zero(d, n), of.changes.col(i).reshaped(d, n)}, still, {}};
    const Points end = problem.integrator->tangent(problem.system, of.path, change).q;
    EXPECT_LE(largest(ends.col(i) - end.reshaped()), 1e-12 * largest(end)) << "change " << i;
  }
}

void expect_jacobian(const Problem& problem, const Changed& of, const MatrixXd& ends) {
  const MatrixXd expected = problem.integrator->endpoint_jacobian(problem.system, of.path).momenta * of.changes;
  EXPECT_LE(largest(ends - expected), 1e-12 * largest(expected));
}

class EndpointChanges : public testing::TestWithParam<Combination> {};

INSTANTIATE_TEST_SUITE_P(All, EndpointChanges, testing::ValuesIn(all_combinations()),
                         [](const auto& row) { return test_name(row.param); });

TEST_P(EndpointChanges, AreTangentsAndTheJacobianTimesTheChanges) {
  for (int d = 1; d <= 3; ++d) {
    for (const Pattern& pattern : kPatterns) {
      SCOPED_TRACE("d = " + std::to_string(d) + ", " + pattern.name);
      Problem problem(GetParam(), d, 5);
      const Changed of(problem, pattern, 3);
      const MatrixXd ends = of.ends(problem);
      expect_tangents(problem, of, ends);
      expect_jacobian(problem, of, ends);
    }
  }
}

// More landmarks that are carried, and more changes, than are done at once.
TEST(ManyEndpointChanges, AreTangentsWithTheSameBitsOnAnyNumberOfThreads) {
  for (int d = 1; d <= 3; ++d) {
    SCOPED_TRACE("d = " + std::to_string(d));
    Problem problem({"variational", "ch-sd:beta=0.3", "gaussian:alpha=0.9"}, d, 140);
    const Pattern pattern{"", [](Index a) { return a % 50 != 3; }, [](Index a) { return a % 50 == 3 || a == 7; }};
    const Changed of(problem, pattern, 131);
    set_thread_count(1);
    const MatrixXd ends = of.ends(problem);
    expect_tangents(problem, of, ends);
    expect_jacobian(problem, of, ends);
    for (const int threads : {2, 3}) {
      set_thread_count(threads);
      EXPECT_EQ(of.ends(problem), ends) << threads << " threads";
    }
    set_thread_count(0);
  }
}

TEST(NoEndpointChanges, HaveNoColumns) {
  Problem problem({"variational", "none", "gaussian:alpha=0.9"}, 2, 4);
  const MatrixXd ends = Changed(problem, kPatterns[0], 0).ends(problem);
  EXPECT_EQ(ends.rows(), 8);
  EXPECT_EQ(ends.cols(), 0);
}

// ---- steps whose linear systems do not yield to the fixed-point iteration

double spectral_radius(const MatrixXd& matrix) { return matrix.eigenvalues().cwiseAbs().maxCoeff(); }

// A path of 70 landmarks, in a step of which the iteration x ← b + Jx grows.
struct LongSteps {
  explicit LongSteps(const std::string& noise)
      : problem({"variational", noise, "gaussian:alpha=2"}, 2, 70, {1.2, 2}, 2), path(problem.path()) {}

  double radius() const {
    double largest = 0;
    for (int k = 0; k < path.grid.steps; ++k) {
      const Points& q = path.states[static_cast<std::size_t>(k) + 1].q;
      const MatrixXd step = problem.system.kernel.step_matrices(q, path.step_momenta(k), path.grid.dt()).tangent;
      largest = std::max(largest, spectral_radius(step));
    }
    return largest;
  }

  Problem problem;
  Trajectory path;
};

TEST(LongStepsOfManyLandmarks, HaveAnAdjointThatIsTheTransposeOfTheTangent) {
  for (const std::string noise : {"none", "ch-sd:beta=0.3"}) {
    SCOPED_TRACE(noise);
    LongSteps steps(noise);
    Problem& problem = steps.problem;
    ASSERT_GT(steps.radius(), 1);
    ASSERT_GT(steps.path.continuation_steps, 0);
    ASSERT_GT(problem.start.q.size(), 100);
    for (int trial = 0; trial < 5; ++trial) {
      const PathChange change = problem.random_change();
      const PhaseState bar = problem.random_state();
      const PhaseState tangent = problem.integrator->tangent(problem.system, steps.path, change);
      const PathGradient gradient = problem.integrator->adjoint(problem.system, steps.path, bar);
      EXPECT_NEAR(dot(gradient, change), dot(tangent, bar), 1e-11 * norm(tangent) * norm(bar));
    }
  }
}

// LU factors of all steps against what the tangents do.
TEST(LongStepsOfManyLandmarks, MoveAsTheJacobianSays) {
  LongSteps steps("none");
  const Changed of(steps.problem, kPatterns[0], 3);
  const MatrixXd ends = of.ends(steps.problem);
  const MatrixXd expected =
      steps.problem.integrator->endpoint_jacobian(steps.problem.system, of.path).momenta * of.changes;
  EXPECT_LE((ends - expected).norm(), 1e-11 * expected.norm());
  expect_tangents(steps.problem, of, ends);
}

// (I − J)x = b with a random J of a spectral radius.
struct LinearSystem {
  LinearSystem(Index cols, double radius) : b(Numbers(3)(2, cols)), matrix(Numbers(4)(2 * cols, 2 * cols)) {
    matrix *= radius / spectral_radius(matrix);
  }
  // Whether `matrix` was asked for.
  bool solve(int blocks, Points& x) const {
    bool factored = false;
    x = solve_linear([&](const Points& v) -> Points { return (matrix * v.reshaped()).reshaped(2, v.cols()); },
                     [&] {
                       factored = true;
                       return matrix;
                     },
                     b, blocks);
    return factored;
  }
  double error(const Points& x) const {
    return (x.reshaped() - matrix * x.reshaped() - b.reshaped()).norm() / b.norm();
  }

  Points b;
  MatrixXd matrix;
};

TEST(SolveLinear, NeedsNoMatrixWhileTheIterationContracts) {
  for (const Index cols : {2, 60}) {
    const LinearSystem system(cols, 0.05);
    Points x;
    EXPECT_FALSE(system.solve(1, x));
    EXPECT_LE(system.error(x), 1e-14);
  }
}

TEST(SolveLinear, NeedsNoMatrixWhereTheKrylovSpaceIsLargeEnough) {
  LinearSystem system(60, 0.5);
  const VectorXd u = Numbers(5)(120, 1);
  const VectorXd v = Numbers(6)(120, 1);
  system.matrix += (3 / u.squaredNorm()) * u * u.transpose() + (2 / v.squaredNorm()) * v * v.transpose();
  ASSERT_GT(spectral_radius(system.matrix), 1);
  Points x;
  EXPECT_FALSE(system.solve(1, x));
  EXPECT_LE(system.error(x), 1e-13);
}

TEST(SolveLinear, FactorsWhatIsSmallOrInBlocksOrWithoutAUsefulKrylovSpace) {
  Points x;
  const LinearSystem small(50, 2), blocks(60, 0.97), wild(200, 20);
  EXPECT_TRUE(small.solve(1, x));
  EXPECT_LE(small.error(x), 1e-11);
  EXPECT_TRUE(blocks.solve(2, x));
  EXPECT_LE(blocks.error(x), 1e-11);
  EXPECT_TRUE(wild.solve(1, x));
  EXPECT_LE(wild.error(x), 1e-11);
}

TEST(SolveLinear, GivesNothingForNothing) {
  LinearSystem system(60, 3);
  system.b.setZero();
  Points x;
  system.solve(1, x);
  EXPECT_EQ(x, Points(Points::Zero(2, 60)));
}

}  // namespace
}  // namespace pulson
