#include <exception>

#include <nlopt.hpp>

#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::VectorXd;

constexpr const char* kLineSearch = "the line search failed";

// What NLopt's callback needs between calls: the best point so far, and when to stop.
struct LbfgsSearch {
  const MatchingObjective& objective;
  const MinimiseOptions& options;
  MinimiseSummary& summary;
  std::exception_ptr error{};         // what ended it, of which NLopt would keep no more than that it was one
  const char* failure = kLineSearch;  // why the last point may have ended it

  double operator()(const VectorXd& z, VectorXd* gradient) {
    ++summary.evaluations;
    failure = kLineSearch;
    auto at = objective.evaluate(z);
    // A wall: the line search turns back to shorter steps.
    if (!at) {
      failure = kTooCoarse;
      if (gradient != nullptr) *gradient = z;
      return 1e3 * (1 + summary.solution.cost.total());
    }
    const VectorXd slope = z + objective.data_gradient(*at);
    if (!slope.allFinite()) failure = "the gradient leaves the range of numbers";
    if (gradient != nullptr) *gradient = slope;
    const double cost = at->cost.total();
    if (cost <= summary.solution.cost.total()) {
      summary.solution = std::move(*at);
      summary.relative_gradient = relative_gradient(z, slope);
      ++summary.iterations;
      if (options.on_iteration) options.on_iteration(summary.iterations, cost, summary.relative_gradient);
      if (summary.relative_gradient <= options.gradient_tolerance) throw nlopt::forced_stop();
      if (options.is_interrupted()) {
        summary.reason = kInterrupted;
        throw nlopt::forced_stop();
      }
    }
    return cost;
  }
};

double call_lbfgs_search(unsigned n, const double* z, double* gradient, void* search) {
  auto& of = *static_cast<LbfgsSearch*>(search);
  try {
    const Eigen::Map<const VectorXd> point(z, n);
    VectorXd slope;
    const double cost = of(point, gradient != nullptr ? &slope : nullptr);
    if (gradient != nullptr) Eigen::Map<VectorXd>(gradient, n) = slope;
    return cost;
  } catch (const nlopt::forced_stop&) {
    throw;
  } catch (...) {
    of.error = std::current_exception();
    throw nlopt::forced_stop();
  }
}

}  // namespace

MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start) {
  MinimiseSummary summary{.solver = Solver::kLbfgs, .solution = std::move(start)};
  const VectorXd& z0 = summary.solution.z;
  summary.relative_gradient = relative_gradient(z0, z0 + objective.data_gradient(summary.solution));
  const auto n = static_cast<unsigned>(objective.unknowns());
  nlopt::opt minimiser(nlopt::LD_LBFGS, n);
  LbfgsSearch search{objective, options, summary};
  minimiser.set_min_objective(call_lbfgs_search, &search);
  minimiser.set_maxeval(options.max_iterations);
  minimiser.set_vector_storage(30);
  std::vector<double> z(summary.solution.z.begin(), summary.solution.z.end());
  double cost = 0;
  summary.reason = "no step lowers the cost by more than round-off";
  try {
    if (minimiser.optimize(z, cost) == nlopt::MAXEVAL_REACHED) summary.reason = "the limit of iterations was reached";
  } catch (const nlopt::forced_stop&) {
    // stopped by the gradient test, by a user, or by an error
  } catch (const nlopt::roundoff_limited&) {
    // the reason above
  } catch (const std::runtime_error&) {
    summary.reason = search.failure;
  }
  if (search.error) std::rethrow_exception(search.error);
  summary.converged = summary.relative_gradient <= options.gradient_tolerance;
  if (summary.converged) summary.reason = "the gradient vanishes";
  return summary;
}

}  // namespace pulson::matching
