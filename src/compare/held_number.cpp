#include "held_number.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "evidence_surface.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTurnsAtPlace = 6;  // of numbers and matches
constexpr double kGain = 0.05;    // nats: far below what decides

}  // namespace

HeldNumber::HeldNumber(const CohortModel& cohort, Index held, Matches about)
    : cohort_(cohort), held_(held), start_(about.x[held]) {
  Correction correction = found_about(about);
  keep(start_, settled(std::move(about), std::move(correction)));
}

void HeldNumber::visit_all(const VectorXd& rising) {
  const auto middle = std::lower_bound(rising.begin(), rising.end(), start_);
  std::for_each(middle, rising.end(), [&](double place) { visit(place); });
  std::for_each(std::make_reverse_iterator(middle), std::make_reverse_iterator(rising.begin()),
                [&](double place) { visit(place); });
  carry_down(std::prev(known_.end()));
  carry_up(known_.begin());
}

void HeldNumber::offer(double place, Matches matches) {
  const Place* known = at_place(place);
  if (known != nullptr && !(matches.log_evidence > known->matches.log_evidence + kGain)) return;
  const auto above = known_.lower_bound(place);
  const Correction& near = (above == known_.end() ? std::prev(above) : above)->second.correction;
  const auto here = keep(place, settled(std::move(matches), near));
  carry_down(here);
  carry_up(here);
}

void HeldNumber::visit(double place) {
  if (known_.contains(place)) return;
  struct Side {
    double promise;
    const Place* near;
    bool is_above;
  };
  std::vector<Side> sides;
  const auto above = known_.upper_bound(place);
  const auto add = [&](Known::const_iterator side, bool is_above) {
    sides.push_back({promise(place, side->second.matches), &side->second, is_above});
  };
  if (above != known_.begin()) add(std::prev(above), false);
  if (above != known_.end()) add(above, true);
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.promise > b.promise; });
  std::optional<Place> best;
  bool by_above = false;
  for (const Side& side : sides) {
    if (best && side.promise <= best->value()) continue;
    std::optional<Place> found = from(place, *side.near);
    if (!found || (best && found->value() <= best->value())) continue;
    best = std::move(found);
    by_above = side.is_above;
  }
  if (!best) return;
  const auto here = keep(place, *std::move(best));
  by_above ? carry_down(here) : carry_up(here);
}

void HeldNumber::carry_up(Known::iterator from_here) {
  for (auto next = std::next(from_here); next != known_.end() && improve(next, from_here->second); ++next)
    from_here = next;
}

void HeldNumber::carry_down(Known::iterator from_here) {
  while (from_here != known_.begin() && improve(std::prev(from_here), from_here->second)) --from_here;
}

const HeldNumber::Place* HeldNumber::at_place(double place) const {
  const auto found = known_.find(place);
  return found == known_.end() ? nullptr : &found->second;
}

HeldNumber::Known::iterator HeldNumber::keep(double place, Place found) {
  return known_.insert_or_assign(place, std::move(found)).first;
}

matching::NewtonMaximum HeldNumber::greatest(double place, const Matches& about, const Correction& correction) const {
  const MatrixXd information = cohort_.linear_evidence(about, about.x).information + correction.bend;
  Box box = trusted_about(about.x, metric_of(information), cohort_.box());
  box.least[held_] = box.most[held_] = place;
  const CorrectedEvidence evidence(cohort_, about, correction);
  return matching::maximise_by_newton([&](const VectorXd& x) { return evidence.value(x); },
                                      [&](const VectorXd& x) { return evidence.at(x); }, box, box.clipped(about.x));
}

// Nothing where some shape has no path.
std::optional<HeldNumber::Place> HeldNumber::from(double place, const Place& near) const try {
  const VectorXd x = greatest(place, near.matches, near.correction).x;
  Correction correction = near.correction;
  correction.move_to(x);
  return settled(cohort_.match(x, &near.matches, CohortModel::Effort::kRough), std::move(correction));
} catch (const NumericalError&) {
  return std::nullopt;
}

double HeldNumber::promise(double place, const Matches& near) const {
  VectorXd x = near.x;
  x[held_] = place;
  return cohort_.linear_value(near, cohort_.box().clipped(x));
}

// @return whether what comes from there gains what matters
bool HeldNumber::improve(Known::iterator place, const Place& near) {
  if (!(promise(place->first, near.matches) > place->second.value() + kGain)) return false;
  std::optional<Place> other = from(place->first, near);
  if (!other || !(other->value() > place->second.value() + kGain)) return false;
  keep(place->first, *std::move(other));
  return true;
}

// Numbers and matches in turn, of which the best is kept. Where the evidence does not rise by what is promised, as
// where data hardly determine σ, what the linear models lack is found by differences.
HeldNumber::Place HeldNumber::settled(Matches best, Correction correction) const {
  correction.x = best.x;
  bool is_found = false;
  for (int turn = 0; turn < kTurnsAtPlace; ++turn) try {
      const matching::NewtonMaximum there = greatest(best.x[held_], best, correction);
      const double promised = there.about.value - best.log_evidence;
      if (promised < kGain) break;
      Matches next = cohort_.match(there.x, &best, CohortModel::Effort::kRough);
      const double gain = next.log_evidence - best.log_evidence;
      if (gain > 0) {
        correction.move_to(next.x);
        best = std::move(next);
      }
      if (gain > promised / 2) continue;
      if (is_found && gain <= 0) break;
      correction = found_about(best);
      is_found = true;
    } catch (const NumericalError&) {
      break;  // what was found stands
    }
  VectorXd shapes(cohort_.shapes());
  for (Index s = 0; s < shapes.size(); ++s)
    shapes[s] = posterior::LinearAt(*best.minima[at(s)].linear, best.model).laplace();
  return {std::move(best), std::move(shapes), std::move(correction)};
}

Correction HeldNumber::found_about(const Matches& matches) const {
  const auto evidence = [&](const VectorXd& x) -> std::optional<Evidence> {
    try {
      return Evidence{cohort_.match(x, &matches, CohortModel::Effort::kRough).log_evidence, {}};
    } catch (const NumericalError&) {
      return std::nullopt;
    }
  };
  Box box = cohort_.box();
  box.least[held_] = box.most[held_] = matches.x[held_];
  const MatrixXd metric = metric_of(cohort_.linear_evidence(matches, matches.x).information);
  return correction_of(cohort_, matches, evidence_about(evidence, matches.x, {matches.log_evidence, {}}, metric, box));
}

}  // namespace pulson::compare
