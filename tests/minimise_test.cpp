// How the objective is minimised: the quadratic model, searches by several ways, continuation, frozen realisations.

#include "pulson/matching/minimise.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "pulson/matching/landmark_term.hpp"
#include "quadratic_model.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// ---- the quadratic model

// A model with more unknowns than residuals, and the same with as many residuals, the others 0: the first is factored
// in the space of the data, the second in that of the unknowns.
class Models : public testing::Test {
 protected:
  static constexpr Index kUnknowns = 17;
  static constexpr Index kResiduals = 6;

  Models() {
    wide_ = {numbers_(kResiduals, 1), numbers_(kResiduals, kUnknowns)};
    padded_ = {padded(wide_.residual), MatrixXd::Zero(kUnknowns, kUnknowns)};
    padded_.jacobian.topRows(kResiduals) = wide_.jacobian;
  }

  static VectorXd padded(const VectorXd& residual) {
    VectorXd longer = VectorXd::Zero(kUnknowns);
    longer.head(kResiduals) = residual;
    return longer;
  }

  // I + μR + JᵀJ
  MatrixXd dense(double mu) const {
    MatrixXd b = wide_.jacobian.transpose() * wide_.jacobian;
    b.diagonal().array() += 1 + mu * roughness_.array();
    return b;
  }

  Numbers numbers_{11};
  VectorXd roughness_ = VectorXd::Ones(kUnknowns) + numbers_(kUnknowns, 1).cwiseAbs() * 40;
  VectorXd z_ = numbers_(kUnknowns, 1);
  VectorXd excess_ = numbers_(kResiduals, 1);
  MatchingObjective::Linearisation wide_, padded_;
};

TEST_F(Models, AreTheSameInTheSpaceOfTheDataAndInThatOfTheUnknowns) {
  QuadraticModel in_data(wide_, roughness_);
  QuadraticModel in_unknowns(padded_, roughness_);
  for (const double mu : {0.0, 1e-3, 2.0, 1e4}) {
    SCOPED_TRACE("damping " + std::to_string(mu));
    in_data.set_damping(mu);
    in_unknowns.set_damping(mu);
    EXPECT_LE((in_data.step(z_) - in_unknowns.step(z_)).norm(), 1e-13 * in_data.step(z_).norm());
    const VectorXd correction = in_data.correction(excess_);
    EXPECT_LE((correction - in_unknowns.correction(padded(excess_))).norm(), 1e-13 * correction.norm());
    EXPECT_LE((in_data.solve(z_) - in_unknowns.solve(z_)).norm(), 1e-13 * z_.norm());
    EXPECT_NEAR(in_data.log_determinant(), in_unknowns.log_determinant(), 1e-12);
  }
}

TEST_F(Models, SolveTheirDenseSystems) {
  for (const auto* at : {&wide_, &padded_}) {
    QuadraticModel model(*at, roughness_);
    for (const double mu : {0.0, 2.0}) {
      model.set_damping(mu);
      const MatrixXd b = dense(mu);
      EXPECT_LE((b * model.solve(z_) - z_).norm(), 1e-12 * z_.norm());
      const VectorXd gradient = z_ + wide_.jacobian.transpose() * wide_.residual;
      EXPECT_LE((b * model.step(z_) + gradient).norm(), 1e-12 * gradient.norm());
      EXPECT_NEAR(model.log_determinant(), 2 * b.llt().matrixLLT().diagonal().array().log().sum(), 1e-12);
    }
  }
}

TEST_F(Models, BeginWithoutDamping) {
  const VectorXd expected = dense(0).ldlt().solve(z_);
  EXPECT_LE((QuadraticModel(wide_, roughness_).solve(z_) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LE((QuadraticModel(padded_, roughness_).solve(z_) - expected).norm(), 1e-12 * expected.norm());
}

// ---- searches

struct Match {
  Points source, target;
  std::string kernel = "gaussian:alpha=0.5";
  std::string noise = "none";
  TimeGrid grid{1, 20};
  double sigma = 0.2;
  std::vector<MatrixXd> realisations{};

  MatchingObjective objective() const {
    Landmarks shape;
    shape.points = source;
    return MatchingObjective({{make_kernel(kernel, source), make_noise(noise, shape)},
                              make_integrator("variational"),
                              grid,
                              source,
                              std::make_shared<LandmarkTerm>(LandmarkObservations{target, sigma}),
                              sigma,
                              1,
                              realisations});
  }
};

MinimiseSummary minimum(const Match& match, const MinimiseOptions& options) {
  const MatchingObjective objective = match.objective();
  MinimiseSummary summary = minimise(objective, options);
  EXPECT_LE(summary.resolved, objective.unknowns());
  EXPECT_GT(summary.resolved, 0);
  return summary;
}

// Two squares of side 2·`half`, `apart` from centre to centre, that change places by half a turn about the origin.
Match exchange(double half, double apart) {
  Match match;
  match.source.resize(2, 8);
  int a = 0;
  for (const double side : {-1.0, 1.0})
    for (const double x : {-half, half})
      for (const double y : {-half, half}) match.source.col(a++) << side * apart / 2 + x, y;
  match.target = -match.source;
  return match;
}

// The angle by which the centre of the first square turns about the origin, to the left.
double turn(const Trajectory& path) {
  double angle = 0;
  for (std::size_t k = 1; k < path.states.size(); ++k) {
    const Eigen::Vector2d from = path.states[k - 1].q.leftCols(4).rowwise().mean();
    const Eigen::Vector2d to = path.states[k].q.leftCols(4).rowwise().mean();
    angle += std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
  }
  return angle;
}

MinimiseOptions with_starts(int starts) {
  MinimiseOptions options;
  options.starts = starts;
  return options;
}

int searches(const MinimiseSummary& summary) {
  int count = 0;
  for (const Minimum& each : summary.minima) count += each.found;
  return count;
}

// Momenta mirrored in the x axis, which maps the squares on themselves.
Points mirrored(const Match& match, Points p) {
  p.row(1) *= -1;
  Points moved(2, p.cols());
  for (Index a = 0; a < p.cols(); ++a) {
    const Eigen::Vector2d place(match.source(0, a), -match.source(1, a));
    Index b = 0;
    (match.source.colwise() - place).colwise().norm().minCoeff(&b);
    moved.col(b) = p.col(a);
  }
  return moved;
}

// The squares can turn round each other to the left or to the right, at the same cost.
TEST(Starts, FindBothWaysRoundOfTwoSquares) {
  const Match match = exchange(0.2, 1);
  const MatchingObjective objective = match.objective();
  const MinimiseSummary summary = minimum(match, with_starts(3));
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_EQ(searches(summary), 3);
  ASSERT_GE(summary.minima.size(), 2U);
  const Minimum& first = summary.minima[0];
  const Minimum& second = summary.minima[1];
  EXPECT_TRUE(first.converged);
  EXPECT_TRUE(second.converged);
  EXPECT_EQ(first.cost.total(), summary.solution.cost.total());
  EXPECT_NEAR(first.cost.total(), second.cost.total(), 1e-5 * first.cost.total());
  EXPECT_NEAR(std::abs(turn(summary.solution.path())), std::numbers::pi, 0.15);

  // The second is not the first once more: the first, mirrored, is a minimum of that cost with the opposite turn.
  const Points p = mirrored(match, objective.momenta(summary.solution.z));
  const auto other = objective.evaluate(objective.white(p, MatrixXd::Zero(0, match.grid.steps)));
  ASSERT_TRUE(other.has_value());
  EXPECT_NEAR(other->cost.total(), second.cost.total(), 1e-5 * second.cost.total());
  EXPECT_NEAR(turn(other->path()), -turn(summary.solution.path()), 1e-6);
}

// Way 1 turns to the left and way 2 to the right: one start more finds the other.
TEST(Starts, TurnTheFirstWayToTheLeft) {
  const MinimiseSummary two = minimum(exchange(0.2, 1), with_starts(2));
  EXPECT_EQ(two.start, "way 2");
  EXPECT_EQ(searches(two), 2);
  EXPECT_NEAR(turn(two.solution.path()), std::numbers::pi, 0.15);
}

TEST(Starts, AreSortedByTheirCosts) {
  const MinimiseSummary summary = minimum(exchange(0.2, 1), with_starts(4));
  EXPECT_EQ(searches(summary), 4);
  for (std::size_t i = 1; i < summary.minima.size(); ++i)
    EXPECT_LE(summary.minima[i - 1].cost.total(), summary.minima[i].cost.total());
}

// Where there is but one minimum, all find it; noise in the positions adds a start.
TEST(Starts, AreCountedAtTheirMinimum) {
  Match match;
  match.source = Numbers(2).landmarks(2, 4);
  match.target = match.source.array() + 0.05;
  MinimiseOptions options = with_starts(3);
  options.gradient_tolerance = 1e-6;
  const MinimiseSummary quiet = minimum(match, options);
  ASSERT_EQ(quiet.minima.size(), 1U);
  EXPECT_EQ(quiet.minima[0].found, 3);
  match.noise = "ch-sd:beta=0.3";
  EXPECT_EQ(searches(minimum(match, options)), 4);
}

// Squares that are small beside the kernel, and data that are held firmly: the flow's start is out of bounds, and the
// search from rest gets stuck.
Match stiff_exchange() {
  Match match = exchange(0.1, 1);
  match.kernel = "gaussian:alpha=0.5";
  match.sigma = 0.05;
  return match;
}

TEST(Ways, AreTriedWhereShapesStayApart) {
  const Match match = stiff_exchange();
  const MatchingObjective objective = match.objective();
  const MinimiseSummary summary = minimise(objective, {});
  EXPECT_TRUE(summary.start == "way 2" || summary.start == "way 3") << summary.start;
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_NEAR(std::abs(turn(summary.solution.path())), std::numbers::pi, 0.1);
  EXPECT_EQ(searches(summary), 3);
}

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

// With so many landmarks on an outline there are pivots, and rough directions that are left for last.
TEST(Solvers, ResolveNoMoreUnknownsThanThereAre) {
  Match match;
  match.source.resize(2, 260);
  for (int a = 0; a < 260; ++a) {
    const double angle = 2 * std::numbers::pi * a / 260;
    match.source.col(a) << std::cos(angle), std::sin(angle);
  }
  match.target = Eigen::DiagonalMatrix<double, 2>(1.2, 0.9) * match.source;
  match.grid.steps = 5;
  const MatchingObjective objective = match.objective();
  ASSERT_LT(objective.unknowns(), 2 * 260);
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    MinimiseOptions options;
    options.solver = solver;
    const MinimiseSummary summary = minimum(match, options);
    EXPECT_TRUE(summary.converged) << summary.reason;
    if (solver == Solver::kLbfgs) {
      EXPECT_EQ(summary.resolved, objective.unknowns());
    }
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
    EXPECT_EQ(searches(summary), 1);
    if (solver == Solver::kGaussNewton) {  // there is no flow to begin with
      EXPECT_GT(summary.continuation_stages, 0);
      EXPECT_EQ(summary.start, "rest");
      EXPECT_EQ(summary.resolved, objective.unknowns());
    }
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
  MinimiseOptions options = with_starts(2);
  options.gradient_tolerance = 1e-6;
  const MinimiseSummary summary = minimum(match, options);
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_EQ(searches(summary), 2);
  const MatchingObjective objective = match.objective();
  const VectorXd gradient = summary.solution.z + objective.data_gradient(summary.solution);
  EXPECT_LE(gradient.norm(), 1e-2 * summary.solution.z.norm());
  EXPECT_EQ(summary.solution.paths.size(), 3U);
}

}  // namespace
}  // namespace pulson
