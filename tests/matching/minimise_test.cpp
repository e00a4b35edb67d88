// How the objective is minimised: solvers, data that are no landmarks, frozen realisations.

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "match.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Solvers, FindTheSameMinimum) {
  for (const std::string noise : {"none", "ch-sd:beta=0.3"}) {
    Match match;
    match.source = Numbers(2).landmarks(2, 5);
    match.target = match.source + 0.2 * Numbers(3)(2, 5);
    match.noise = noise;
    MinimiseOptions options;
    options.gradient_tolerance = 1e-6;
    options.solver = Solver::kGaussNewton;
    const MinimiseSummary newton = minimum(match, options);
    options.solver = Solver::kLbfgs;
    const MinimiseSummary lbfgs = minimum(match, options);
    EXPECT_EQ(newton.solver, Solver::kGaussNewton);
    EXPECT_EQ(lbfgs.solver, Solver::kLbfgs);
    EXPECT_TRUE(newton.converged && lbfgs.converged) << newton.reason << "; " << lbfgs.reason;
    EXPECT_NEAR(newton.solution.cost.total(), lbfgs.solution.cost.total(), 1e-7 * newton.solution.cost.total());
    EXPECT_LE((newton.solution.path().final().q - lbfgs.solution.path().final().q).norm(), 1e-4);
  }
}

TEST(Solvers, HaveNothingToDoForEqualShapes) {
  for (const std::string noise : {"none", "ch-sd:beta=0.3", "trouve-vialard:sigma=1"})
    for (const Solver solver : {Solver::kAuto, Solver::kGaussNewton, Solver::kLbfgs}) {
      Match match;
      match.source = match.target = Numbers(2).landmarks(2, 5);
      match.noise = noise;
      const MinimiseSummary summary = minimum(match, {.solver = solver});
      EXPECT_TRUE(summary.converged) << noise;
      EXPECT_EQ(summary.reason, "the shapes are equal") << noise;
      EXPECT_EQ(summary.iterations, 0) << noise;
      EXPECT_EQ(summary.relative_gradient, 0) << noise;
    }
}

TEST(Solvers, PassOnWhatACallbackThrows) {
  Match match;
  match.source = Numbers(2).landmarks(2, 5);
  match.target = match.source + 0.2 * Numbers(3)(2, 5);
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    MinimiseOptions options;
    options.solver = solver;
    int last = 0;
    options.on_iteration = [&last](int iteration, double, double) {
      if (iteration < last) throw std::domain_error("after the search over paths");
      last = iteration;
    };
    EXPECT_THROW(minimum(match, options), std::domain_error);
  }
}

// ---- data that are no landmarks

// Σ_a log cosh(|q_a − y_a|²/2σ²): no sum of squares.
class SoftTerm final : public DataTerm {
 public:
  SoftTerm(Points target, double sigma) : target_(std::move(target)), sigma_(sigma) {}

  double value(const Points& q) const override { return terms(q).cosh().log().sum(); }
  Points gradient(const Points& q) const override {
    const Points misfit = (q - target_) / (sigma_ * sigma_);
    return misfit * terms(q).tanh().matrix().asDiagonal();
  }
  Linearisation linearise(const Points& q, const MatrixXd& changes) const override {
    const VectorXd roots = terms(q).tanh().sqrt().matrix().transpose().cwiseMax(1e-6);
    const VectorXd scale = roots.transpose().replicate(q.rows(), 1).reshaped() / sigma_;
    return {scale.cwiseInverse().cwiseProduct(gradient(q).reshaped()), scale.asDiagonal() * changes};
  }

 private:
  Eigen::Array<double, 1, Eigen::Dynamic> terms(const Points& q) const {
    return (q - target_).colwise().squaredNorm().array() / (2 * sigma_ * sigma_);
  }

  Points target_;
  double sigma_;
};

TEST(Solvers, TakeDataThatAreNoLandmarks) {
  Match match;
  match.source = Numbers(2).landmarks(2, 5);
  match.target = match.source + 0.2 * Numbers(3)(2, 5);
  MatchingProblem problem = match.objective().problem();
  problem.data = std::make_shared<SoftTerm>(match.target, 0.01);
  const MatchingObjective objective(problem);
  MinimiseOptions options;
  options.gradient_tolerance = 1e-6;
  std::vector<double> costs;
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    SCOPED_TRACE(solver_name(solver));
    options.solver = solver;
    const MinimiseSummary summary = minimise(objective, options);
    EXPECT_TRUE(summary.converged) << summary.reason;
    costs.push_back(summary.solution.cost.total());
  }
  EXPECT_NEAR(costs[0], costs[1], 1e-6 * costs[0]);
}

// ---- frozen realisations

class Realisations : public testing::Test {
 protected:
  Realisations() {
    match_.source = numbers_.landmarks(2, 4);
    match_.target = match_.source + 0.2 * numbers_(2, 4);
    match_.noise = "ch-sd:beta=0.3";
    match_.grid = {0.8, 4};
    for (int i = 0; i < 3; ++i) increments_.emplace_back(0.5 * numbers_(8, 4));
  }

  MatchingObjective with(std::vector<MatrixXd> realisations) const {
    Match match = match_;
    match.realisations = std::move(realisations);
    return match.objective();
  }

  Numbers numbers_{21};
  Match match_;
  std::vector<MatrixXd> increments_;
};

TEST_F(Realisations, LeaveTheMomentaAloneToBeFitted) {
  const MatchingObjective one = with({increments_[0]});
  EXPECT_EQ(one.unknowns(), 8);
  const auto at = one.evaluate(VectorXd::Zero(8)).value();
  EXPECT_EQ(at.path().increments, increments_[0]);
  EXPECT_EQ(at.cost.action, 0);
  EXPECT_EQ(at.cost.energy, 0);
  EXPECT_GT(at.cost.data, 0);
  EXPECT_EQ(match_.objective().unknowns(), 8 + 8 * 4);
}

TEST_F(Realisations, HaveTheGradientOfTheirCost) {
  for (const std::size_t count : {1U, 3U}) {
    SCOPED_TRACE(std::to_string(count) + " realisations");
    const MatchingObjective objective = with({increments_.begin(), increments_.begin() + count});
    const VectorXd z = numbers_(8, 1);
    const auto at = objective.evaluate(z).value();
    ASSERT_EQ(at.paths.size(), count);
    const VectorXd gradient = z + objective.data_gradient(at);
    const double h = 1e-5;
    for (Index i = 0; i < 8; ++i) {
      const auto cost = [&](double step) { return objective.evaluate(z + step * VectorXd::Unit(8, i))->cost.total(); };
      EXPECT_NEAR((cost(h) - cost(-h)) / (2 * h), gradient[i], 1e-7 * gradient.norm());
    }
    const MatchingObjective::Linearisation linear = objective.linearise(at);
    EXPECT_LE((objective.residual(at) - linear.residual).norm(), 1e-14 * linear.residual.norm());
    EXPECT_NEAR(0.5 * linear.residual.squaredNorm(), at.cost.data, 1e-13 * at.cost.data);
    EXPECT_LE((z + linear.jacobian.transpose() * linear.residual - gradient).norm(), 1e-12 * gradient.norm());
  }
}

TEST_F(Realisations, CostTheMeanOfWhatEachCosts) {
  const VectorXd z = numbers_(8, 1);
  double sum = 0;
  for (const MatrixXd& increments : increments_) sum += with({increments}).evaluate(z)->cost.data;
  const auto at = with(increments_).evaluate(z).value();
  EXPECT_NEAR(at.cost.data, sum / 3, 1e-13 * sum);
  EXPECT_NEAR(at.cost.energy, 0.5 * z.squaredNorm(), 1e-14 * z.squaredNorm());
  EXPECT_EQ(at.cost.action, 0);
}

TEST_F(Realisations, AreMatchedOnTheAverage) {
  Match match = match_;
  match.realisations = increments_;
  MinimiseOptions options;
  options.gradient_tolerance = 1e-6;
  const MinimiseSummary summary = minimum(match, options);
  EXPECT_TRUE(summary.converged) << summary.reason;
  const MatchingObjective objective = match.objective();
  const VectorXd gradient = summary.solution.z + objective.data_gradient(summary.solution);
  EXPECT_LE(gradient.norm(), 1e-2 * summary.solution.z.norm());
  EXPECT_EQ(summary.solution.paths.size(), 3U);
}

}  // namespace
}  // namespace pulson::matching
