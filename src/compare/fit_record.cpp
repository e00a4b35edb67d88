// The record of a completed fit.

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "fitter.hpp"
#include "importance.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of logarithms of variances: a standard deviation above 3, a factor of 24, determines nothing.
constexpr double kLeastInformation = 0.1;

// Variance of the end points, in units of σ², below which neither momenta nor noise show.
constexpr double kDetectable = 1e-6;

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

}  // namespace

std::vector<FittedNumber> Fitter::numbers(const State& state) const {
  const MatrixXd& information = state.variances.information;
  const Index count = groups();
  std::vector<Index> free;
  for (Index g = 0; g < count; ++g)
    if (!state.variances.vanishes[g]) free.push_back(g);
  VectorXd log_deviations = deviations(information(free, free));
  // Where one parameter has the same effect as another, the likelihood is flat, and its maximum may be far from the
  // true values.
  const VectorXd first_deviations = deviations(state.variances.first_information(free, free));
  log_deviations = first_deviations.array().isNaN().select(first_deviations, log_deviations);
  std::vector<FittedNumber> numbers;
  const std::vector<std::string> names = noise_.model->parameter_names();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (Index g = 0; g < count; ++g) {
    const bool is_lambda = lambda_open_ && g == 0;
    const Index parameter = is_lambda ? 0 : amplitudes_[at(g - (lambda_open_ ? 1 : 0))];
    FittedNumber number{is_lambda ? "lambda" : names[at(parameter)],
                        is_lambda ? state.lambda : state.parameters[parameter], nan, state.variances.vanishes[g], nan};
    if (!number.vanishes) {
      const auto place = std::find(free.begin(), free.end(), g) - free.begin();
      number.log_deviation = (is_lambda ? 1 : 0.5) * log_deviations[place];  // of β, whose square is the variance
      number.correlation_with_sigma = information(g, count) / std::sqrt(information(g, g) * information(count, count));
    }
    numbers.push_back(number);
  }
  for (const Index i : others_) numbers.push_back({names[at(i)], state.parameters[i], nan, false, nan});
  return numbers;
}

ShapeFit Fitter::shape_fit(const MatchingObjective& objective, const Linearised& match, int target) const {
  const Observation& observation = observations_[at(target)];
  ShapeFit fit;
  fit.momenta = objective.momenta(match.at.z);
  fit.increments = objective.increments(match.at.z);
  fit.end = match.at.path().final().q;
  const VectorXd residual = observation.residual(fit.end);
  fit.cost = {match.at.cost.energy, match.at.cost.action, 0.5 * residual.squaredNorm()};
  const Landmarks& shape = cohort_.targets[at(target)];
  const auto landmarks = static_cast<double>(shape.count() - std::ssize(incomplete_points(shape.points)));
  fit.rms = sigma_ * residual.norm() / std::sqrt(std::max(landmarks, 1.0));
  fit.log_evidence = match.log_evidence;
  const ImportanceEstimate sampled =
      settings_.importance_samples > 0
          ? importance_sample(objective, observation, match, settings_.importance_samples, settings_.seed + at(target))
          : ImportanceEstimate{std::numeric_limits<double>::quiet_NaN(), 0, 0, 0};
  fit.sampled_log_evidence = sampled.log_evidence;
  fit.sampled_variance = sampled.variance;
  fit.effective_samples = sampled.effective_samples;
  fit.lost_samples = sampled.lost;
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

CohortFit Fitter::record(const State& state) const {
  const MatchingObjective objective = this->objective(state);
  CohortFit fit;
  fit.kernel = kernel_.spec();
  fit.noise = objective.problem().system.noise->spec();
  if (noise_.is_own) fit.own_noise = objective.problem().system.noise;
  fit.lambda = state.lambda;
  fit.fitted = numbers(state);
  fit.log_evidence = state.log_evidence();
  fit.rounds = state.rounds;
  fit.converged = state.converged;
  double of_momenta = 0;
  double of_noise = 0;
  fit.shapes.resize(state.matches.size());
  parallel_for(static_cast<int>(state.matches.size()),
               [&](int s) { fit.shapes[at(s)] = shape_fit(objective, state.matches[at(s)], s); });
  for (std::size_t s = 0; s < state.matches.size(); ++s) {
    const Linearised& match = state.matches[s];
    fit.coordinates += fit.shapes[s].coordinates;
    const Index momenta = match.jacobian.cols() - std::ssize(group_of_channel_) * settings_.grid.steps;
    of_momenta += match.jacobian.leftCols(momenta).squaredNorm();
    of_noise += match.jacobian.rightCols(match.jacobian.cols() - momenta).squaredNorm();
  }
  const bool is_detectable = of_noise + of_momenta > kDetectable * fit.coordinates;
  fit.noise_share = is_detectable ? of_noise / (of_noise + of_momenta) : 0;
  return fit;
}

}  // namespace pulson
