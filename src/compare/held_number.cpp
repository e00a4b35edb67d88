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

constexpr double kGain = 0.05;  // nats: far below what decides

}  // namespace

HeldNumber::HeldNumber(const CohortModel& cohort, Index held, Matches about, CohortModel::Effort effort)
    : cohort_(cohort), held_(held), effort_(effort), start_(about.x[held]) {
  Correction correction = correction_about(cohort, about, box_at(start_), effort_);
  keep(start_, settled(std::move(about), std::move(correction)));
}

HeldNumber::HeldNumber(const CohortModel& cohort, Index held, Matches about, Correction correction, AddedByDraws added)
    : cohort_(cohort), held_(held), added_(std::move(added)), start_(about.x[held]) {
  keep(start_, settled(std::move(about), std::move(correction)));
}

Box HeldNumber::box_at(double place) const {
  Box box = cohort_.box();
  box.least[held_] = box.most[held_] = place;
  return box;
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
    Promise promise;
    const Place* near;
    bool is_above;
  };
  std::vector<Side> sides;
  const auto above = known_.upper_bound(place);
  const auto add = [&](Known::const_iterator side, bool is_above) {
    sides.push_back({promise(place, side->second), &side->second, is_above});
  };
  if (above != known_.begin()) add(std::prev(above), false);
  if (above != known_.end()) add(above, true);
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.promise.value > b.promise.value; });
  std::optional<Place> best;
  bool by_above = false;
  for (const Side& side : sides) {
    if (best && side.promise.value <= best->value) continue;
    std::optional<Place> found = from(*side.near, side.promise);
    if (!found || (best && found->value <= best->value)) continue;
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

HeldNumber::Promise HeldNumber::promise(double place, const Place& near) const {
  const matching::NewtonMaximum there =
      greatest_corrected(cohort_, near.matches, near.correction, added_, box_at(place));
  return {there.x, there.about.value};
}

// Nothing where some shape has no path.
std::optional<HeldNumber::Place> HeldNumber::from(const Place& near, const Promise& to) const try {
  Correction correction = near.correction;
  correction.move_to(to.x);
  return settled(cohort_.match(to.x, &near.matches, effort_), std::move(correction));
} catch (const NumericalError&) {
  return std::nullopt;
}

// @return whether what comes from there gains what matters
bool HeldNumber::improve(Known::iterator place, const Place& near) {
  const Promise promise = this->promise(place->first, near);
  if (!(promise.value > place->second.value + kGain)) return false;
  std::optional<Place> other = from(near, promise);
  if (!other || !(other->value > place->second.value + kGain)) return false;
  keep(place->first, *std::move(other));
  return true;
}

HeldNumber::Place HeldNumber::settled(Matches best, Correction correction) const {
  turn_by_turn(cohort_, best, correction, added_, box_at(best.x[held_]), effort_);
  VectorXd shapes(cohort_.shapes());
  for (Index s = 0; s < shapes.size(); ++s)
    shapes[s] = posterior::LinearAt(*best.minima[at(s)].linear, best.model).laplace();
  const double value = best.log_evidence + added_.value(best.x);
  return {std::move(best), std::move(shapes), std::move(correction), value};
}

}  // namespace pulson::compare
