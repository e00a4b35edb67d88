#include "posterior.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/core.h>

#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Observation observe(const Cohort& cohort, int target, double sigma) {
  const Landmarks& shape = cohort.targets[static_cast<std::size_t>(target)];
  const VectorXd values = shape.points.reshaped();
  std::vector<Index> observed;
  for (Index i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) observed.push_back(i);
  const auto n = std::ssize(observed);
  const MatrixXd motions = motion_directions(cohort.source.points, cohort.alignment, observed);
  if (n <= motions.cols())
    throw InputError(fmt::format(
        "{}: its {} observed coordinates are too few, as the alignment accounts for all of them", shape.source, n));
  MatrixXd basis = MatrixXd::Identity(n, n);
  if (motions.cols() > 0) basis.applyOnTheLeft(Eigen::HouseholderQR<MatrixXd>(motions).householderQ());
  const MatrixXd left = basis.rightCols(n - motions.cols()).transpose() / sigma;
  Observation observation;
  observation.projection = MatrixXd::Zero(left.rows(), values.size());
  for (Index i = 0; i < n; ++i) observation.projection.col(observed[static_cast<std::size_t>(i)]) = left.col(i);
  observation.target = left * values(observed);
  observation.log_volume = static_cast<double>(left.rows()) * std::log(std::sqrt(2 * std::numbers::pi) * sigma);
  return observation;
}

namespace {

using Evaluation = MatchingObjective::Evaluation;

constexpr int kMostSteps = 60;
constexpr int kMostHalvings = 12;
constexpr double kSmallGain = 1e-4;  // nats; an error of z by its root changes the determinant by less than that
constexpr const char* kNoPath =
    "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`";

constexpr double kSeen = 1e-3;  // variance of a place, of σ²

double cost_of(const VectorXd& z, const VectorXd& residual) { return 0.5 * (z.squaredNorm() + residual.squaredNorm()); }

struct Step {
  VectorXd z;
  Linearised from;
};

// Linearises, and says where the minimum of the linear problem is.
Step linearise(const MatchingObjective& objective, const Observation& observation, Evaluation at) {
  Linearised here;
  here.jacobian.noalias() = observation.projection * objective.endpoint_changes(at.path());
  here.jacobian *= observable_unknowns(objective).asDiagonal();
  const VectorXd residual = observation.residual(at.path().final().q);
  here.innovation = residual + here.jacobian * at.z;
  MatrixXd covariance = MatrixXd::Identity(observation.count(), observation.count());
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(here.jacobian);
  const Eigen::LLT<MatrixXd> factors(covariance);
  const VectorXd weighed = factors.solve(here.innovation);
  const double least = 0.5 * here.innovation.dot(weighed);
  here.cost = cost_of(at.z, residual);
  here.gain = here.cost - least;
  here.log_evidence = -least - MatrixXd(factors.matrixL()).diagonal().array().log().sum() - observation.log_volume;
  here.converged = here.gain <= kSmallGain;
  here.at = std::move(at);
  VectorXd z = here.jacobian.transpose() * weighed;
  return {std::move(z), std::move(here)};
}

}  // namespace

VectorXd observable_unknowns(const MatchingObjective& objective) {
  const MatchingProblem& problem = objective.problem();
  const VectorXd eigenvalues = objective.basis().eigenvalues();  // of λK
  const double least = kSeen * std::pow(problem.lambda * problem.sigma / problem.grid.time, 2);
  VectorXd observable = VectorXd::Ones(objective.unknowns());
  for (Index i = 0; i < eigenvalues.size(); ++i)
    if (eigenvalues[i] < least) observable[i] = 0;
  return observable;
}

Linearised linearised_at(const MatchingObjective& objective, const Observation& observation, const VectorXd& z) {
  std::optional<Evaluation> at = objective.evaluate(z);
  if (!at) throw NumericalError(kNoPath);
  return linearise(objective, observation, std::move(*at)).from;
}

Linearised find_match(const MatchingObjective& objective, const Observation& observation,
                      const std::vector<VectorXd>& starts) {
  const VectorXd observable = observable_unknowns(objective);
  std::optional<Evaluation> at;
  double least = 0;
  const auto begin_at = [&](const VectorXd& z) {
    std::optional<Evaluation> tried = objective.evaluate(z);
    if (!tried) return;
    const double cost = cost_of(z, observation.residual(tried->path().final().q));
    if (at && cost >= least) return;
    least = cost;
    at = std::move(tried);
  };
  for (const VectorXd& z : starts) begin_at(z.cwiseProduct(observable));
  if (!at) begin_at(VectorXd::Zero(observable.size()));
  if (!at) throw NumericalError(kNoPath);
  Step step = linearise(objective, observation, std::move(*at));
  for (int count = 0; count < kMostSteps && !step.from.converged; ++count) {
    const VectorXd way = step.z - step.from.at.z;
    double part = 1;
    std::optional<Evaluation> next;
    for (int halving = 0; halving < kMostHalvings && !next; ++halving, part /= 2) {
      std::optional<Evaluation> tried = objective.evaluate(step.from.at.z + part * way);
      if (!tried) continue;
      const double cost = cost_of(tried->z, observation.residual(tried->path().final().q));
      if (cost < step.from.cost - 1e-4 * part * step.from.gain) next = std::move(tried);
    }
    if (!next) break;
    step = linearise(objective, observation, std::move(*next));
  }
  return std::move(step.from);
}

}  // namespace pulson
