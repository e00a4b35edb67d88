// The search for the numbers of a model over the evidence itself: Laplace's approximation, then that of the samples.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "fitter.hpp"
#include "importance.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of coordinates, see Fitter::place().
constexpr double kFirstStep = 0.3;
constexpr double kTolerance = 0.01;
constexpr double kDifference = 0.05;
constexpr double kGroupRange = 8;    // of logarithms of variances
constexpr double kWidthRange = 2.1;  // of the logarithm of the kernel's width: a factor of 8
constexpr double kOtherRange = 3.4;  // of other logarithms: a factor of 30
constexpr int kEvaluations = 40;     // of a search, and 20 for each number
constexpr double kSmall = 0.05;      // a variance so small beside σ² is tried without
constexpr double kNoLoss = 2e-3;     // nats
constexpr double kCorrectionStep = 0.15;
constexpr double kCorrected = 0.02;  // nats that a search still gained, at which the correction has converged
constexpr int kMostCorrections = 5;
constexpr int kDrawsOfCohort = 320;               // that the correction is found with
constexpr int kFewestDraws = 4, kMostDraws = 16;  // of a shape

}  // namespace

double Fitter::variance(const State& state, Index group) const {
  if (lambda_open_ && group == 0) return 1 / state.lambda;
  return std::pow(state.parameters[amplitudes_[at(group - (lambda_open_ ? 1 : 0))]], 2);
}

// Each number of the model on a scale on which the evidence is nearly quadratic: log(1 + v/v₀) of variances, with that
// of σ² as v₀, from 0 where noise vanishes; the logarithm of others.
VectorXd Fitter::place(const State& state) const {
  VectorXd x(numbers_open());
  Index i = 0;
  for (; i < groups(); ++i) x[i] = std::log1p(variance(state, i) / units_[i]);
  if (settings_.fit_width) x[i++] = std::log(state.width);
  for (const Index other : others_) x[i++] = std::log(state.parameters[other]);
  return x;
}

// The numbers at another place, and the matches there. @throws Error where there is none
Fitter::State Fitter::moved(const State& from, const VectorXd& to) const {
  State state = from;
  VectorXd u(groups());
  Index i = 0;
  for (; i < groups(); ++i) u[i] = std::log(units_[i] * std::max(std::expm1(to[i]), kNegligible) / variance(from, i));
  std::vector<VectorXd> z = rescale(state, u);
  if (settings_.fit_width) {
    const MatchingObjective before = objective(state);
    state.width = std::exp(to[i++]);
    if (state.width != from.width) {
      const MatchingObjective after = objective(state);
      for (VectorXd& of_shape : z) of_shape = after.white(before.momenta(of_shape), before.increments(of_shape));
    }
  }
  for (const Index other : others_) state.parameters[other] = std::exp(to[i++]);
  match(state, z, false);
  return state;
}

LogSearch Fitter::box(const VectorXd& x) const {
  LogSearch search = log_search(x.size(), kOtherRange, kTolerance, kEvaluations + 20 * static_cast<int>(x.size()));
  search.least.head(groups()) = (std::log1p(kNegligible) - x.head(groups()).array()).min(0);
  search.most.head(groups()).setConstant(kGroupRange);
  if (settings_.fit_width) {
    search.least[groups()] = -kWidthRange - x[groups()];
    search.most[groups()] = kWidthRange - x[groups()];
  }
  search.first_step = kFirstStep;
  search.with_deviations = false;
  return search;
}

// Of Laplace's evidence and what is added to it. All matches begin from those of one place, so that the evidence is one
// function of the numbers.
Fitter::Maximum Fitter::maximise(const State& from, const VectorXd& slope) const {
  Maximum best{from, 0};
  const auto value_of = [&](const State& state) { return state.log_evidence() + slope.dot(place(state)); };
  double most = value_of(best.state);
  const double first = most;
  const VectorXd start = place(from);
  const auto tried = [&](const VectorXd& x) {
    try {
      State state = moved(from, x);
      const double value = value_of(state);
      if (value > most) {
        most = value;
        best.state = std::move(state);
      }
      return value;
    } catch (const Error&) {
      return -std::numeric_limits<double>::infinity();
    }
  };
  const bool converged = best.state.converged;
  const LogMaximum found =
      maximise_over_logs([&](const VectorXd& x) { return x.isZero(0) ? first : tried(start + x); }, box(start));
  for (Index g = 0; g < groups(); ++g) {
    VectorXd x = place(best.state);
    const double least = std::log1p(kNegligible);
    if (x[g] > kSmall || x[g] <= least) continue;
    x[g] = least;
    State without = moved(best.state, x);
    if (value_of(without) >= most - kNoLoss) best.state = std::move(without);
  }
  best.state.converged = converged && found.converged;
  best.gain = most - first;
  return best;
}

// Fisher's information of the model linear about the matches, in the coordinates of place(): with C_i the derivative of
// C, Σ ½ tr C⁻¹C_i C⁻¹C_j over the shapes.
MatrixXd Fitter::information(const State& best) const {
  const VectorXd x = place(best);
  const Index n = x.size();
  const auto shapes = static_cast<int>(best.matches.size());
  std::vector<MatrixXd> parts(at(n * shapes));  // L⁻¹ C_i L⁻ᵀ with C = LLᵀ
  const auto covariance = [](const Linearised& match) {
    return MatrixXd(squared(match.jacobian) + MatrixXd::Identity(match.jacobian.rows(), match.jacobian.rows()));
  };
  for (Index i = 0; i < n; ++i) {
    const State aside = moved(best, x + kDifference * VectorXd::Unit(n, i));
    parallel_for(shapes, [&](int s) {
      const MatrixXd here = covariance(best.matches[at(s)]);
      const auto lower = here.llt();
      const MatrixXd half = lower.matrixL().solve(covariance(aside.matches[at(s)]) - here);
      parts[at(i * shapes + s)] = lower.matrixL().solve(MatrixXd(half.transpose())) / kDifference;
    });
  }
  MatrixXd sum(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j <= i; ++j) {
      double both = 0;
      for (Index s = 0; s < shapes; ++s)
        both += 0.5 * parts[at(i * shapes + s)].cwiseProduct(parts[at(j * shapes + s)]).sum();
      sum(i, j) = sum(j, i) = both;
    }
  return sum;
}

// How much the evidence of the samples is above Laplace's; NaN where some shape has none.
double Fitter::sampled_excess(const State& state) const {
  const MatchingObjective objective = this->objective(state);
  const auto shapes = static_cast<int>(state.matches.size());
  const int draws = std::clamp(kDrawsOfCohort / shapes, kFewestDraws, kMostDraws);
  VectorXd excess(shapes);
  parallel_for(shapes, [&](int s) {
    const Linearised& match = state.matches[at(s)];
    const ImportanceEstimate sampled =
        importance_sample(objective, observations_[at(s)], match, draws, 0, settings_.seed + at(s));
    excess[s] = sampled.log_evidence - match.log_evidence;
    if (settings_.on_match) settings_.on_match();
  });
  return excess.allFinite() ? excess.sum() : std::numeric_limits<double>::quiet_NaN();
}

// Laplace's evidence is corrected by a linear function of the numbers, which agrees with that of the samples, drawn
// with the same random numbers at each place, where it was taken: the excess varies slowly.
Fitter::Maximum Fitter::correct(Maximum best) const {
  VectorXd x = place(best.state);
  double excess = sampled_excess(best.state);
  VectorXd slope = VectorXd::Zero(x.size());
  for (Index i = 0; i < x.size(); ++i) {
    const VectorXd aside = x + kCorrectionStep * VectorXd::Unit(x.size(), i);
    slope[i] = (sampled_excess(moved(best.state, aside)) - excess) / kCorrectionStep;
  }
  for (int count = 0; count < kMostCorrections && slope.allFinite(); ++count) {
    best = maximise(best.state, slope);
    if (best.gain < kCorrected) return best;
    const VectorXd step = place(best.state) - x;
    const double now = sampled_excess(best.state);
    slope += step * ((now - excess - slope.dot(step)) / step.squaredNorm());
    excess = now;
    x += step;
  }
  best.state.converged = best.state.converged && slope.allFinite();
  return best;
}

}  // namespace pulson
