// The numbers of greatest evidence by the samples, and their intervals, from charts of the evidence about them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

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

constexpr int kDrawsOfCohort = 960, kFewestDraws = 16, kMostDraws = 48;  // of a shape the latter two
constexpr double kMostError = 1;  // nats, of the cohort's evidence by samples that are taken for better than Laplace's
// Fewer shapes have deviations that are far larger than the bias of Laplace's numbers, which does not shrink with them.
constexpr Index kFewestSampled = 3;
constexpr double kMostDeviation = 2;  // of a coordinate, and least, of a chart
constexpr double kLeastDeviation = 1e-4;
constexpr double kExtent = 6;           // deviations, of a chart's box
constexpr double kTrusted = 2.5;        // deviations that the maximum may be from a chart's centre
constexpr double kFarthest = 5;         // deviations of a step to another chart
constexpr double kDifference = 0.05;    // of coordinates
constexpr double kAtRest = 1.0 / 6;     // deviations that the maximum of a chart still moves
constexpr double kMayVanish = 1;        // nats by a chart, which it may be wrong about places where a number vanishes
constexpr double kStillMoves = 0.5;     // the same, as ends of intervals are charted
constexpr double kBelowItsProfile = 4;  // nats: places that may lead to a likely number, with the others at their best
constexpr int kMostCharts = 3, kMostPlaces = 6;
constexpr int kRoundsOfEnds = 6;  // in all but the last of which the ends of intervals are charted
// Of the evidence's places in a chart, deviations along the axes, and along two at once.
constexpr double kSampledAxis = 1.5, kSampledPair = 1.1;
constexpr double kInnerAxis = 0.75, kOuterAxis = 2.4;
constexpr double kPair = 1.2;
constexpr double kCurved = 1e-6;  // of the metric, more than rounding leaves of a surface without curvature
constexpr double kBeside = 4;     // deviations to a bound
constexpr double kSteep = 6;      // nats that the evidence may fall from a bound to the first place of an axis

// Eigenvalues within the range of deviations.
MatrixXd metric_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  const VectorXd values =
      axes.eigenvalues().cwiseMax(std::pow(kMostDeviation, -2)).cwiseMin(std::pow(kLeastDeviation, -2));
  return axes.eigenvectors() * values.asDiagonal() * axes.eigenvectors().transpose();
}

// The information of a metric. Where the evidence falls steeply from a bound, places deviations away would tell
// nothing: those of that number are less.
// @param above the bounds of the first numbers
MatrixXd information_beside_bounds(const SecondOrder& here, const VectorXd& above) {
  MatrixXd information = here.information;
  for (Index g = 0; g < above.size(); ++g) {
    const double slope = -here.gradient[g];
    const double curvature = here.information(g, g);
    if (slope <= 0 || above[g] * std::sqrt(curvature) > kSampledAxis) continue;
    const double fallen = 2 * kSteep / (slope + std::sqrt(slope * slope + 2 * curvature * kSteep));
    information(g, g) = std::max(curvature, std::pow(kSampledAxis / fallen, 2));
  }
  return information;
}

VectorXd deviations_of(const MatrixXd& metric) {
  return metric.llt().solve(MatrixXd::Identity(metric.rows(), metric.cols())).diagonal().cwiseSqrt();
}

double distance(const MatrixXd& metric, const VectorXd& x) { return std::sqrt(x.dot(metric * x)); }

Box extent(const Box& box, const VectorXd& x, const MatrixXd& metric, double deviations) {
  const VectorXd reach = deviations * deviations_of(metric);
  return {box.least.cwiseMax(x - reach), box.most.cwiseMin(x + reach)};
}

VectorXd maximum_of(const Likelihood& likelihood, const VectorXd& from) {
  return maximise_in_box(likelihood.value, likelihood.second_order, likelihood.box, from).x;
}

VectorXd greatest_of(const Likelihood& likelihood, const std::vector<VectorXd>& starts) {
  BoxMaximum best{starts.front(), -std::numeric_limits<double>::infinity(), false};
  for (const VectorXd& start : starts)
    if (BoxMaximum found = maximise_in_box(likelihood.value, likelihood.second_order, likelihood.box, start);
        found.value > best.value)
      best = std::move(found);
  return best.x;
}

// Variances of the maximum by the draws, by the jackknife over their groups, each of which moves it by a Newton step;
// numbers at a bound stay there.
VectorXd variances_by_draws(const EvidenceMap& map, const MatrixXd& metric, const Likelihood& likelihood) {
  constexpr int kGroups = EvidenceMap::kGroups;
  const VectorXd& x = likelihood.maximum;
  std::vector<Index> free;
  for (Index i = 0; i < x.size(); ++i)
    if (x[i] > likelihood.box.least[i] && x[i] < likelihood.box.most[i]) free.push_back(i);
  VectorXd variances = VectorXd::Zero(x.size());
  if (free.empty()) return variances;
  const Eigen::LLT<MatrixXd> information(metric_of(likelihood.second_order(x).information(free, free)));
  MatrixXd moves(std::ssize(free), kGroups);
  for (int g = 0; g < kGroups; ++g) {
    const VectorXd gradient = map.likelihood(metric, likelihood.box, g).second_order(x).gradient(free);
    moves.col(g) = information.solve(gradient);
  }
  variances(free) = (moves.colwise() - moves.rowwise().mean()).rowwise().squaredNorm() * ((kGroups - 1.0) / kGroups);
  return variances;
}

}  // namespace

Fitter::Excess Fitter::sampled_excess(const State& state, Draws& draws) const {
  const matching::MatchingObjective objective = this->objective(state);
  const auto shapes = static_cast<int>(state.matches.size());
  const int count = std::clamp(kDrawsOfCohort / shapes, kFewestDraws, kMostDraws);
  draws.resize(at(shapes));
  Excess excess{std::vector<VectorXd>(at(shapes))};
  std::vector<double> variances(at(shapes));
  excess.enough = while_enough(shapes, [&](int s) {
    const Linearised& match = state.matches[at(s)];
    const ImportanceEstimate sampled =
        importance_sample(objective, observations_[at(s)], match, count, 0, settings_.seed + at(s), draws[at(s)]);
    excess.of_shapes[at(s)] = sampled.log_sets.array() - match.log_evidence;
    variances[at(s)] = sampled.variance;
    if (settings_.on_match) settings_.on_match();
    return sampled.effective_samples >= kFewEffective * sampled.samples;
  });
  excess.enough = excess.enough && std::sqrt(std::accumulate(variances.begin(), variances.end(), 0.0)) < kMostError;
  for (int g = 0; g < EvidenceMap::kGroups && excess.enough; ++g)
    excess.enough = std::isfinite(sum_of_log_means(excess.of_shapes, g));
  return excess;
}

// Charts the candidates, and finds the best: by the samples, or by Laplace's approximation where they do not tell.
Fitter::State Fitter::best_candidate(const std::vector<State>& candidates, EvidenceMap& map, Draws& draws) {
  const auto least = [](const State& a, const State& b) { return a.log_evidence() < b.log_evidence(); };
  const State& laplace = *std::max_element(candidates.begin(), candidates.end(), least);
  const State* greatest = nullptr;
  double value = -std::numeric_limits<double>::infinity();
  for (const State& state : candidates) {
    if (!state.all_matched() || state.log_evidence() < laplace.log_evidence() - kHopeless) continue;
    map.add(place(state), state.log_evidence());
    if (settings_.importance_samples == 0 || std::ssize(state.matches) < kFewestSampled) continue;
    Excess excess = sampled_excess(state, draws);
    if (!excess.enough) continue;
    const double here = state.log_evidence() + sum_of_log_means(excess.of_shapes);
    map.add_samples(place(state), std::move(excess.of_shapes));
    if (here <= value) continue;
    value = here;
    greatest = &state;
  }
  return greatest == nullptr ? laplace : *greatest;
}

// Where a chart has little more evidence than without some noise, within its errors, the evidence without it is found
// itself, with the other numbers where the chart has them best.
Fitter::State Fitter::vanishing_if_likelier(const Chart& chart, State best, EvidenceMap& map, Draws& draws) {
  VectorXd x = place(best);
  for (Index g = 0; g < groups(); ++g) {
    std::optional<VectorXd> before;
    for (int round = 0; round < kMostPlaces && x[g] > chart.box.least[g]; ++round) {
      Likelihood likelihood = map.likelihood(chart.metric, extent(chart.box, x, chart.metric, kTrusted));
      likelihood.box.least[g] = likelihood.box.most[g] = chart.box.least[g];
      const VectorXd without = maximum_of(likelihood, likelihood.box.clipped(x));
      if (likelihood.value(without) < likelihood.value(x) - kMayVanish) break;
      if (before && distance(chart.metric, without - *before) < kAtRest) break;
      before = without;
      std::optional<State> there = charted(best, without, true, map, draws);
      if (!there) break;
      const auto value = map.evidence_at(x), value_without = map.evidence_at(without);
      if (!value || !value_without || *value_without < *value) continue;
      there->converged = best.converged;
      best = std::move(*there);
      x = without;
    }
  }
  return best;
}

// Adds a place to the map; none where some shape has no match, as time steps are too few for it.
// @param from whose matches are followed there @param with_samples where the map has any
std::optional<Fitter::State> Fitter::charted(const State& from, const VectorXd& x, bool with_samples, EvidenceMap& map,
                                             Draws& draws) {
  try {
    const bool is_here = x == place(from);
    State state = is_here ? from : moved(from, x);
    if (!is_here && !state.all_matched()) return std::nullopt;
    map.add(x, state.log_evidence());
    if (with_samples && map.has_samples() && !map.evidence_at(x))
      if (Excess excess = sampled_excess(state, draws); excess.enough) map.add_samples(x, std::move(excess.of_shapes));
    return state;
  } catch (const Error&) {
    return std::nullopt;
  }
}

// In columns of unit length in the metric.
MatrixXd Fitter::Chart::axes() const {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(metric);
  return solver.eigenvectors() * solver.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
}

// Where a step of Newton's method leads, by the samples at the centre and beside it and the curvature of the metric, if
// that is farther than a chart is trusted, and likelier.
std::optional<Fitter::State> Fitter::approach(const Chart& chart, EvidenceMap& map, Draws& draws) {
  const VectorXd centre = place(chart.centre);
  const MatrixXd axes = chart.axes();
  const auto evidence = [&](const VectorXd& x) -> std::optional<double> {
    const VectorXd inside = chart.box.clipped(x);
    if (!charted(chart.centre, inside, true, map, draws)) return std::nullopt;
    return map.evidence_at(inside);
  };
  const std::optional<double> middle = evidence(centre);
  if (!middle) return std::nullopt;
  VectorXd slopes(axes.cols());
  for (Index i = 0; i < axes.cols(); ++i) {
    const VectorXd x = centre + kSampledAxis * axes.col(i);
    const bool inside = chart.box.clipped(x) == x;
    const double step = inside ? kSampledAxis : -kSampledAxis;
    const std::optional<double> aside = evidence(centre + step * axes.col(i));
    if (!aside) return std::nullopt;
    slopes[i] = (*aside - *middle) / step + step / 2;
  }
  if (slopes.norm() < kTrusted) return std::nullopt;
  slopes *= std::min(1.0, kFarthest / slopes.norm());
  for (;; slopes /= 2) {
    const VectorXd to = chart.box.clipped(centre + axes * slopes);
    if (distance(chart.metric, to - centre) < kTrusted) return std::nullopt;
    std::optional<State> there = charted(chart.centre, to, true, map, draws);
    if (const auto value = map.evidence_at(to); there && value && *value > *middle) return there;
  }
}

// Places along the axes of the metric, and at bounds that are near.
void Fitter::survey(const Chart& chart, EvidenceMap& map, Draws& draws) {
  const VectorXd centre = place(chart.centre);
  const MatrixXd axes = chart.axes();
  const auto add = [&](const VectorXd& aside, bool with_samples) {
    const VectorXd x = chart.box.clipped(centre + aside);
    if (!map.is_known(x, with_samples && map.has_samples(), chart.metric))
      charted(chart.centre, x, with_samples, map, draws);
  };
  add(VectorXd::Zero(centre.size()), true);
  const MatrixXd covariance = chart.metric.llt().solve(MatrixXd::Identity(centre.size(), centre.size()));
  for (Index g = 0; g < groups(); ++g)
    if (const double down = chart.box.least[g] - centre[g]; kBeside * std::sqrt(covariance(g, g)) > -down)
      add(covariance.col(g) * (down / covariance(g, g)), true);
  for (Index i = 0; i < axes.cols(); ++i)
    for (const double sign : {1.0, -1.0}) {
      add(sign * kSampledAxis * axes.col(i), true);
      add(sign * kOuterAxis * axes.col(i), false);
      add(sign * kInnerAxis * axes.col(i), false);
      for (Index j = 0; j < i; ++j) {
        add(sign * kSampledPair * (axes.col(i) + axes.col(j)), sign > 0);
        add(sign * kPair * (axes.col(i) - axes.col(j)), false);
      }
    }
}

// Profile intervals, from the least to the greatest likely number, be there less likely ones between, and widened by
// what the draws leave uncertain. The ends are charted, and found again.
Fitter::Maximum Fitter::find_intervals(const Chart& chart, State best, EvidenceMap& map, Draws& draws) {
  const Index n = numbers_open();
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  Maximum found{std::move(best), chart.metric, VectorXd::Constant(n, -kNowhere), VectorXd::Constant(n, kNowhere)};
  const VectorXd found_at = place(found.state);
  const VectorXd by_metric = deviations_of(chart.metric);
  const Box about = extent(chart.box, found_at, chart.metric, kExtent);
  const bool sampled = map.has_samples();
  for (int round = 0; round < kRoundsOfEnds; ++round) {
    Likelihood likelihood = map.likelihood(chart.metric, extent(chart.box, found_at, chart.metric, kStillMoves));
    likelihood.maximum = maximum_of(likelihood, found_at);
    const std::vector<VectorXd> likely = map.likely_places(likelihood, kDropOfNinety + kBelowItsProfile);
    Box& box = likelihood.box = about;
    for (const VectorXd& place : likely) {
      const Box near = extent(chart.box, place, chart.metric, kTrusted);
      box = {box.least.cwiseMin(near.least), box.most.cwiseMax(near.most)};
    }
    const MatrixXd information = likelihood.second_order(likelihood.maximum).information;
    if (Eigen::LLT<MatrixXd>(information - kCurved * chart.metric).info() == Eigen::Success)
      found.information = information;
    const VectorXd deviations = deviations_of(metric_of(found.information));
    VectorXd by_draws = VectorXd::Zero(n);
    if (map.has_samples()) by_draws = variances_by_draws(map, chart.metric, likelihood);
    for (Index i = 0; i < n; ++i)
      for (const int direction : {-1, 1}) {
        const double wider = 1 + by_draws[i] / (deviations[i] * deviations[i]);
        const auto drop = [&](double t) {
          return wider * (i < groups() ? drop_of_ninety((t - chart.box.least[i]) / deviations[i]) : kDropOfNinety);
        };
        const auto [end, is_beyond] = profile_end(likelihood, i, direction, deviations[i], drop, likely);
        double& interval_end = (direction < 0 ? found.low : found.high)[i];
        const bool is_bound = end[i] == (direction < 0 ? chart.box.least : chart.box.most)[i];
        // Where nothing is charted, as places there have no matches, or the chart contradicts the estimate, that of a
        // parabola.
        if (is_beyond && is_bound)
          interval_end = direction * kNowhere;
        else if (map.is_known(end, sampled, chart.metric, kTrusted) && direction * (end[i] - found_at[i]) > 0)
          interval_end = end[i];
        else
          interval_end = found_at[i] + direction * std::sqrt(2 * kDropOfNinety * wider) * by_metric[i];
        if (round + 1 < kRoundsOfEnds && !map.is_known(end, sampled, chart.metric))
          charted(chart.centre, end, true, map, draws);
      }
  }
  return found;
}

// About a state, or, where a variance is near its bound, so far from that that the places of a survey are not, with the
// others where the metric has them best.
Fitter::Chart Fitter::chart_about(const State& state, const Box& box) {
  const VectorXd steps = VectorXd::Constant(numbers_open(), kDifference);
  const auto about = [&](const State& centre) {
    const VectorXd above = (place(centre) - box.least).head(groups());
    return Chart{centre, metric_of(information_beside_bounds(second_order(centre, box, steps), above)), box};
  };
  Chart chart = about(state);
  const MatrixXd covariance = chart.metric.llt().solve(MatrixXd::Identity(chart.metric.rows(), chart.metric.cols()));
  VectorXd x = place(state);
  for (Index g = 0; g < groups(); ++g) {
    const double missing = box.least[g] + kSampledAxis * std::sqrt(covariance(g, g)) - x[g];
    if (missing > 0) x += covariance.col(g) * (missing / covariance(g, g));
  }
  try {
    if (const State aside = moved(state, box.clipped(x)); aside.all_matched() && x != place(state)) return about(aside);
  } catch (const Error&) {
    // too few time steps there
  }
  return chart;
}

Fitter::Maximum Fitter::search(const std::vector<State>& candidates) {
  Draws draws;
  const Box box = everywhere(candidates.front());
  // Neither momenta nor noise: the other numbers are of no effect.
  const auto all_vanish = [this](const State& state) {
    for (Index g = 0; g < groups(); ++g)
      if (variance(state, g) >= 2 * kNegligible * units_[g]) return false;
    return groups() > 0;
  };
  EvidenceMap map;
  State best = best_candidate(candidates, map, draws);
  const bool sampled = map.has_samples();
  Chart chart;
  for (int count = 0; count < kMostCharts; ++count) {
    chart = chart_about(best, box);
    if (sampled && count + 1 < kMostCharts)
      if (std::optional<State> there = approach(chart, map, draws)) {
        best = std::move(*there);
        continue;
      }
    survey(chart, map, draws);
    const VectorXd centre = place(chart.centre);
    bool at_rest = false;
    const auto likelihood = [&] { return map.likelihood(chart.metric, extent(box, centre, chart.metric, kExtent)); };
    for (int places = 0; places < kMostPlaces && !at_rest; ++places) {
      const VectorXd before = map.best_place(likelihood());
      Box near = extent(box, centre, chart.metric, kTrusted);
      near = {near.least.cwiseMin(before), near.most.cwiseMax(before)};
      const VectorXd x = greatest_of(map.likelihood(chart.metric, near), {before, place(best), centre});
      at_rest = map.is_known(x, sampled, chart.metric, kAtRest);
      std::optional<State> next;
      for (const double part : {1.0, 0.5, 0.25})
        if (!at_rest && !next) next = charted(chart.centre, before + part * (x - before), true, map, draws);
      if (!next) break;
    }
    if (auto there = charted(chart.centre, map.best_place(likelihood()), false, map, draws)) best = std::move(*there);
    best.converged = (at_rest || all_vanish(best)) && best.all_matched();
    if (distance(chart.metric, place(best) - centre) < kTrusted) break;
  }
  return find_intervals(chart, vanishing_if_likelier(chart, best, map, draws), map, draws);
}

}  // namespace pulson::compare
