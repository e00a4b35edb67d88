#include <limits>
#include <utility>

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::VectorXd;

// Pairs of steps and changes of the gradient that stand for the second derivatives.
constexpr int kLbfgsRank = 30;
// Gains below the rounding of J, over J.
constexpr double kLbfgsRounding = 1e-15;

// Where the search is, for Ceres, which keeps numbers alone.
struct LbfgsState {
  const MatchingObjective& objective;
  MinimiseSummary& summary;  // its solution is the best point of all
  const char* failure = nullptr;

  // J, and its gradient; false where there is no path: the line search turns back to shorter steps.
  bool evaluate(const VectorXd& z, double& cost, VectorXd& slope) {
    ++summary.evaluations;
    auto at = objective.evaluate(z);
    if (!at) {
      failure = kTooCoarse;
      return false;
    }
    slope = z + objective.data_gradient(*at);
    if (!slope.allFinite()) {
      failure = "the gradient leaves the range of numbers";
      return false;
    }
    cost = at->cost.total();
    if (cost > summary.solution.cost.total()) return true;
    summary.solution = std::move(*at);
    summary.relative_gradient = relative_gradient(z, slope);
    return true;
  }
};

class LbfgsCost final : public ceres::FirstOrderFunction {
 public:
  explicit LbfgsCost(LbfgsState& state) : state_(state) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const VectorXd z = Eigen::Map<const VectorXd>(parameters, NumParameters());
    VectorXd slope;
    if (!state_.evaluate(z, *cost, slope)) return false;
    if (gradient != nullptr) Eigen::Map<VectorXd>(gradient, NumParameters()) = slope;
    return true;
  }

  int NumParameters() const override { return static_cast<int>(state_.objective.unknowns()); }

 private:
  LbfgsState& state_;
};

// Reports each iteration, and decides whether it is the last. What a user's function throws passes through Ceres.
class LbfgsProgress final : public ceres::IterationCallback {
 public:
  LbfgsProgress(LbfgsState& state, const MinimiseOptions& options) : state_(state), options_(options) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    MinimiseSummary& summary = state_.summary;
    state_.failure = nullptr;  // of a trial that a shorter step replaced
    summary.iterations = iteration.iteration;
    if (options_.on_iteration && iteration.iteration > 0)
      options_.on_iteration(summary.iterations, summary.solution.cost.total(), summary.relative_gradient);
    if (summary.relative_gradient <= options_.gradient_tolerance) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    if (!options_.is_interrupted()) return ceres::SOLVER_CONTINUE;
    summary.reason = kInterrupted;
    return ceres::SOLVER_ABORT;
  }

 private:
  LbfgsState& state_;
  const MinimiseOptions& options_;
};

ceres::GradientProblemSolver::Options lbfgs_options(const MinimiseOptions& options) {
  ceres::GradientProblemSolver::Options ceres_options;  // L-BFGS, Wolfe's conditions
  ceres_options.max_lbfgs_rank = kLbfgsRank;
  ceres_options.use_approximate_eigenvalue_bfgs_scaling = true;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.function_tolerance = kLbfgsRounding;
  ceres_options.gradient_tolerance = ceres_options.parameter_tolerance = 0;  // LbfgsProgress tests the gradient
  ceres_options.logging_type = ceres::SILENT;
  return ceres_options;
}

const char* reason_of(const ceres::GradientProblemSolver::Summary& ended, const char* failure) {
  if (ended.termination_type == ceres::CONVERGENCE) return "no step lowers the cost by more than round-off";
  if (ended.termination_type == ceres::NO_CONVERGENCE) return "the limit of iterations was reached";
  return failure != nullptr ? failure : "the line search failed";
}

}  // namespace

MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start) {
  MinimiseSummary summary{
      .solver = Solver::kLbfgs, .relative_gradient = std::numeric_limits<double>::max(), .solution = std::move(start)};
  LbfgsState state{objective, summary};
  LbfgsProgress progress(state, options);
  ceres::GradientProblemSolver::Options ceres_options = lbfgs_options(options);
  ceres_options.callbacks.push_back(&progress);
  VectorXd z = summary.solution.z;
  ceres::GradientProblemSolver::Summary ended;
  ceres::Solve(ceres_options, ceres::GradientProblem(new LbfgsCost(state)), z.data(), &ended);
  summary.converged = summary.relative_gradient <= options.gradient_tolerance;
  if (summary.converged)
    summary.reason = "the gradient vanishes";
  else if (summary.reason.empty())
    summary.reason = reason_of(ended, state.failure);
  return summary;
}

}  // namespace pulson::matching
