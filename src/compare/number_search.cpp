#include "number_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <Eigen/Eigenvalues>

#include "pulson/core/errors.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
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
// Deviations from their place within which what draws add is taken to change as there, and of x where the data do not
// determine a number; farther where it changes by less than so many nats. A slope of 1.5 nats found there for the sigma
// of 20 ovals promised 15 nats in five times that.
constexpr double kTrusted = 1.5, kMostTrusted = 0.7, kTrustedChange = 0.5;
constexpr int kMostBases = 8, kMostImproved = 2;
constexpr double kMayVanish = 3;  // deviations from 0 within which it is tried

double distance(const MatrixXd& metric, const VectorXd& x) { return std::sqrt(x.dot(metric * x)); }

// What draws add to Laplace's evidence, to first order about a place: of 20 shapes 12.0 nats without noise and 12.2
// with much of it, where the evidence itself falls by tens.
struct Added {
  VectorXd x;
  std::optional<Evidence> here;  // none: Laplace's stands
  VectorXd slope;
  MatrixXd slopes_without_group;  // a column each

  Evidence to(double laplace, const VectorXd& there) const {
    if (!here) return {laplace, {}};
    const VectorXd step = there - x;
    return {laplace + here->value + slope.dot(step),
            (here->without_group + slopes_without_group.transpose() * step).array() + laplace};
  }
};

}  // namespace

MatrixXd metric_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(std::pow(kMostDeviation, -2)).asDiagonal() *
         axes.eigenvectors().transpose();
}

namespace {

class Search {
 public:
  explicit Search(const CohortModel& cohort, const Matches* also = nullptr)
      : cohort_(cohort), box_(cohort.box()), also_(also) {}
  Search(const CohortModel& cohort, Index held, double place) : Search(cohort) {
    box_.least[held] = box_.most[held] = place;
    held_ = held;
  }

  Found maximum() {
    Found found{first_matches()};
    if (cohort_.count() == 0) {
      cohort_.improve(found.about);
      found.converged = found.about.all_converged();
      return found;
    }
    found = climbed(best_candidate(candidates(found.about)));
    for (int count = 0; count < kMostImproved && cohort_.improve(found.about); ++count)
      found = climbed({settled(found.about, box_, kTurnsAgain)});
    if (found.maximum) {
      std::vector<char> near_bound;
      for (const ModelNumber& number : cohort_.open()) near_bound.push_back(number.is_variance() ? 1 : 0);
      if (const auto here = surface_.evidence(found.x())) {
        found.local = evidence_about(surface_.evidence, found.x(), *here, surface_.metric, box_);
        found.intervals = find_intervals(surface_.evidence, *found.local, box_, near_bound);
      }
    }
    return found;
  }

  Found rough() { return {first_matches()}; }

  Found again(const Matches& near) { return {settled(near, box_, kTurnsAgain)}; }

  bool has_draws() const { return cohort_.settings().importance_samples > 0 && cohort_.shapes() >= kFewestSampled; }

  std::optional<Evidence> sampled_at(const VectorXd& x, const Matches& chords,
                                     std::vector<Eigen::MatrixXd>& starts) const {
    try {
      const SampledCohort sampled = sample_cohort(cohort_, x, chords, draws(), starts);
      if (!sampled.enough) return std::nullopt;
      const double of_mean = cohort_.of_own_mean(x);
      Evidence evidence{sampled.log_evidence + of_mean, VectorXd(kDrawGroups)};
      for (int g = 0; g < kDrawGroups; ++g) evidence.without_group[g] = sum_of_log_means(sampled.log_sets, g) + of_mean;
      return evidence;
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  // Where the kernel is much too wide, matches do not converge and no slope leads to a better width, so that the best
  // of those a factor of 2 apart is taken.
  Matches first_matches() {
    if (cohort_.shapes() >= kLarge && cohort_.count() > 0) {
      const Cohort some = few_of(cohort_.cohort());
      const CohortModel few(some, cohort_.noise(), cohort_.settings());
      VectorXd x;
      if (held_ < 0) {
        Search of_few(few);
        x = of_few.best_candidate(of_few.candidates(of_few.first_matches())).x();
      } else {
        const double value = cohort_.open()[at(held_)].value(box_.least[held_]);
        x = Search(few, held_, few.open()[at(held_)].place(value)).first_matches().x;
      }
      std::vector<double> values;
      for (Index i = 0; i < x.size(); ++i) values.push_back(few.open()[at(i)].value(x[i]));
      return settled(begun(cohort_.place(values), kThorough), box_, kTurnsOfWidth);
    }
    const auto width = std::find_if(cohort_.open().begin(), cohort_.open().end(),
                                    [](const ModelNumber& number) { return number.kind == Kind::kWidth; });
    if (width == cohort_.open().end()) return settled(begun(cohort_.start(), kThorough), box_, kMostTurns);
    const Index i = width - cohort_.open().begin();
    const auto at_width = [&](double x) -> std::optional<Matches> {
      try {
        return settled(begun(cohort_.start() + x * VectorXd::Unit(cohort_.count(), i), kRough), box_, kTurnsOfWidth);
      } catch (const NumericalError&) {
        return std::nullopt;
      }
    };
    std::optional<Matches> best = at_width(0);
    for (const double factor : {-std::log(2.0), std::log(2.0)})
      for (double x = factor; x > box_.least[i] && x < box_.most[i]; x += factor) {
        std::optional<Matches> next = at_width(x);
        if (best && (!next || !(next->log_evidence > best->log_evidence))) break;
        if (next) best = std::move(next);
      }
    if (!best) return settled(begun(cohort_.start(), kThorough), box_, kMostTurns);
    Matches exact = cohort_.match(best->x, &*best, kThorough);
    return settled(std::move(exact), box_, kMostTurns);
  }

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
      const auto to = maximise_by_newton([&](const VectorXd& x) { return cohort_.linear_value(now, x); },
                                         [&](const VectorXd& x) { return cohort_.linear_evidence(now, x); }, near,
                                         now.x, {.tolerance = kLeastGain / 4, .longest_step = kVarianceStep});
      if (to.about.value - now.log_evidence < kLeastGain) break;
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
        return cohort_.match(box_.clipped(x), nullptr, effort);
      } catch (const NumericalError&) {
        if (count == 2 * kMostBackoffs || cohort_.count() == 0) throw;
        for (Index i = 0; i < x.size(); ++i)
          if (cohort_.open()[at(i)].is_variance()) x[i] /= 2;
      }
  }

  static Cohort few_of(const Cohort& cohort) {
    Cohort few{cohort.source, {}, cohort.alignment, {}};
    for (int i = 0; i < kFew; ++i) {
      const std::size_t place = at(i * std::ssize(cohort.targets) / kFew);
      few.targets.push_back(cohort.targets[place]);
      if (!cohort.weights.empty()) few.weights.push_back(cohort.weights[place]);
    }
    return few;
  }

  // Also at some levels of noise: Laplace's evidence falls with the noise where that of the samples does not, and has
  // several maxima where noise bends the paths.
  std::vector<Matches> candidates(const Matches& first) const {
    std::vector<Matches> all{first};
    if (also_ != nullptr) {
      all.push_back(*also_);
      all.push_back(settled(*also_, box_, kTurnsOfWidth));
    }
    std::vector<Index> amplitudes;
    for (Index i = 0; i < cohort_.count(); ++i)
      if (cohort_.open()[at(i)].kind == Kind::kAmplitude) amplitudes.push_back(i);
    if (amplitudes.empty()) return all;
    for (const double level : kLevels) try {
        Box held = box_;
        held.least(amplitudes) = held.most(amplitudes) = held.least(amplitudes).cwiseMax(level);
        Matches there = settled(cohort_.match(held.clipped(first.x), &first), held, kTurnsOfWidth);
        if (there.log_evidence > all.front().log_evidence - kHopeless) all.push_back(std::move(there));
      } catch (const NumericalError&) {
        // no path with so much noise
      }
    return all;
  }

  int draws() const { return std::clamp(kDrawsOfCohort / cohort_.shapes(), kFewestDraws, kMostDraws); }

  Found best_candidate(const std::vector<Matches>& candidates) const {
    std::vector<PlaceEvidence> places;
    for (const Matches& candidate : candidates) {
      PlaceEvidence& place = places.emplace_back(PlaceEvidence{candidate.log_evidence});
      std::vector<Eigen::MatrixXd> starts;
      if (!has_draws()) continue;
      if (const auto evidence = sampled_at(candidate.x, candidate, starts)) place.by_draws = evidence->value;
    }
    const BestPlace best = best_place(places);
    return {candidates[best.index], {}, best.by_draws};
  }

  // Laplace's evidence and, where draws are enough, what these add to it, about matches.
  struct Surface {
    std::shared_ptr<const Matches> about;
    MatrixXd metric;
    EvidenceAt evidence;
    GradientAt gradient;
    double here = 0;   // the evidence at the matches
    VectorXd slope{};  // of what draws add, which is known about there alone; of no size without draws
  };

  Surface surface_about(Matches matches, bool sampled) const {
    Surface surface;
    surface.metric = metric_of(cohort_.linear_evidence(matches, matches.x).information);
    const auto near = std::make_shared<const Matches>(std::move(matches));
    const auto added =
        std::make_shared<const Added>(sampled ? added_by_draws(*near, surface.metric) : Added{near->x, {}, {}, {}});
    const auto last = std::make_shared<std::optional<Matches>>();
    surface.about = near;
    if (added->here) surface.slope = added->slope;
    surface.here = added->to(near->log_evidence, near->x).value;
    surface.evidence = [this, near, added, last](const VectorXd& x) -> std::optional<Evidence> {
      *last = matches_near(*near, x);
      if (!*last) return std::nullopt;
      return added->to((*last)->log_evidence, x);
    };
    surface.gradient = [this, added, last](const VectorXd& x, const MatrixXd& information) -> std::optional<VectorXd> {
      if (!*last || (*last)->x != x) return std::nullopt;
      try {
        VectorXd gradient = cohort_.gradient(last->value(), information, box_);
        if (added->here) gradient += added->slope;
        return gradient;
      } catch (const NumericalError&) {
        return std::nullopt;
      }
    };
    return surface;
  }

  std::optional<Matches> matches_near(const Matches& near, const VectorXd& x) const try {
    Matches there = cohort_.match(x, &near);
    if (!there.all_converged() && near.all_converged()) return std::nullopt;
    return there;
  } catch (const Error&) {
    return std::nullopt;
  }

  Added added_by_draws(const Matches& about, const MatrixXd& metric) const {
    std::vector<Eigen::MatrixXd> starts;
    const auto at_matches = [&](const Matches& matches) -> std::optional<Evidence> {
      std::optional<Evidence> found = sampled_at(matches.x, matches, starts);
      if (!found) return std::nullopt;
      return Evidence{found->value - matches.log_evidence, found->without_group.array() - matches.log_evidence};
    };
    Added added{about.x, at_matches(about), VectorXd::Zero(cohort_.count()), {}};
    if (!added.here) return added;
    added.slopes_without_group = MatrixXd::Zero(cohort_.count(), added.here->without_group.size());
    for (Index i = 0; i < cohort_.count(); ++i) {
      const double reach = reach_of_differences(metric, i);
      VectorXd above = about.x, below = about.x;
      above[i] = std::min(above[i] + reach, box_.most[i]);
      below[i] = std::max(below[i] - reach, box_.least[i]);
      const auto beside = [&](const VectorXd& x) -> std::optional<Evidence> {
        if (x == about.x) return added.here;
        const std::optional<Matches> there = matches_near(about, x);
        return there ? at_matches(*there) : std::nullopt;
      };
      const std::optional<Evidence> upper = beside(above), lower = beside(below);
      const double apart = above[i] - below[i];
      if (!upper || !lower || apart <= 0) continue;
      added.slope[i] = (upper->value - lower->value) / apart;
      added.slopes_without_group.row(i) = (upper->without_group - lower->without_group) / apart;
    }
    return added;
  }

  // By draws as far as these are trusted, from place to place; where the evidence is less at the next, less far.
  Found climbed(Found found) {
    surface_ = surface_about(std::move(found.about), found.sampled);
    double trusted = kTrusted;
    for (int base = 0; base < kMostBases; ++base) {
      const Box near = box_about(surface_, trusted);
      std::optional<EvidenceMaximum> best =
          maximise_evidence(surface_.evidence, surface_.gradient, surface_.about->x, surface_.metric, near);
      if (!best) break;
      vanish_if_likelier(*best, near);
      found.maximum = std::move(best);
      const VectorXd& x = found.maximum->x;
      found.converged = found.maximum->converged && is_inside(x, near);
      if (found.converged && distance(surface_.metric, x - surface_.about->x) < kTrusted) break;
      try {
        Surface next = surface_about(cohort_.match(x, surface_.about.get()), found.sampled);
        if (next.here < surface_.here - kAtMaximum)
          trusted /= 2;
        else
          surface_ = std::move(next);
      } catch (const NumericalError&) {
        break;
      }
    }
    found.about = *surface_.about;
    found.converged = (found.converged || all_vanish(found.x())) && found.about.all_converged();
    return found;
  }

  Box box_about(const Surface& surface, double trusted) const {
    Box box = box_;
    for (Index i = 0; i < surface.slope.size(); ++i) {
      const double reach = trusted * std::max(std::min(1 / std::sqrt(surface.metric(i, i)), kMostTrusted),
                                              kTrustedChange / kTrusted / std::max(std::abs(surface.slope[i]), 1e-9));
      box.least[i] = std::clamp(surface.about->x[i] - reach, box_.least[i], box_.most[i]);
      box.most[i] = std::clamp(surface.about->x[i] + reach, box_.least[i], box_.most[i]);
    }
    return box;
  }

  // At no bound that is not a number's own.
  bool is_inside(const VectorXd& x, const Box& near) const {
    for (Index i = 0; i < x.size(); ++i)
      if ((x[i] <= near.least[i] && near.least[i] > box_.least[i]) ||
          (x[i] >= near.most[i] && near.most[i] < box_.most[i]))
        return false;
    return true;
  }

  // Where a number is near 0 the evidence without it is found itself.
  void vanish_if_likelier(EvidenceMaximum& best, const Box& near) const {
    for (Index g = 0; g < cohort_.count(); ++g) {
      const VectorXd& x = best.x;
      const double least = box_.least[g];
      if (!cohort_.open()[at(g)].is_variance() || x[g] <= least || near.least[g] > least) continue;
      const MatrixXd covariance = best.information.inverse();
      if (x[g] - least > kMayVanish * std::sqrt(covariance(g, g))) continue;
      Box held = near;
      held.least[g] = held.most[g] = least;
      const VectorXd without = held.clipped(x + covariance.col(g) * ((least - x[g]) / covariance(g, g)));
      std::optional<EvidenceMaximum> there =
          maximise_evidence(surface_.evidence, surface_.gradient, without, surface_.metric, held);
      if (there && there->here.value >= best.here.value) best = std::move(*there);
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
  Box box_;
  Index held_ = -1;  // where a number is
  const Matches* also_ = nullptr;
  Surface surface_;  // about the matches that were found
};

}  // namespace

Found find_numbers(const CohortModel& cohort, const Matches* also) { return Search(cohort, also).maximum(); }

Found find_numbers_roughly(const CohortModel& cohort) { return Search(cohort).rough(); }

std::optional<Matches> find_matches_at(const CohortModel& cohort, Index held, double place) try {
  return Search(cohort, held, place).first_matches();
} catch (const NumericalError&) {
  return std::nullopt;
}

Found find_numbers_near(const CohortModel& cohort, const Matches& near) { return Search(cohort).again(near); }

std::optional<double> evidence_by_draws(const CohortModel& cohort, const Matches& about) {
  const Search search(cohort);
  if (!search.has_draws()) return std::nullopt;
  std::vector<Eigen::MatrixXd> starts;
  const std::optional<Evidence> evidence = search.sampled_at(about.x, about, starts);
  return evidence ? std::optional(evidence->value) : std::nullopt;
}

}  // namespace pulson::compare
