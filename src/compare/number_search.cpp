#include "number_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>

#include "evidence_surface.hpp"
#include "held_number.hpp"
#include "pulson/core/errors.hpp"

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
constexpr double kLevels[] = {0.6, 1.5, 2.7, 0};  // x of noise at which a search begins: amplitudes of 2, 5, 9, 0 σ
constexpr double kHopeless = 15;  // nats of Laplace's evidence below the greatest, which samples do not make up for
constexpr int kLarge = 32, kFew = 16;  // shapes; a large cohort's first search is that of few of them
constexpr int kMostSteps = 20, kMostImproved = 2;
// Nats that differences may promise where the evidence does not rise.
constexpr double kPromised = 0.1;
constexpr double kMostOfTrust = 4;  // times what is trusted at first
// Nats by which the candidates with noise, or those without, are behind the others so that they are not climbed from:
// from those of three cohorts of 20 ovals and of the leaves 0.3 to 3 were gained.
constexpr double kFarBehind = 5;
constexpr double kMayVanish = 3;  // deviations from 0 within which it is tried

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
    found = best_of(candidates(found.about));
    for (int count = 0; count < kMostImproved && cohort_.improve(found.about); ++count)
      found = climbed({settled(found.about, box_, kTurnsAgain), found.sampled});
    if (surface_) find_the_intervals(found);
    return found;
  }

  Found rough() { return {first_matches()}; }

  Found again(const Matches& near) { return {settled(near, box_, kTurnsAgain)}; }

  // Where the kernel is much too wide, matches do not converge and no slope leads to a better width, so that the best
  // of those a factor of 2 apart is taken.
  Matches first_matches() {
    if (cohort_.shapes() >= kLarge && cohort_.count() > 0) {
      const Cohort some = few_of(cohort_.cohort());
      const CohortModel few(some, cohort_.noise(), cohort_.settings());
      VectorXd x;
      if (held_ < 0) {
        Search of_few(few);
        const std::vector<Matches> places = of_few.candidates(of_few.first_matches());
        x = places[best_place(of_few.evidences(places)).index].x;
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

  // With as much noise as was found from rest, with none and at some levels, each the greatest evidence by Laplace with
  // that: this falls with the noise where that of the samples does not, and has several maxima where noise bends the
  // paths.
  std::vector<Matches> candidates(const Matches& first) const {
    std::vector<Matches> all{without_draws(first)};
    if (also_ != nullptr) all.push_back(*also_);
    if (!has_amplitudes()) return all;
    for (const double level : kLevels) try {
        if (level == 0 && also_ != nullptr) continue;
        Matches best = at_level(level, first);
        if (also_ != nullptr)
          if (Matches other = at_level(level, *also_); other.log_evidence > best.log_evidence) best = std::move(other);
        const auto greatest = std::max_element(all.begin(), all.end(), [](const Matches& one, const Matches& another) {
          return one.log_evidence < another.log_evidence;
        });
        if (best.log_evidence > greatest->log_evidence - kHopeless) all.push_back(without_draws(std::move(best)));
      } catch (const NumericalError&) {
        // no path with so much noise
      }
    return all;
  }

  // To the greatest evidence by Laplace with as much noise, which costs no draws.
  Matches without_draws(Matches best) const {
    if (!has_draws(cohort_)) return best;
    Box held = box_;
    for (Index i = 0; i < cohort_.count(); ++i)
      if (is_amplitude(i)) held.least[i] = held.most[i] = best.x[i];
    Correction correction = correction_about(cohort_, best, held);
    turn_by_turn(cohort_, best, correction, {}, held);
    return cohort_.match(best.x, &best);
  }

  Matches at_level(double level, const Matches& near) const {
    Box held = box_;
    for (Index i = 0; i < cohort_.count(); ++i)
      if (is_amplitude(i)) held.least[i] = held.most[i] = std::max(held.least[i], level);
    return settled(cohort_.match(held.clipped(near.x), &near), held, kTurnsOfWidth);
  }

  bool is_amplitude(Index i) const { return cohort_.open()[at(i)].kind == Kind::kAmplitude; }
  bool has_amplitudes() const {
    for (Index i = 0; i < cohort_.count(); ++i)
      if (is_amplitude(i)) return true;
    return false;
  }
  bool has_noise(const VectorXd& x) const {
    for (Index i = 0; i < cohort_.count(); ++i)
      if (is_amplitude(i) && x[i] > 2 * kNegligible) return true;
    return false;
  }

  std::vector<PlaceEvidence> evidences(const std::vector<Matches>& candidates) const {
    std::vector<PlaceEvidence> places;
    for (const Matches& candidate : candidates) {
      places.push_back({candidate.log_evidence, {}});
      if (const auto sampled = evidence_by_draws(cohort_, candidate)) places.back().by_draws = sampled->value;
    }
    return places;
  }

  // From the best of the candidates with noise, and of those without: a maximum may be at either.
  Found best_of(const std::vector<Matches>& candidates) {
    const std::vector<PlaceEvidence> places = evidences(candidates);
    std::vector<Found> found;
    std::vector<EvidenceSurface> surfaces;
    std::vector<PlaceEvidence> reached;
    const BestPlace greatest = best_place(places);
    for (const bool with_noise : {true, false}) {
      std::vector<PlaceEvidence> of_kind;
      std::vector<std::size_t> which;
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        if (has_noise(candidates[i].x) != with_noise) continue;
        of_kind.push_back(places[i]);
        which.push_back(i);
      }
      if (of_kind.empty()) continue;
      const BestPlace place = best_place(of_kind);
      const auto behind = [&](const PlaceEvidence& of) {
        const PlaceEvidence& ahead = places[greatest.index];
        return of.by_draws && ahead.by_draws ? *ahead.by_draws - *of.by_draws : ahead.laplace - of.laplace;
      };
      if (behind(of_kind[place.index]) > kFarBehind) continue;
      // Without noise the fit of `none` is known; where noise gains little by it nothing is lost.
      if (!with_noise && also_ != nullptr && !found.empty()) continue;
      const Matches& start = candidates[which[place.index]];
      found.push_back(climbed({start, place.by_draws}));
      surfaces.push_back(*surface_);
      reached.push_back(
          {surface_->about().log_evidence, surface_->is_sampled() ? std::optional(surface_->here()) : std::nullopt});
    }
    const std::size_t best = best_place(reached).index;
    surface_ = std::move(surfaces[best]);
    return std::move(found[best]);
  }

  // From place to place, each the greatest evidence as differences about an earlier one have it, as far as these are
  // trusted; where the evidence is less at the next, they are taken anew, and it is sought less far.
  Found climbed(Found found) {
    surface_.emplace(cohort_, std::move(found.about), found.sampled);
    double part = 1;
    bool has_failed = false;  // the last time
    std::vector<char> tried(at(cohort_.count()));
    for (int count = 0; count < kMostSteps; ++count) {
      const EvidenceSurface::Promise best = surface_->greatest(part, box_);
      const double before = surface_->here();
      bool ends = best.gain < kAtMaximum;
      found.converged = ends && best.inside;
      const bool moved = !ends && surface_->go_to(best.x);
      const double gain = surface_->here() - before;
      if (gain >= kAtMaximum) {
        if (gain > best.gain / 2) part = std::min(2 * part, kMostOfTrust);
        has_failed = false;
      } else if (!ends && (!has_failed || !surface_->measure())) {
        found.converged = ends = (moved || has_failed) && is_little(best);
        part /= 2;
        has_failed = true;
      }
      if (!ends || (found.converged && vanishes_likelier(tried)) || (!found.converged && surface_->renew())) continue;
      if (!found.converged || !surface_->is_far()) break;
      surface_->measure();
      found.converged = false;
    }
    if (!found.converged) vanishes_likelier(tried);
    found.about = surface_->about();
    found.converged = (found.converged || all_vanish(found.x())) && found.about.all_converged();
    return found;
  }

  // What draws do not distinguish from nothing.
  bool is_little(const EvidenceSurface::Promise& promise) const {
    return promise.gain < std::max(kPromised, surface_->doubt());
  }

  void find_the_intervals(Found& found) {
    std::vector<char> near_bound;
    for (const ModelNumber& number : cohort_.open()) near_bound.push_back(number.is_variance() ? 1 : 0);
    found.local = surface_->local();
    std::optional<HeldNumber> walk;
    Index walked = -1;
    const auto profile = [&](Index held, double place) -> std::optional<ProfilePlace> {
      if (held != walked)
        walk.emplace(cohort_, walked = held, surface_->about(), surface_->correction_of_laplace(),
                     surface_->by_draws());
      walk->visit(place);
      const HeldNumber::Place* there = walk->at_place(place);
      if (there == nullptr) return std::nullopt;
      if (std::optional<Evidence> drawn = surface_->drawn(there->matches))
        return ProfilePlace{there->matches.x, *std::move(drawn)};
      const double fallen = walk->at_place(walk->start())->value - there->value;
      return ProfilePlace{there->matches.x, {surface_->here() - fallen, {}}};
    };
    found.intervals = find_intervals(profile, *found.local, box_, near_bound);
  }

  // Where a number is near 0, goes to where the evidence without it is greatest, if it is not less.
  bool vanishes_likelier(std::vector<char>& tried) {
    for (Index g = 0; g < cohort_.count(); ++g) {
      const VectorXd& x = surface_->x();
      const double least = box_.least[g];
      if (tried[at(g)] != 0 || !cohort_.open()[at(g)].is_variance() || x[g] <= least) continue;
      const MatrixXd covariance = surface_->local().slope.information.inverse();
      if (x[g] - least > kMayVanish * std::sqrt(covariance(g, g))) continue;
      tried[at(g)] = 1;
      Box held = box_;
      held.least[g] = held.most[g] = least;
      EvidenceSurface there = *surface_;
      const VectorXd likeliest = x + covariance.col(g) * ((least - x[g]) / covariance(g, g));
      if (!there.go_to(held.clipped(likeliest), kFarBehind) && !there.go_to(held.clipped(x), kFarBehind)) continue;
      there.measure();
      const EvidenceSurface::Promise best = there.greatest(1, held);
      if (best.gain > kAtMaximum) there.go_to(best.x);
      if (there.here() < surface_->here()) continue;
      surface_ = std::move(there);
      return true;
    }
    return false;
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
  const Matches* also_ = nullptr;
  Index held_ = -1;                         // where a number is
  std::optional<EvidenceSurface> surface_;  // about the matches that were found
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

}  // namespace pulson::compare
