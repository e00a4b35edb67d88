#include "held_number.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "number_search.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTurnsAtPlace = 3;  // of numbers and matches
constexpr double kGain = 0.05;    // nats: far below what decides

}  // namespace

HeldNumber::HeldNumber(const CohortModel& cohort, Index held, Matches about)
    : cohort_(cohort), held_(held), start_(about.x[held]) {
  Matches best = settled(start_, std::move(about));
  keep(start_, std::move(best));
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
  const auto here = keep(place, std::move(matches));
  carry_down(here);
  carry_up(here);
}

void HeldNumber::visit(double place) {
  if (known_.contains(place)) return;
  struct Side {
    double promise;
    const Matches* near;
    bool is_above;
  };
  std::vector<Side> sides;
  const auto above = known_.upper_bound(place);
  const auto add = [&](Known::const_iterator side, bool is_above) {
    const Matches& near = side->second.matches;
    sides.push_back({promise(place, near), &near, is_above});
  };
  if (above != known_.begin()) add(std::prev(above), false);
  if (above != known_.end()) add(above, true);
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.promise > b.promise; });
  std::optional<Matches> best;
  bool by_above = false;
  for (const Side& side : sides) {
    if (best && side.promise <= best->log_evidence) continue;
    std::optional<Matches> found = from(place, *side.near);
    if (!found || (best && found->log_evidence <= best->log_evidence)) continue;
    best = std::move(found);
    by_above = side.is_above;
  }
  if (!best) return;
  const auto here = keep(place, *std::move(best));
  by_above ? carry_down(here) : carry_up(here);
}

void HeldNumber::carry_up(Known::iterator from_here) {
  for (auto next = std::next(from_here); next != known_.end() && improve(next, from_here->second.matches); ++next)
    from_here = next;
}

void HeldNumber::carry_down(Known::iterator from_here) {
  while (from_here != known_.begin() && improve(std::prev(from_here), from_here->second.matches)) --from_here;
}

const HeldNumber::Place* HeldNumber::at_place(double place) const {
  const auto found = known_.find(place);
  return found == known_.end() ? nullptr : &found->second;
}

HeldNumber::Known::iterator HeldNumber::keep(double place, Matches matches) {
  VectorXd shapes(cohort_.shapes());
  for (Index s = 0; s < shapes.size(); ++s)
    shapes[s] = posterior::LinearAt(*matches.minima[at(s)].linear, matches.model).laplace();
  return known_.insert_or_assign(place, Place{std::move(matches), std::move(shapes)}).first;
}

// Nothing where some shape has no path.
std::optional<Matches> HeldNumber::from(double place, const Matches& near) const try {
  VectorXd x = near.x;
  x[held_] = place;
  return settled(place, cohort_.match(cohort_.box().clipped(x), &near, CohortModel::Effort::kRough));
} catch (const NumericalError&) {
  return std::nullopt;
}

double HeldNumber::promise(double place, const Matches& near) const {
  VectorXd x = near.x;
  x[held_] = place;
  return cohort_.linear_value(near, cohort_.box().clipped(x));
}

// @return whether what comes from there gains what matters
bool HeldNumber::improve(Known::iterator place, const Matches& near) {
  if (!(promise(place->first, near) > place->second.matches.log_evidence + kGain)) return false;
  std::optional<Matches> other = from(place->first, near);
  if (!other || !(other->log_evidence > place->second.matches.log_evidence + kGain)) return false;
  keep(place->first, *std::move(other));
  return true;
}

// Numbers and matches in turn, of which the best is kept. Where the linear models do not keep what they promise, as
// where data hardly determine σ, by differences of the evidence.
Matches HeldNumber::settled(double place, Matches best) const {
  Box box = cohort_.box();
  box.least[held_] = box.most[held_] = place;
  for (int turn = 0; turn < kTurnsAtPlace; ++turn) try {
      const auto there = matching::maximise_by_newton(
          [&](const VectorXd& x) { return cohort_.linear_value(best, x); },
          [&](const VectorXd& x) { return cohort_.linear_evidence(best, x); }, box, box.clipped(best.x));
      if (there.about.value - best.log_evidence < kGain) break;
      Matches next = cohort_.match(there.x, &best, CohortModel::Effort::kRough);
      const double gain = next.log_evidence - best.log_evidence;
      if (gain < 0) return by_differences(best, box);
      best = std::move(next);
      if (gain < kGain) break;
    } catch (const NumericalError&) {
      break;  // what was found stands
    }
  return best;
}

Matches HeldNumber::by_differences(const Matches& from, const matching::Box& box) const {
  std::optional<Matches> last;
  const auto evidence = [&](const VectorXd& x) -> std::optional<Evidence> {
    try {
      last = cohort_.match(x, &from, CohortModel::Effort::kRough);
      return Evidence{last->log_evidence, {}};
    } catch (const NumericalError&) {
      return std::nullopt;
    }
  };
  const MatrixXd metric = metric_of(cohort_.linear_evidence(from, from.x).information);
  Matches best = from;
  const auto gradient = [&](const VectorXd& /*x*/, const MatrixXd& information) -> std::optional<VectorXd> {
    if (last->log_evidence > best.log_evidence) best = *last;
    try {
      return cohort_.gradient(*last, information, box);
    } catch (const NumericalError&) {
      return std::nullopt;
    }
  };
  maximise_evidence(evidence, gradient, from.x, metric, box);
  return best;
}

}  // namespace pulson::compare
