// The numbers of greatest evidence: where the models linear about the matches have them, by turns of matches and
// numbers (M. Lindstrom and D. Bates 1990), and from there by Newton's method on the evidence itself.

#include "fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::Minimum;
using posterior::Specimen;
using Kind = ModelNumber::Kind;
using enum CohortModel::Effort;

constexpr double kLeastGain = 0.01;  // nats that a further turn would still gain by the linear models
constexpr int kMostTurns = 30, kTurnsOfWidth = 5, kTurnsAgain = 2;
constexpr double kVarianceStep = 3, kWidthStep = 0.7;  // of x in a turn: linear models hold a factor 20, or 2, away
constexpr double kLost = 5;                            // nats below the best turn: others do not come back
constexpr int kMostBackoffs = 6;                       // halvings of a turn, where there is no path
constexpr double kLevels[] = {1.5, 2.7, 0};            // x of noise at which a search begins: amplitudes of 5, 9, 0 σ
constexpr double kHopeless = 15;  // nats of Laplace's evidence below the greatest, which samples do not make up for
constexpr int kLarge = 32, kFew = 16;  // shapes; a large cohort's first search is that of few of them
constexpr int kFewestSampled = 3;      // shapes: fewer have deviations far larger than the bias of Laplace's numbers
constexpr int kDrawsOfCohort = 960, kFewestDraws = 16, kMostDraws = 48;  // of a shape the latter two
constexpr double kMostDeviation = 2;  // of x: a number less determined than by a factor e² is searched as if it were
constexpr double kTrusted = 1.5;      // deviations from their matches within which draws are as effective as there
constexpr int kMostBases = 4, kMostImproved = 2;
constexpr double kMayVanish = 3;  // deviations from 0 within which it is tried

// Eigenvalues at least those of the greatest deviation.
MatrixXd metric_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(std::pow(kMostDeviation, -2)).asDiagonal() *
         axes.eigenvectors().transpose();
}

double distance(const MatrixXd& metric, const VectorXd& x) { return std::sqrt(x.dot(metric * x)); }

// What was found about matches at a place.
struct Found {
  Matches about;
  std::optional<EvidenceMaximum> maximum{};
  bool sampled = false;
  bool converged = false;
  Intervals intervals{};

  VectorXd x() const { return maximum ? maximum->local.x : about.x; }
};

class Search {
 public:
  explicit Search(const CohortModel& cohort) : cohort_(cohort) {}

  Found maximum() {
    Found found{first_matches()};
    if (cohort_.count() == 0) {
      cohort_.improve(found.about);
      found.converged = found.about.all_converged();
      return found;
    }
    found = climbed(best_candidate(candidates(found.about)));
    for (int count = 0; count < kMostImproved && cohort_.improve(found.about); ++count)
      found = climbed({settled(found.about, cohort_.box(), kTurnsAgain)});
    if (found.maximum) {
      std::vector<char> near_bound;
      for (const ModelNumber& number : cohort_.open()) near_bound.push_back(number.is_variance() ? 1 : 0);
      found.intervals = find_intervals(evidence(found), found.maximum->local, cohort_.box(), near_bound);
    }
    return found;
  }

  Found rough() { return {first_matches()}; }

  Found again(const VectorXd& x) { return {settled(cohort_.match(x, nullptr, kThorough), cohort_.box(), kTurnsAgain)}; }

 private:
  // Numbers and matches in turn until they no longer change. The best of them: where the kernel is too wide, matches do
  // not converge and turns may lead away.
  Matches settled(Matches now, const Box& box, int turns) const {
    Matches best = now;
    for (int turn = 0; turn < turns && cohort_.count() > 0; ++turn) {
      Box near = box;
      for (Index i = 0; i < cohort_.count(); ++i) {
        const ModelNumber& number = cohort_.open()[at(i)];
        double reach = number.is_variance() ? kVarianceStep : kWidthStep;
        if (number.kind == Kind::kOther) reach = 0;  // linear models do not have them
        near.least[i] = std::max(near.least[i], now.x[i] - reach);
        near.most[i] = std::max(near.least[i], std::min(near.most[i], now.x[i] + reach));
      }
      const BoxMaximum to = maximise_in_box([&](const VectorXd& x) { return cohort_.linear_value(now, x); },
                                            [&](const VectorXd& x) { return cohort_.linear_evidence(now, x).slope; },
                                            near, now.x, {.tolerance = kLeastGain / 4, .longest_step = kVarianceStep});
      if (to.value - now.log_evidence < kLeastGain) break;
      std::optional<Matches> next;
      double part = 1;
      for (int count = 0; count < kMostBackoffs && !next; ++count, part /= 2) try {
          next = cohort_.match(now.x + part * (to.x - now.x), &now, kRough);
        } catch (const NumericalError&) {
          // too few time steps for that
        }
      if (!next) break;
      now = std::move(*next);
      if (now.log_evidence > best.log_evidence)
        best = now;
      else if (now.log_evidence < best.log_evidence - kLost)
        break;
    }
    return best;
  }

  // At the start, amplitudes halved until there are paths.
  Matches begun(VectorXd x, CohortModel::Effort effort) const {
    for (int count = 0;; ++count) try {
        return cohort_.match(x, nullptr, effort);
      } catch (const NumericalError&) {
        if (count == 2 * kMostBackoffs || cohort_.count() == 0) throw;
        for (Index i = 0; i < x.size(); ++i)
          if (cohort_.open()[at(i)].is_variance()) x[i] /= 2;
      }
  }

  // Where the kernel is much too wide, matches do not converge and no slope leads to a better width, so that the best
  // of those a factor of 2 apart is taken.
  Matches first_matches() {
    if (cohort_.shapes() >= kLarge && cohort_.count() > 0) {
      const CohortModel few(few_of(cohort_.cohort()), cohort_.noise(), cohort_.settings());
      Search of_few(few);
      const VectorXd x = of_few.best_candidate(of_few.candidates(of_few.first_matches())).x();
      std::vector<double> values;
      for (Index i = 0; i < x.size(); ++i) values.push_back(few.open()[at(i)].value(x[i]));
      return settled(begun(cohort_.place(values), kThorough), cohort_.box(), kTurnsOfWidth);
    }
    const auto width = std::find_if(cohort_.open().begin(), cohort_.open().end(),
                                    [](const ModelNumber& number) { return number.kind == Kind::kWidth; });
    if (width == cohort_.open().end()) return settled(begun(cohort_.start(), kThorough), cohort_.box(), kMostTurns);
    const Index i = width - cohort_.open().begin();
    const auto at_width = [&](double x) -> std::optional<Matches> {
      try {
        return settled(begun(cohort_.start() + x * VectorXd::Unit(cohort_.count(), i), kRough), cohort_.box(),
                       kTurnsOfWidth);
      } catch (const NumericalError&) {
        return std::nullopt;
      }
    };
    std::optional<Matches> best = at_width(0);
    for (const double factor : {-std::log(2.0), std::log(2.0)})
      for (double x = factor; x > cohort_.box().least[i] && x < cohort_.box().most[i]; x += factor) {
        std::optional<Matches> next = at_width(x);
        if (best && (!next || !(next->log_evidence > best->log_evidence))) break;
        if (next) best = std::move(next);
      }
    if (!best) return settled(begun(cohort_.start(), kThorough), cohort_.box(), kMostTurns);
    Matches exact = cohort_.match(best->x, &*best, kThorough);
    return settled(std::move(exact), cohort_.box(), kMostTurns);
  }

  static Cohort few_of(const Cohort& cohort) {
    Cohort few{cohort.source, {}, cohort.alignment};
    for (int i = 0; i < kFew; ++i) few.targets.push_back(cohort.targets[at(i * std::ssize(cohort.targets) / kFew)]);
    return few;
  }

  // Also at some levels of noise: Laplace's evidence falls with the noise where that of the samples does not, and has
  // several maxima where noise bends the paths.
  std::vector<Matches> candidates(const Matches& first) const {
    std::vector<Matches> all{first};
    std::vector<Index> amplitudes;
    for (Index i = 0; i < cohort_.count(); ++i)
      if (cohort_.open()[at(i)].kind == Kind::kAmplitude) amplitudes.push_back(i);
    if (amplitudes.empty()) return all;
    for (const double level : kLevels) try {
        Box held = cohort_.box();
        held.least(amplitudes) = held.most(amplitudes) = held.least(amplitudes).cwiseMax(level);
        Matches there = settled(cohort_.match(held.clipped(first.x), &first), held, kTurnsOfWidth);
        if (there.log_evidence > all.front().log_evidence - kHopeless) all.push_back(std::move(there));
      } catch (const NumericalError&) {
        // no path with so much noise
      }
    return all;
  }

  int draws() const { return std::clamp(kDrawsOfCohort / cohort_.shapes(), kFewestDraws, kMostDraws); }

  std::optional<Evidence> sampled_at(const VectorXd& x, const Matches& chords, std::vector<Eigen::MatrixXd>& starts) {
    try {
      const SampledCohort sampled = sample_cohort(cohort_, x, chords, draws(), starts);
      if (!sampled.enough) return std::nullopt;
      Evidence evidence{sampled.log_evidence, VectorXd(kDrawGroups)};
      for (int g = 0; g < kDrawGroups; ++g) evidence.without_group[g] = sum_of_log_means(sampled.log_sets, g);
      return evidence;
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  // By the samples, or by Laplace's approximation where they do not tell it.
  Found best_candidate(const std::vector<Matches>& candidates) {
    const auto less = [](const Matches& a, const Matches& b) { return a.log_evidence < b.log_evidence; };
    const Matches* best = &*std::max_element(candidates.begin(), candidates.end(), less);
    bool sampled = false;
    if (cohort_.settings().importance_samples > 0 && cohort_.shapes() >= kFewestSampled) {
      double greatest = -std::numeric_limits<double>::infinity();
      for (const Matches& candidate : candidates) {
        std::vector<Eigen::MatrixXd> starts;
        const std::optional<Evidence> evidence = sampled_at(candidate.x, candidate, starts);
        if (!evidence || !(evidence->value > greatest)) continue;
        greatest = evidence->value;
        best = &candidate;
        sampled = true;
      }
    }
    return {*best, {}, sampled};
  }

  EvidenceAt evidence(const Found& found) {
    if (found.sampled) {
      const auto starts = std::make_shared<std::vector<Eigen::MatrixXd>>();
      const auto chords = std::make_shared<Matches>(found.about);
      return [this, starts, chords](const VectorXd& x) { return sampled_at(x, *chords, *starts); };
    }
    const auto near = std::make_shared<Matches>(found.about);
    return [this, near](const VectorXd& x) -> std::optional<Evidence> {
      try {
        const Matches there = cohort_.match(x, near.get());
        if (!there.all_converged() && near->all_converged()) return std::nullopt;
        return Evidence{there.log_evidence, {}};
      } catch (const Error&) {
        return std::nullopt;
      }
    };
  }

  Found climbed(Found found) {
    for (int base = 0; base < kMostBases; ++base) {
      const MatrixXd metric = metric_of(cohort_.linear_evidence(found.about, found.about.x).slope.information);
      const EvidenceAt evidence = this->evidence(found);
      std::optional<EvidenceMaximum> best = maximise_evidence(evidence, found.about.x, metric, cohort_.box());
      if (!best) break;
      vanish_if_likelier(evidence, metric, *best);
      const double far = distance(metric, best->local.x - found.about.x);
      found.maximum = std::move(best);
      found.converged = found.maximum->converged;
      if (far < kTrusted) break;
      try {
        found.about = cohort_.match(found.maximum->local.x, &found.about);
      } catch (const NumericalError&) {
        break;
      }
    }
    found.converged = (found.converged || all_vanish(found.x())) && found.about.all_converged();
    return found;
  }

  // Where a number is near 0 the evidence without it is found itself.
  void vanish_if_likelier(const EvidenceAt& evidence, const MatrixXd& metric, EvidenceMaximum& best) const {
    const Box& box = cohort_.box();
    for (Index g = 0; g < cohort_.count(); ++g) {
      const VectorXd& x = best.local.x;
      if (!cohort_.open()[at(g)].is_variance() || x[g] <= box.least[g]) continue;
      const MatrixXd covariance = best.local.slope.information.inverse();
      if (x[g] - box.least[g] > kMayVanish * std::sqrt(covariance(g, g))) continue;
      Box held = box;
      held.least[g] = held.most[g] = box.least[g];
      const VectorXd without = held.clipped(x + covariance.col(g) * ((box.least[g] - x[g]) / covariance(g, g)));
      std::optional<EvidenceMaximum> there = maximise_evidence(evidence, without, metric, held);
      if (there && there->local.here.value >= best.local.here.value) best = std::move(*there);
    }
  }

  // Neither momenta nor noise: the other numbers are of no effect.
  bool all_vanish(const VectorXd& x) const {
    bool any = false;
    for (Index g = 0; g < cohort_.count(); ++g) {
      if (!cohort_.open()[at(g)].is_variance()) continue;
      any = true;
      if (x[g] > 2 * kNegligible) return false;
    }
    return any;
  }

  const CohortModel& cohort_;
};

// Of logarithms of variances: a standard deviation above 3, a factor of 24, determines nothing.
constexpr double kLeastInformation = 0.1;

constexpr double kNinety = 1.645;  // deviations of a normal distribution on each side, 90 %

// Variance of the end points, in units of σ², below which neither momenta nor noise show: of numbers that vanish it is
// 6 millionths each.
constexpr double kDetectable = 100 * kNegligible;

// Standard deviations of numbers of this information; NaN for those that it does not identify.
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

// Half of an interval of 90 % is 1.645 deviations, of the side that has an end where the other has none.
VectorXd with_intervals(VectorXd deviations, const VectorXd& x, const Intervals& intervals) {
  for (Index i = 0; i < std::min(intervals.low.size(), deviations.size()); ++i) {
    if (!std::isfinite(deviations[i])) continue;
    const double below = x[i] - intervals.low[i], above = intervals.high[i] - x[i];
    if (std::isfinite(below) && std::isfinite(above))
      deviations[i] = (below + above) / (2 * kNinety);
    else if (std::isfinite(below) || std::isfinite(above))
      deviations[i] = (std::isfinite(below) ? below : above) / kNinety;
  }
  return deviations;
}

// Intervals are NaN where the data do not determine the number.
std::vector<FittedNumber> fitted_numbers(const CohortModel& cohort, const Found& found, const Matches& matches) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const VectorXd x = found.x();
  const Index n = cohort.count();
  if (n == 0) return {};
  // Numbers that vanish are known to: what the others determine is asked of these alone.
  std::vector<Index> present;
  for (Index i = 0; i < n; ++i)
    if (!(cohort.open()[at(i)].is_variance() && x[i] < 2 * kNegligible)) present.push_back(i);
  VectorXd errors = VectorXd::Zero(n);
  errors(present) = deviations(cohort.linear_evidence(matches, x).slope.information(present, present));
  errors = with_intervals(std::move(errors), x, found.intervals);
  const VectorXd correlations = cohort.correlations_with_sigma(matches);
  const bool at_rest =
      cohort.open().front().kind == Kind::kLambda && x[0] < 2 * kNegligible && cohort.noise().model->traits().linear;
  std::vector<FittedNumber> numbers;
  for (Index i = 0; i < n; ++i) {
    const ModelNumber& number = cohort.open()[at(i)];
    FittedNumber fitted{number.name, number.value(x[i]), kNan, false, kNan, kNan, kNan};
    const bool determined = std::isfinite(errors[i]) && found.intervals.low.size() > 0;
    const double low = determined ? found.intervals.low[i] : kNan, high = determined ? found.intervals.high[i] : kNan;
    if (number.is_variance()) {
      const bool is_lambda = number.kind == Kind::kLambda;
      fitted.vanishes = x[i] < 2 * kNegligible;
      const double v = number.unit * std::expm1(x[i]);
      const auto end = [&](double place) {
        if (std::isnan(place)) return kNan;
        const double variance = number.unit * std::max(std::expm1(place), 0.0);
        return is_lambda ? 1 / variance : std::sqrt(variance);
      };
      if (!fitted.vanishes) {
        fitted.log_deviation = (is_lambda ? 1 : 0.5) * errors[i] * (1 + number.unit / v);
        if (!cohort.settings().fit_sigma) fitted.correlation_with_sigma = correlations[i];
      }
      fitted.low = end(is_lambda ? high : low);
      fitted.high = end(is_lambda ? low : high);
    } else if (!(number.kind == Kind::kWidth && at_rest)) {  // of no momenta any width does
      fitted.log_deviation = errors[i];
      fitted.low = number.unit * std::exp(low);
      fitted.high = number.unit * std::exp(high);
    }
    numbers.push_back(std::move(fitted));
  }
  return numbers;
}

ShapeFit shape_fit(const CohortModel& cohort, const Matches& matches, int shape) {
  const Specimen& specimen = cohort.specimen(shape);
  const Minimum& match = matches.minima[at(shape)];
  const matching::MatchingProblem& problem = specimen.problem();
  ShapeFit fit;
  fit.momenta = specimen.momenta(matches.model, match.z);
  fit.increments = specimen.increments(0, match.z);
  const auto shot = specimen.shoot(matches.model, match.z);  // with the bits of the integrator
  fit.end =
      shot ? shot->paths.front().final().q : Points(match.end.reshaped(problem.source.rows(), problem.source.cols()));
  const VectorXd residual = specimen.residual(matches.model, fit.end.reshaped());
  const Index momenta = specimen.momentum_unknowns();
  fit.cost = {0.5 * match.z.head(momenta).squaredNorm(), 0.5 * match.z.tail(match.z.size() - momenta).squaredNorm(),
              0.5 * residual.squaredNorm()};
  const Landmarks& target = cohort.cohort().targets[at(shape)];
  const auto landmarks = static_cast<double>(target.count() - std::ssize(incomplete_points(target.points)));
  fit.rms = matches.model.sigma * problem.sigma * residual.norm() / std::sqrt(std::max(landmarks, 1.0));
  fit.log_evidence = fit.laplace = LinearAt(*match.linear, matches.model).log_evidence();
  fit.coordinates = static_cast<int>(specimen.data());
  fit.converged = match.converged;
  try {
    fit.flow_end = problem.integrator
                       ->integrate(matches.model.system, {problem.source, fit.momenta}, problem.grid,
                                   MatrixXd::Zero(fit.increments.rows(), problem.grid.steps))
                       .final()
                       .q;
  } catch (const StepError&) {
    fit.flow_end.resize(0, 0);
  }
  return fit;
}

// The samples' evidence in place of Laplace's. @return whether enough of them are effective
bool sample(const CohortModel& cohort, const Matches& matches, int shape, ShapeFit& fit) {
  const CohortSettings& settings = cohort.settings();
  const double enough = std::pow(settings.sampling_error, 2) / static_cast<double>(cohort.shapes());
  DrawStarts starts;
  const ImportanceEstimate sampled = sample_shape(cohort, shape, matches.model, *matches.minima[at(shape)].linear,
                                                  settings.importance_samples, enough, starts);
  if (std::isfinite(sampled.log_evidence)) fit.log_evidence = sampled.log_evidence;
  fit.variance = sampled.variance;
  const DistantEvidence distant = sample_distant(cohort, shape, matches, sampled.samples);
  if (distant.part > 0) {
    const double near = std::exp(fit.log_evidence - fit.laplace);
    const double sum = near + distant.part;
    fit.distant = distant.part / sum;
    fit.log_evidence += std::log(sum / near);
    fit.variance = (near * near * fit.variance + distant.variance) / (sum * sum);
  }
  fit.samples = sampled.samples;
  fit.effective_samples = sampled.effective_samples;
  fit.lost_samples = sampled.lost;
  return sampled.is_enough();
}

CohortFit record(const CohortModel& cohort, Found found) {
  // About the numbers themselves.
  Matches matches = found.x() == found.about.x ? found.about : cohort.match(found.x(), &found.about);
  const posterior::Numbers numbers = cohort.numbers(matches.x);
  CohortFit fit;
  fit.kernel = numbers.kernel->spec();
  fit.noise = numbers.noise->spec();
  if (cohort.noise().is_own) fit.own_noise = numbers.noise;
  fit.lambda = numbers.lambda;
  fit.sigma = numbers.sigma * cohort.specimen(0).problem().sigma;
  fit.fitted = fitted_numbers(cohort, found, matches);
  fit.laplace = matches.log_evidence;
  fit.converged = found.converged && matches.all_converged();
  const int shapes = cohort.shapes();
  fit.shapes.resize(at(shapes));
  parallel_for(shapes, [&](int s) { fit.shapes[at(s)] = shape_fit(cohort, matches, s); });
  constexpr int kAtOnce = 8;  // the rest is not drawn where these are not enough
  bool enough = cohort.settings().importance_samples > 0;
  for (int first = 0; first < shapes && enough; first += kAtOnce) {
    const int some = std::min(kAtOnce, shapes - first);
    std::vector<char> are_enough(at(some));
    parallel_for(some, [&](int i) {
      are_enough[at(i)] = sample(cohort, matches, first + i, fit.shapes[at(first + i)]) ? 1 : 0;
    });
    enough = std::count(are_enough.begin(), are_enough.end(), 0) == 0;
  }
  double of_momenta = 0, of_noise = 0;
  for (int s = 0; s < shapes; ++s) {
    const ShapeFit& shape = fit.shapes[at(s)];
    fit.coordinates += shape.coordinates;
    fit.log_evidence += shape.log_evidence;
    fit.sampling_error = std::hypot(fit.sampling_error, std::sqrt(shape.variance));
    if (shape.samples > 0) fit.effective_part = std::min(fit.effective_part, shape.effective_samples / shape.samples);
    const LinearAt linear(*matches.minima[at(s)].linear, matches.model);
    of_momenta += linear.momentum_share();
    of_noise += linear.noise_share();
  }
  fit.noise_share = of_noise + of_momenta > kDetectable * fit.coordinates ? of_noise / (of_noise + of_momenta) : 0;
  return fit;
}

}  // namespace

CohortFit fit_model(const CohortModel& cohort) { return record(cohort, Search(cohort).maximum()); }

CohortFit fit_roughly(const CohortModel& cohort) {
  Found found = Search(cohort).rough();
  found.converged = found.about.all_converged();
  return record(cohort, std::move(found));
}

CohortFit fit_again(const CohortModel& cohort, const CohortFit& before) {
  std::vector<double> values;
  for (const ModelNumber& number : cohort.open())
    values.push_back(std::find_if(before.fitted.begin(), before.fitted.end(), [&](const FittedNumber& fitted) {
                       return fitted.name == number.name;
                     })->value);
  Found found = Search(cohort).again(cohort.place(values));
  found.converged = found.about.all_converged();
  return record(cohort, std::move(found));
}

}  // namespace pulson::compare
