#include "pulson/inference/fit_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/determined.hpp"
#include "matching/maximum.hpp"
#include "parameters.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/objective.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kRange = 100;  // of the search, a factor up and down
// The evidence is wanted smooth, for quadratic interpolation and differences of step 0.05: the part of J that is still
// to be gained at a minimum is the square of this.
constexpr double kGradientTolerance = 1e-5, kDifference = 0.05;

void check(const std::vector<Landmarks>& targets, const matching::RegistrationOptions& options, const FitOptions& fit) {
  if (options.loss) throw InputError("a robust loss and a number that is 'fit' do not go together");
  if (targets.empty()) throw InputError("there is no target to fit parameters to");
  if (fit.names.empty()) throw InputError("no parameter is named to be fitted");
  if (!options.data.covariances.empty() &&
      std::find(fit.names.begin(), fit.names.end(), "data-sigma") != fit.names.end())
    throw InputError("covariances say how exact each landmark is, and sigma has no effect beside them; fit without it");
  if (!(fit.tolerance > 0 && fit.tolerance < 1))
    throw InputError(fmt::format("the tolerance of the fit is {}; it must be between 0 and 1", fit.tolerance));
  if (fit.max_evaluations < 1)
    throw InputError(fmt::format("the fit may take {} evaluations; at least 1 is needed", fit.max_evaluations));
}

PosteriorProblem problem_of(const Landmarks& source, const std::vector<Landmarks>& targets,
                            matching::RegistrationOptions options, const FitOptions& fit) {
  check(targets, options, fit);
  options.minimise.on_iteration = {};
  Specimens made = make_specimens(source, targets, std::move(options));
  add_priors(made.problem, fit.names);
  for (ParameterPrior& parameter : made.problem.parameters) parameter.log_deviation = 1;  // its scale, and no prior
  require_determined_parameters("the parameters are", std::ssize(fit.names), made.free_coordinates,
                                "fit fewer, or to more shapes");
  return std::move(made.problem);
}

class Fit {
 public:
  Fit(PosteriorProblem problem, const FitOptions& fit, matching::MinimiseOptions minimise)
      : fit_(fit),
        minimise_(std::move(minimise)),
        tolerance_(minimise_.gradient_tolerance),
        problem_(std::move(problem)),
        space_(problem_) {
    minimise_.on_iteration = {};
    minimise_.gradient_tolerance = std::min(tolerance_, kGradientTolerance);
  }

  FittedParameters run() {
    const Index count = space_.count();
    const matching::ValueAt at = [&](const VectorXd& x) { return evidence(x); };
    const matching::Maximum maximum = matching::maximise(
        at, {VectorXd::Constant(count, -std::log(kRange)), VectorXd::Constant(count, std::log(kRange))},
        VectorXd::Zero(count), {fit_.tolerance, fit_.max_evaluations});
    return result(maximum, deviations(at, maximum));
  }

 private:
  struct Matches {
    double log_evidence = 0;
    int unfinished = 0;
  };

  Matches matches(const VectorXd& x) const {
    const posterior::Numbers numbers = space_.at(x);
    VectorXd evidence(std::ssize(problem_.specimens));
    std::vector<char> converged(problem_.specimens.size());
    parallel_for(static_cast<int>(evidence.size()), [&](int i) {
      const auto t = static_cast<std::size_t>(i);
      const matching::MatchingObjective objective(problem_at(problem_.specimens[t], numbers));
      const matching::MinimiseSummary summary = minimise(objective, minimise_);
      evidence[i] = log_evidence(objective, summary.solution);
      converged[t] = summary.converged || summary.relative_gradient <= tolerance_ ? 1 : 0;
    });
    return {evidence.sum(), static_cast<int>(std::count(converged.begin(), converged.end(), 0))};
  }

  // −∞ where it fails, but at the start, where it is for the user to correct.
  double evidence(const VectorXd& x) {
    double value = -std::numeric_limits<double>::infinity();
    try {
      const double sum = matches(x).log_evidence;
      if (std::isfinite(sum)) value = sum;
    } catch (const Error&) {
      if (evaluations_ == 0) throw;
    }
    if (evaluations_ == 0 && !std::isfinite(value))
      throw NumericalError("the evidence is not finite initially; give other initial values");
    ++evaluations_;
    if (fit_.on_evaluation) fit_.on_evaluation(evaluations_, space_.values(x), value);
    return value;
  }

  // The roots of the diagonal of (−∇²J)⁻¹ over the numbers that are not at a bound; NaN of the others, and where the
  // matrix is not positive definite.
  static VectorXd deviations(const matching::ValueAt& at, const matching::Maximum& maximum) {
    std::vector<Index> free;
    for (Index i = 0; i < maximum.x.size(); ++i)
      if (!maximum.at_bound[i]) free.push_back(i);
    const auto of_free = [&](const VectorXd& some) {
      VectorXd x = maximum.x;
      x(free) = some;
      return at(x);
    };
    VectorXd deviations = VectorXd::Constant(maximum.x.size(), std::numeric_limits<double>::quiet_NaN());
    if (free.empty()) return deviations;
    const Eigen::MatrixXd information = matching::second_order(of_free, maximum.x(free), kDifference).information;
    const Eigen::LLT<Eigen::MatrixXd> factors(information);
    if (!information.allFinite() || factors.info() != Eigen::Success) return deviations;
    const auto count = std::ssize(free);
    deviations(free) = factors.solve(Eigen::MatrixXd::Identity(count, count)).diagonal().cwiseSqrt();
    return deviations;
  }

  FittedParameters result(const matching::Maximum& maximum, const VectorXd& deviations) const {
    const posterior::Numbers best = space_.at(maximum.x);
    const int unfinished = matches(maximum.x).unfinished;
    FittedParameters fitted{fit_.names,
                            space_.values(maximum.x),
                            deviations,
                            maximum.value,
                            evaluations_,
                            maximum.converged && unfinished == 0,
                            best.kernel->spec(),
                            best.noise->spec(),
                            best.sigma * problem_.specimens.front().sigma,
                            best.lambda};
    const auto add = [&](const std::string& text) { fitted.note += (fitted.note.empty() ? "" : "; ") + text; };
    for (Index i = 0; i < maximum.x.size(); ++i)
      if (maximum.at_bound[i])
        add(fmt::format("{} is at the limit of the search range, {} times {} than initially",
                        fit_.names[static_cast<std::size_t>(i)], kRange, maximum.x[i] > 0 ? "larger" : "smaller"));
    if (!maximum.converged)
      add(fmt::format("the search ended after {} evaluations, before its tolerance was reached", maximum.evaluations));
    if (unfinished > 0) add(fmt::format("{} of {} matches did not converge", unfinished, problem_.specimens.size()));
    const bool lost = (deviations.array().isNaN() && !maximum.at_bound).any();
    if (lost) add("the evidence has no strict maximum there: the data do not determine all of these parameters");
    return fitted;
  }

  const FitOptions& fit_;
  matching::MinimiseOptions minimise_;
  double tolerance_;  // of the gradient at a minimum, as it was asked for
  PosteriorProblem problem_;
  ParameterSpace space_;
  int evaluations_ = 0;
};

}  // namespace

FittedParameters fit_parameters(const Landmarks& source, const std::vector<Landmarks>& targets,
                                const matching::RegistrationOptions& options, const FitOptions& fit) {
  return Fit(problem_of(source, targets, options, fit), fit, options.minimise).run();
}

}  // namespace pulson::inference
