// The search for the numbers of a model over the evidence itself: Laplace's approximation, then that of the samples.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
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

constexpr double kFirstStep = 1;        // of a search, in standard deviations of each number
constexpr double kTolerance = 0.05;     // in the same
constexpr double kDifference = 0.05;    // of coordinates, see Fitter::place()
constexpr double kGroupRange = 8;       // of logarithms of variances
constexpr double kWidthRange = 2.1;     // of the logarithm of the kernel's width: a factor of 8
constexpr double kOtherRange = 3.4;     // of other logarithms: a factor of 30
constexpr int kEvaluations = 40;        // of a search, and 20 for each number
constexpr double kSmall = 0.2;          // deviations of a variance that is tried without
constexpr double kNoLoss = 1e-3;        // nats
constexpr double kCorrected = 0.02;     // nats that a search still gains, at which the correction has converged
constexpr double kCorrectionRange = 3;  // deviations, of one search
constexpr int kMostCorrections = 12;
constexpr double kTheSame = 1;                    // deviations
constexpr double kHopeless = 2;                   // nats below
constexpr int kDrawsOfCohort = 640;               // that the correction is found with
constexpr int kFewestDraws = 8, kMostDraws = 32;  // of a shape

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

// About x, over the numbers that are free; in units of their scales, and no further than `range` of them.
LogSearch Fitter::box(const VectorXd& x, const VectorXd& scale, const std::vector<Index>& free, double range) const {
  const Index n = x.size();
  VectorXd least = VectorXd::Constant(n, -kOtherRange);
  VectorXd most = VectorXd::Constant(n, kOtherRange);
  least.head(groups()) = std::log1p(kNegligible) - x.head(groups()).array();
  most.head(groups()).setConstant(kGroupRange);
  if (settings_.fit_width) {
    least[groups()] = -kWidthRange - x[groups()];
    most[groups()] = kWidthRange - x[groups()];
  }
  const auto count = static_cast<int>(free.size());
  LogSearch search = log_search(count, 0, kTolerance, kEvaluations + 20 * count);
  search.least = least(free).cwiseMin(0).cwiseQuotient(scale(free)).cwiseMax(-range);
  search.most = most(free).cwiseMax(0).cwiseQuotient(scale(free)).cwiseMin(range);
  search.first_step = std::min(kFirstStep, 0.4 * (search.most - search.least).minCoeff());
  search.with_deviations = false;
  return search;
}

double Fitter::least_place(Index i) const {
  return i < groups() ? std::log1p(kNegligible) : -std::numeric_limits<double>::infinity();
}

double Fitter::Excess::operator()(const VectorXd& x) const {
  const VectorXd step = x - at;
  return value + slope.dot(step) - 0.5 * bend.dot(step.cwiseAbs2());
}

// Of Laplace's evidence and what is added to it. All matches begin from those of one place, so that the evidence is one
// function of the numbers. Numbers of scale 0 are held.
Fitter::Maximum Fitter::maximise(const State& from, const Excess& excess, const VectorXd& scale, double range) const {
  const auto value_of = [&](const State& state) { return state.log_evidence() + excess(place(state)); };
  const double first = value_of(from);
  const VectorXd start = place(from);
  Maximum best{from, first, {}};
  const auto tried = [&](const VectorXd& x) {
    try {
      State state = moved(from, x);
      const double value = value_of(state);
      if (value > best.value) best = {std::move(state), value, {}};
      return value;
    } catch (const Error&) {
      return -std::numeric_limits<double>::infinity();
    }
  };
  std::vector<Index> free;
  for (Index i = 0; i < scale.size(); ++i)
    if (scale[i] > 0) free.push_back(i);
  if (free.empty()) return best;
  const LogMaximum found = maximise_over_logs(
      [&](const VectorXd& y) {
        if (y.isZero(0)) return first;
        VectorXd x = start;
        x(free) += scale(free).cwiseProduct(y);
        return tried(x);
      },
      box(start, scale, free, range));
  for (Index g = 0; g < groups(); ++g) {
    VectorXd x = place(best.state);
    if (x[g] > kSmall * scale[g] || x[g] <= least_place(g)) continue;
    x[g] = least_place(g);
    State without = moved(from, x);
    if (value_of(without) >= best.value - kNoLoss) best.state = std::move(without);
  }
  best.state.converged = found.converged && std::all_of(best.state.matches.begin(), best.state.matches.end(),
                                                        [](const auto& match) { return match.converged; });
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

// How much the evidence of the samples is above Laplace's; NaN where too few of some shape's are effective to tell.
double Fitter::sampled_excess(const State& state, Draws& draws) const {
  const MatchingObjective objective = this->objective(state);
  const auto shapes = static_cast<int>(state.matches.size());
  const int count = std::clamp(kDrawsOfCohort / shapes, kFewestDraws, kMostDraws);
  draws.resize(at(shapes));
  VectorXd excess(shapes);
  parallel_for(shapes, [&](int s) {
    const Linearised& match = state.matches[at(s)];
    const ImportanceEstimate sampled =
        importance_sample(objective, observations_[at(s)], match, count, 0, settings_.seed + at(s), draws[at(s)]);
    excess[s] = sampled.effective_samples < kFewEffective * sampled.samples ? std::numeric_limits<double>::quiet_NaN()
                                                                            : sampled.log_evidence - match.log_evidence;
    if (settings_.on_match) settings_.on_match();
  });
  return excess.allFinite() ? excess.sum() : std::numeric_limits<double>::quiet_NaN();
}

// Laplace's evidence is corrected by a quadratic function of the numbers, which agrees with that of the samples, drawn
// with the same random numbers at each place, where it was taken: first by its slope from differences to one side, and
// from one place to the next by the secant; at the end by central differences, along each number. Nothing where too few
// samples are effective at some place.
std::optional<Fitter::Maximum> Fitter::correct(const State& start, const VectorXd& scale, Draws& draws) const {
  const Index n = scale.size();
  const auto sampled_at = [&](const State& from, Index i, double step) {
    try {
      return sampled_excess(moved(from, place(from) + step * scale[i] * VectorXd::Unit(n, i)), draws);
    } catch (const Error&) {
      return std::numeric_limits<double>::quiet_NaN();
    }
  };
  Excess excess{place(start), sampled_excess(start, draws), VectorXd::Zero(n), VectorXd::Zero(n)};
  Maximum best{start, start.log_evidence() + excess.value, {}};
  for (Index i = 0; i < n; ++i) excess.slope[i] = (sampled_at(start, i, 1) - excess.value) / scale[i];
  if (!std::isfinite(excess.value) || !excess.slope.allFinite()) return std::nullopt;
  double range = kCorrectionRange;
  bool central = false;
  for (int count = 0; count < kMostCorrections; ++count) {
    if (range < kTolerance) return Maximum{best.state, best.value, excess.bend};
    Maximum next = maximise(best.state, excess, scale, range);
    if (next.value - best.value < kCorrected) {
      if (central) return Maximum{best.state, best.value, excess.bend};
      central = true;
      for (Index i = 0; i < n; ++i) {
        const double above = sampled_at(best.state, i, 1);
        if (excess.at[i] - scale[i] <= least_place(i)) continue;  // at its bound the slope is that to one side
        const double below = sampled_at(best.state, i, -1);
        if (!std::isfinite(above + below)) continue;
        excess.slope[i] = (above - below) / (2 * scale[i]);
        excess.bend[i] = (2 * excess.value - above - below) / (scale[i] * scale[i]);
      }
      continue;
    }
    const double now = sampled_excess(next.state, draws);
    const VectorXd y = (place(next.state) - excess.at).cwiseQuotient(scale);
    if (!std::isfinite(now)) return std::nullopt;
    const double off = now - excess(place(next.state));
    next.value = next.state.log_evidence() + now;
    if (next.value > best.value) {
      const VectorXd to = place(next.state);
      excess.slope -= excess.bend.cwiseProduct(to - excess.at);
      excess.slope += y.cwiseQuotient(scale) * (off / y.squaredNorm());
      excess.at = to;
      excess.value = now;
      best = std::move(next);
    } else {
      excess.slope += y.cwiseQuotient(scale) * (off / y.squaredNorm());
      range = y.cwiseAbs().maxCoeff() / 3;
    }
  }
  best.state.converged = false;
  return best;
}

// The numbers of greatest evidence: near where the alternation ended and, as there may be two maxima, near those
// without noise, unless that is the same or hopeless.
Fitter::Maximum Fitter::search(const State& start) const {
  const auto scale_at = [&](const State& state) -> VectorXd {
    return information(state).diagonal().cwiseSqrt().cwiseInverse().cwiseMax(kLeastScale).cwiseMin(kMostScale);
  };
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  const VectorXd zero = VectorXd::Zero(numbers_open());
  const Excess nothing{zero, 0, zero, zero};
  Draws draws;
  const VectorXd scale = scale_at(start);
  VectorXd of_geodesic = scale;
  VectorXd without = place(start);
  for (Index g = lambda_open_ ? 1 : 0; g < groups(); ++g) {
    of_geodesic[g] = 0;
    without[g] = least_place(g);
  }
  const auto from_geodesic = [&] {
    const State geodesic = maximise(moved(start, without), nothing, of_geodesic, kAnywhere).state;
    return maximise(geodesic, nothing, scale_at(geodesic), kAnywhere);
  };
  if (settings_.importance_samples > 0)
    if (std::optional<Maximum> best = correct(start, scale, draws)) {
      if (amplitudes_.empty()) return *best;
      const State other = from_geodesic().state;
      const VectorXd scale_there = scale_at(other);
      const VectorXd apart = (place(other) - place(best->state)).cwiseQuotient(scale_there);
      if (apart.cwiseAbs().maxCoeff() < kTheSame) return *best;
      if (other.log_evidence() + sampled_excess(other, draws) < best->value - kHopeless) return *best;
      const std::optional<Maximum> corrected = correct(other, scale_there, draws);
      return corrected && corrected->value > best->value ? *corrected : *best;
    }
  // Laplace's alone, also where too few samples are effective.
  Maximum best = maximise(start, nothing, scale, kAnywhere);
  if (amplitudes_.empty()) return best;
  Maximum other = from_geodesic();
  return other.value > best.value ? other : best;
}

// −∇² of Laplace's evidence in the coordinates of place(), by differences; beside a bound they begin at it.
MatrixXd Fitter::curvature(const State& best, const VectorXd& scale) const {
  const Index n = scale.size();
  VectorXd centre = place(best);
  for (Index i = 0; i < n; ++i) centre[i] = std::max(centre[i], least_place(i) + scale[i]);
  const auto value = [&](const VectorXd& step) {
    return moved(best, centre + scale.cwiseProduct(step)).log_evidence();
  };
  const double middle = value(VectorXd::Zero(n));
  MatrixXd bend(n, n);
  VectorXd both(n);  // sums of both sides
  for (Index i = 0; i < n; ++i) {
    both[i] = value(VectorXd::Unit(n, i)) + value(-VectorXd::Unit(n, i));
    bend(i, i) = 2 * middle - both[i];
    for (Index j = 0; j < i; ++j) {
      const VectorXd step = VectorXd::Unit(n, i) + VectorXd::Unit(n, j);
      bend(i, j) = bend(j, i) = 0.5 * (both[i] + both[j] - value(step) - value(-step)) - middle;
    }
  }
  return scale.cwiseInverse().asDiagonal() * bend * scale.cwiseInverse().asDiagonal();
}

}  // namespace pulson
