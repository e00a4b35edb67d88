#include "pulson/inference/fit_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/determined.hpp"
#include "matching/maximum.hpp"
#include "matching/model_parameters.hpp"
#include "matching/registration_problem.hpp"
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
  if (!(fit.tolerance > 0 && fit.tolerance < 1))
    throw InputError(fmt::format("the tolerance of the fit is {}; it must be between 0 and 1", fit.tolerance));
  if (fit.max_evaluations < 1)
    throw InputError(fmt::format("the fit may take {} evaluations; at least 1 is needed", fit.max_evaluations));
}

class Fit {
 public:
  Fit(const Landmarks& source, const std::vector<Landmarks>& targets, const matching::RegistrationOptions& options,
      const FitOptions& fit)
      : source_(source),
        targets_(targets),
        fit_(fit),
        tolerance_(options.minimise.gradient_tolerance),
        parameters_(first_model(source, targets, options, fit)) {
    std::vector<int> taken(parameters_.names().size(), 0);
    for (const std::string& name : fit.names) {
      places_.push_back(parameters_.places(name));
      for (const Index place : places_.back()) {
        if (++taken[static_cast<std::size_t>(place)] > 1)
          throw InputError(
              fmt::format("'{}' is to be fitted twice", parameters_.names()[static_cast<std::size_t>(place)]));
        if (!(parameters_.values()[place] > 0))
          throw InputError(
              fmt::format("'{}' is {}; what is fitted, by its logarithm, must be greater than 0 at the start",
                          parameters_.names()[static_cast<std::size_t>(place)], parameters_.values()[place]));
      }
    }
    Index coordinates = 0;
    for (const Landmarks& target : targets) coordinates += free_coordinates(make_problem(source, target, options));
    require_determined_parameters("the parameters are", std::ssize(places_), coordinates,
                                  "fit fewer, or to more shapes");
  }

  FittedParameters run() {
    const Index count = std::ssize(places_);
    const matching::ValueAt at = [&](const VectorXd& x) { return evidence(x); };
    const matching::Maximum maximum = matching::maximise(
        at, {VectorXd::Constant(count, -std::log(kRange)), VectorXd::Constant(count, std::log(kRange))},
        VectorXd::Zero(count), {fit_.tolerance, fit_.max_evaluations});
    return result(maximum, deviations(at, maximum));
  }

 private:
  static matching::ModelParameters first_model(const Landmarks& source, const std::vector<Landmarks>& targets,
                                               matching::RegistrationOptions options, const FitOptions& fit) {
    check(targets, options, fit);
    options.minimise.on_iteration = {};
    options.uncertainty = true;  // so that the mode is that of the evidence
    options.minimise.gradient_tolerance = std::min(options.minimise.gradient_tolerance, kGradientTolerance);
    return {make_problem(source, targets.front(), options), options};
  }

  matching::RegistrationOptions options(const VectorXd& x) const {
    VectorXd values = parameters_.values();
    for (Index i = 0; i < x.size(); ++i) values(places_[static_cast<std::size_t>(i)]) *= std::exp(x[i]);
    return parameters_.options(values);
  }

  VectorXd values(const VectorXd& x) const {
    VectorXd values(x.size());
    for (Index i = 0; i < x.size(); ++i)
      values[i] = parameters_.values()[places_[static_cast<std::size_t>(i)].front()] * std::exp(x[i]);
    return values;
  }

  struct Matches {
    double log_evidence = 0;
    int unfinished = 0;
  };

  Matches matches(const matching::RegistrationOptions& options) const {
    VectorXd evidence(std::ssize(targets_));
    std::vector<char> converged(targets_.size());
    parallel_for(static_cast<int>(targets_.size()), [&](int i) {
      const auto t = static_cast<std::size_t>(i);
      const matching::MatchingObjective objective(make_problem(source_, targets_[t], options).matching);
      const matching::MinimiseSummary summary = minimise(objective, options.minimise);
      evidence[i] = log_evidence(objective, summary.solution);
      converged[t] = summary.converged || summary.relative_gradient <= tolerance_ ? 1 : 0;
    });
    return {evidence.sum(), static_cast<int>(std::count(converged.begin(), converged.end(), 0))};
  }

  // −∞ where it fails, but at the start, where it is for the user to correct.
  double evidence(const VectorXd& x) {
    double value = -std::numeric_limits<double>::infinity();
    try {
      const double sum = matches(options(x)).log_evidence;
      if (std::isfinite(sum)) value = sum;
    } catch (const Error&) {
      if (evaluations_ == 0) throw;
    }
    if (evaluations_ == 0 && !std::isfinite(value))
      throw NumericalError("the evidence is not finite initially; give other initial values");
    ++evaluations_;
    if (fit_.on_evaluation) fit_.on_evaluation(evaluations_, values(x), value);
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
    const matching::RegistrationOptions best = options(maximum.x);
    const int unfinished = matches(best).unfinished;
    FittedParameters fitted{fit_.names,         values(maximum.x), deviations,
                            maximum.value,      evaluations_,      maximum.converged && unfinished == 0,
                            best.kernel.spec(), best.noise.spec(), best.sigma.in(0),
                            best.lambda.value()};
    const auto add = [&](const std::string& text) { fitted.note += (fitted.note.empty() ? "" : "; ") + text; };
    for (Index i = 0; i < maximum.x.size(); ++i)
      if (maximum.at_bound[i])
        add(fmt::format("{} is at the limit of the search range, {} times {} than initially",
                        fit_.names[static_cast<std::size_t>(i)], kRange, maximum.x[i] > 0 ? "larger" : "smaller"));
    if (!maximum.converged)
      add(fmt::format("the search ended after {} evaluations, before its tolerance was reached", maximum.evaluations));
    if (unfinished > 0) add(fmt::format("{} of {} matches did not converge", unfinished, targets_.size()));
    const bool lost = (deviations.array().isNaN() && !maximum.at_bound).any();
    if (lost) add("the evidence has no strict maximum there: the data do not determine all of these parameters");
    return fitted;
  }

  const Landmarks& source_;
  const std::vector<Landmarks>& targets_;
  const FitOptions& fit_;
  double tolerance_;  // of the gradient at a minimum, as it was asked for
  matching::ModelParameters parameters_;
  std::vector<std::vector<Index>> places_;  // of each name
  int evaluations_ = 0;
};

}  // namespace

FittedParameters fit_parameters(const Landmarks& source, const std::vector<Landmarks>& targets,
                                const matching::RegistrationOptions& options, const FitOptions& fit) {
  return Fit(source, targets, options, fit).run();
}

}  // namespace pulson::inference
