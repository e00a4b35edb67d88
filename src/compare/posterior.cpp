#include "posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/core.h>

#include "core/secants.hpp"
#include "lane_shots.hpp"
#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::compare {

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

using Evaluation = matching::MatchingObjective::Evaluation;

constexpr int kMostSteps = 60;
constexpr int kMostHalvings = 12;
constexpr double kFall = 1e-4;       // of the cost, of what a step should gain
constexpr std::size_t kWindow = 3;   // of the secants of Gauss–Newton steps
constexpr double kSmallGain = 1e-4;  // nats; an error of z by its root changes the determinant by less than that
constexpr const char* kNoPath =
    "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`";

double cost_of(const VectorXd& z, const VectorXd& residual) { return 0.5 * (z.squaredNorm() + residual.squaredNorm()); }

struct Step {
  VectorXd z;
  Linearised from;
};

// Says where the minimum of the linear problem is. @param changes ∂q(T)/∂z
Step linear_step(const Observation& observation, const MatrixXd& changes, Evaluation at, Points end) {
  Linearised here;
  here.jacobian.noalias() = observation.projection * changes;
  const VectorXd residual = observation.residual(end);
  here.end = std::move(end);
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

Step linearise(const matching::MatchingObjective& objective, const Observation& observation, Evaluation at) {
  const MatrixXd changes = objective.endpoint_changes(at.path());
  Points end = at.path().final().q;
  return linear_step(observation, changes, std::move(at), std::move(end));
}

}  // namespace

Linearised linearised_at(const matching::MatchingObjective& objective, const Observation& observation,
                         const VectorXd& z) {
  std::optional<Evaluation> at = objective.evaluate(z);
  if (!at) throw NumericalError(kNoPath);
  return linearise(objective, observation, std::move(*at)).from;
}

Linearised find_match(const matching::MatchingObjective& objective, const Observation& observation,
                      const std::vector<VectorXd>& starts, double good) {
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
  for (const VectorXd& z : starts)
    if (!at || least > good) begin_at(z);
  if (!at) begin_at(VectorXd::Zero(objective.unknowns()));
  if (!at) throw NumericalError(kNoPath);
  Step step = linearise(objective, observation, std::move(*at));
  Secants secants(kWindow);
  for (int count = 0; count < kMostSteps && !step.from.converged; ++count) {
    std::optional<Evaluation> next;
    const auto try_at = [&](const VectorXd& z, double part) {
      std::optional<Evaluation> tried = objective.evaluate(z);
      if (!tried) return;
      const double cost = cost_of(tried->z, observation.residual(tried->path().final().q));
      if (cost < step.from.cost - kFall * part * step.from.gain) next = std::move(tried);
    };
    const VectorXd back = step.from.at.z - step.z;
    const VectorXd faster = secants.next(step.from.at.z, back);
    if (secants.any()) try_at(faster, 1);
    double part = 1;
    for (int halving = 0; halving < kMostHalvings && !next; ++halving, part /= 2)
      try_at(step.from.at.z - part * back, part);
    if (!next) break;
    step = linearise(objective, observation, std::move(*next));
  }
  return std::move(step.from);
}

namespace {

// The search of one lane.
struct LaneSearch {
  VectorXd begin;    // where it begins, once that is found
  double least = 0;  // cost there
  Step step;
  Secants secants{kWindow};
  VectorXd faster;  // than the step, if it has a size
  double part = 1;  // of the step
  bool ended = false;
};

}  // namespace

std::vector<Linearised> find_matches(const LaneShots& shots, const matching::MatchingObjective& objective,
                                     const std::vector<const Observation*>& observations,
                                     const std::vector<std::vector<VectorXd>>& starts,
                                     const std::vector<double>& good) {
  const auto shapes = std::ssize(observations);
  const Points& source = objective.problem().source;
  std::vector<LaneSearch> lanes(observations.size());
  MatrixXd z = MatrixXd::Zero(objective.unknowns(), shapes);
  const auto lane_of = [](Index s) { return static_cast<std::size_t>(s); };
  const auto end_of = [&](const LaneShots::Shots& shot, Index s) {
    return Points(shot.ends.col(s).reshaped(source.rows(), source.cols()));
  };
  std::size_t most = 0;
  for (const auto& of_shape : starts) most = std::max(most, of_shape.size());
  for (std::size_t i = 0; i <= most; ++i) {  // at last, rest
    std::vector<char> tries(observations.size());
    for (Index s = 0; s < shapes; ++s) {
      const LaneSearch& lane = lanes[lane_of(s)];
      const bool is_start = i < starts[lane_of(s)].size();
      tries[lane_of(s)] =
          lane.begin.size() == 0 ? (is_start || i == most) : (is_start && lane.least > good[lane_of(s)]);
      if (!tries[lane_of(s)]) continue;
      z.col(s).setZero();
      if (is_start) z.col(s) = starts[lane_of(s)][i];
    }
    if (std::none_of(tries.begin(), tries.end(), [](char is) { return is != 0; })) continue;
    const LaneShots::Shots shot = shots.shoot(z, LaneShots::With::kNothing);
    for (Index s = 0; s < shapes; ++s) {
      LaneSearch& lane = lanes[lane_of(s)];
      if (!tries[lane_of(s)] || !shot.found[lane_of(s)]) continue;
      const double cost = cost_of(z.col(s), observations[lane_of(s)]->residual(end_of(shot, s)));
      if (lane.begin.size() > 0 && cost >= lane.least) continue;
      lane.least = cost;
      lane.begin = z.col(s);
    }
  }
  for (Index s = 0; s < shapes; ++s) {
    if (lanes[lane_of(s)].begin.size() == 0) throw NumericalError(kNoPath);
    z.col(s) = lanes[lane_of(s)].begin;
  }
  std::vector<char> moved(observations.size(), 1);  // lanes to be linearised
  for (int count = 0; count <= kMostSteps; ++count) {
    const LaneShots::Shots shot = shots.shoot(z, LaneShots::With::kChanges);
    for (Index s = 0; s < shapes; ++s) {
      LaneSearch& lane = lanes[lane_of(s)];
      if (!moved[lane_of(s)]) continue;
      const Index momenta = objective.basis().unknowns();
      Evaluation at{z.col(s), {}, {}};
      at.cost.energy = 0.5 * z.col(s).head(momenta).squaredNorm();
      at.cost.action = 0.5 * z.col(s).tail(z.rows() - momenta).squaredNorm();
      lane.step = linear_step(*observations[lane_of(s)], shot.changes[lane_of(s)], std::move(at), end_of(shot, s));
      lane.ended = lane.step.from.converged;
      lane.part = 1;
      const VectorXd& from = lane.step.from.at.z;
      lane.faster = lane.secants.next(from, from - lane.step.z);
      if (!lane.secants.any()) lane.faster.resize(0);
    }
    if (count == kMostSteps) break;
    std::fill(moved.begin(), moved.end(), char{0});
    const auto waits = [&](Index s) { return !lanes[lane_of(s)].ended && !moved[lane_of(s)]; };
    for (int halving = 0; halving <= kMostHalvings; ++halving) {
      bool any = false;
      for (Index s = 0; s < shapes; ++s) {
        const LaneSearch& lane = lanes[lane_of(s)];
        if (!waits(s)) continue;
        any = true;
        const VectorXd& from = lane.step.from.at.z;
        z.col(s) = lane.faster.size() > 0 ? lane.faster : from + lane.part * (lane.step.z - from);
      }
      if (!any) break;
      const LaneShots::Shots tried = shots.shoot(z, LaneShots::With::kNothing);
      for (Index s = 0; s < shapes; ++s) {
        LaneSearch& lane = lanes[lane_of(s)];
        if (!waits(s)) continue;
        const double cost = cost_of(z.col(s), observations[lane_of(s)]->residual(end_of(tried, s)));
        if (tried.found[lane_of(s)] && cost < lane.step.from.cost - kFall * lane.part * lane.step.from.gain)
          moved[lane_of(s)] = 1;
        else if (lane.faster.size() == 0)
          lane.part /= 2;
        lane.faster.resize(0);
      }
    }
    for (Index s = 0; s < shapes; ++s)
      if (waits(s)) lanes[lane_of(s)].ended = true;  // no part of the step falls
    if (std::none_of(moved.begin(), moved.end(), [](char is) { return is != 0; })) break;
  }
  std::vector<Linearised> found;
  for (LaneSearch& lane : lanes) found.push_back(std::move(lane.step.from));
  return found;
}

}  // namespace pulson::compare
