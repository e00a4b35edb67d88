// The record of a completed fit.

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "fitter.hpp"
#include "importance.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of logarithms of variances: a standard deviation above 3, a factor of 24, determines nothing.
constexpr double kLeastInformation = 0.1;

constexpr double kNinety = 1.645;  // deviations of a normal distribution on each side, 90 %

// Variance of the end points, in units of σ², below which neither momenta nor noise show.
constexpr double kDetectable = 10 * kNegligible;

// Standard deviations of numbers of this Fisher information; NaN for those that it does not identify.
VectorXd deviations(const MatrixXd& information) {
  if (information.size() == 0) return {};
  constexpr double kLeastPart = 1e-3;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  VectorXd variances = VectorXd::Zero(information.rows());
  for (Index k = 0; k < variances.size(); ++k) {
    const Eigen::ArrayXd part = axes.eigenvectors().col(k).array().square();
    if (axes.eigenvalues()[k] > kLeastInformation)
      variances.array() += part / axes.eigenvalues()[k];
    else
      variances = (part > kLeastPart).select(std::numeric_limits<double>::quiet_NaN(), variances);
  }
  return variances.cwiseSqrt();
}

// Half of an interval of 90 % is 1.645 deviations, of the side that has an end where the other has none. The curvature
// at the maximum of a chart, which stays where there are no ends, is what the draws leave least certain. An interval
// that leaves out the number itself, as of a search that did not converge, says nothing.
VectorXd with_intervals(VectorXd deviations, const VectorXd& x, const VectorXd& low, const VectorXd& high) {
  for (Index i = 0; i < std::min(low.size(), deviations.size()); ++i) {
    if (!std::isfinite(deviations[i])) continue;
    const double below = x[i] - low[i];
    const double above = high[i] - x[i];
    if (below < 0 || above < 0) continue;
    if (std::isfinite(below) && std::isfinite(above))
      deviations[i] = (below + above) / (2 * kNinety);
    else if (std::isfinite(below) || std::isfinite(above))
      deviations[i] = (std::isfinite(below) ? below : above) / kNinety;
  }
  return deviations;
}

}  // namespace

// Intervals are NaN where the data do not determine the number.
std::vector<FittedNumber> Fitter::numbers(const Maximum& maximum) const {
  const State& state = maximum.state;
  const VectorXd x = place(state);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const VectorXd errors = with_intervals(deviations(maximum.information), x, maximum.low, maximum.high);
  const std::vector<std::string> names = noise_.model->parameter_names();
  const MatrixXd& with_sigma = state.variances.information;
  const Index of_sigma = groups();
  std::vector<FittedNumber> numbers;
  for (Index g = 0; g < groups(); ++g) {
    const bool is_lambda = lambda_open_ && g == 0;
    const double power = is_lambda ? -1 : 0.5;  // of the variance
    const double v = variance(state, g);
    FittedNumber number{is_lambda ? "lambda" : names[at(amplitudes_[at(g - (lambda_open_ ? 1 : 0))])],
                        std::pow(v, power),
                        nan,
                        v < 2 * kNegligible * units_[g],
                        nan,
                        nan,
                        nan};
    const auto at_place = [&](double place) { return std::pow(units_[g] * std::max(std::expm1(place), 0.0), power); };
    if (!number.vanishes) {
      number.log_deviation = std::abs(power) * errors[g] * (1 + units_[g] / v);
      number.correlation_with_sigma =
          with_sigma(g, of_sigma) / std::sqrt(with_sigma(g, g) * with_sigma(of_sigma, of_sigma));
    }
    const bool determined = std::isfinite(errors[g]);
    number.low = determined ? at_place(is_lambda ? maximum.high[g] : maximum.low[g]) : nan;
    number.high = determined ? at_place(is_lambda ? maximum.low[g] : maximum.high[g]) : nan;
    numbers.push_back(number);
  }
  const auto add_by_logarithm = [&](const std::string& name, double value) {
    const Index i = std::ssize(numbers);
    const bool determined = std::isfinite(errors[i]);
    numbers.push_back({name, value, errors[i], false, nan, determined ? value * std::exp(maximum.low[i] - x[i]) : nan,
                       determined ? value * std::exp(maximum.high[i] - x[i]) : nan});
  };
  const bool at_rest = lambda_open_ && numbers.front().vanishes && noise_.model->traits().linear;
  if (settings_.fit_width && at_rest) {  // of no momenta: any width does
    numbers.push_back({"alpha", kernel(state).terms().front().alpha, nan, false, nan, nan, nan});
  } else if (settings_.fit_width)
    add_by_logarithm("alpha", kernel(state).terms().front().alpha);
  for (const Index i : others_) add_by_logarithm(names[at(i)], state.parameters[i]);
  return numbers;
}

ShapeFit Fitter::shape_fit(const matching::MatchingObjective& objective, const Linearised& match, int target) const {
  const Observation& observation = observations_[at(target)];
  ShapeFit fit;
  fit.momenta = objective.momenta(match.at.z);
  fit.increments = objective.increments(match.at.z);
  const auto shot = objective.evaluate(match.at.z);  // with the bits of the integrator
  fit.end = shot ? shot->path().final().q : match.end;
  const VectorXd residual = observation.residual(fit.end);
  fit.cost = {match.at.cost.energy, match.at.cost.action, 0.5 * residual.squaredNorm()};
  const Landmarks& shape = cohort_.targets[at(target)];
  const auto landmarks = static_cast<double>(shape.count() - std::ssize(incomplete_points(shape.points)));
  fit.rms = sigma_ * residual.norm() / std::sqrt(std::max(landmarks, 1.0));
  fit.log_evidence = fit.laplace = match.log_evidence;
  fit.coordinates = static_cast<int>(observation.count());
  fit.converged = match.converged;
  try {
    const auto still = MatrixXd::Zero(fit.increments.rows(), settings_.grid.steps);
    fit.flow_end =
        integrator_->integrate(objective.problem().system, {cohort_.source.points, fit.momenta}, settings_.grid, still)
            .final()
            .q;
  } catch (const StepError&) {
    fit.flow_end.resize(0, 0);
  }
  return fit;
}

// The samples' evidence in place of Laplace's. @return whether enough of them are effective
bool Fitter::sample(const matching::MatchingObjective& objective, const Linearised& match, int target,
                    ShapeFit& fit) const {
  const Observation& observation = observations_[at(target)];
  const double enough = std::pow(settings_.sampling_error, 2) / static_cast<double>(observations_.size());
  std::vector<VectorXd> begin;
  const ImportanceEstimate sampled = importance_sample(objective, observation, match, settings_.importance_samples,
                                                       enough, settings_.seed + at(target), begin);
  if (std::isfinite(sampled.log_evidence)) fit.log_evidence = sampled.log_evidence;
  fit.variance = sampled.variance;
  const BeyondEstimate beyond =
      sample_beyond(objective, observation, match, sampled.samples, settings_.seed + at(target));
  if (beyond.part > 0) {
    const double found = std::exp(fit.log_evidence - fit.laplace);
    const double sum = found + beyond.part;
    fit.beyond = beyond.part / sum;
    fit.log_evidence += std::log(sum / found);
    fit.variance = (found * found * fit.variance + beyond.variance) / (sum * sum);
  }
  fit.samples = sampled.samples;
  fit.effective_samples = sampled.effective_samples;
  fit.lost_samples = sampled.lost;
  return sampled.effective_samples >= kFewEffective * sampled.samples;
}

CohortFit Fitter::record_without_intervals(const State& state) const {
  return record({state, MatrixXd::Zero(numbers_open(), numbers_open()), {}, {}});
}

CohortFit Fitter::record(const Maximum& maximum) const {
  const State& state = maximum.state;
  const matching::MatchingObjective objective = this->objective(state);
  CohortFit fit;
  fit.kernel = kernel(state).spec();
  fit.noise = objective.problem().system.noise->spec();
  if (noise_.is_own) fit.own_noise = objective.problem().system.noise;
  fit.lambda = state.lambda;
  fit.fitted = numbers(maximum);
  fit.laplace = state.log_evidence();
  fit.rounds = state.rounds;
  fit.converged = state.converged;
  double of_momenta = 0;
  double of_noise = 0;
  fit.shapes.resize(state.matches.size());
  parallel_for(static_cast<int>(state.matches.size()),
               [&](int s) { fit.shapes[at(s)] = shape_fit(objective, state.matches[at(s)], s); });
  if (settings_.importance_samples > 0)
    while_enough(static_cast<int>(state.matches.size()),
                 [&](int s) { return sample(objective, state.matches[at(s)], s, fit.shapes[at(s)]); });
  for (std::size_t s = 0; s < state.matches.size(); ++s) {
    const Linearised& match = state.matches[s];
    const ShapeFit& shape = fit.shapes[s];
    fit.coordinates += shape.coordinates;
    fit.log_evidence += shape.log_evidence;
    fit.sampling_error = std::hypot(fit.sampling_error, std::sqrt(shape.variance));
    if (shape.samples > 0) fit.effective_part = std::min(fit.effective_part, shape.effective_samples / shape.samples);
    const Index momenta = match.jacobian.cols() - std::ssize(group_of_channel_) * settings_.grid.steps;
    of_momenta += match.jacobian.leftCols(momenta).squaredNorm();
    of_noise += match.jacobian.rightCols(match.jacobian.cols() - momenta).squaredNorm();
  }
  const bool is_detectable = of_noise + of_momenta > kDetectable * fit.coordinates;
  fit.noise_share = is_detectable ? of_noise / (of_noise + of_momenta) : 0;
  return fit;
}

}  // namespace pulson::compare
