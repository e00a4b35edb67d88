#include "held_number.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "pulson/core/errors.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
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
}

void HeldNumber::visit(double place) {
  if (known_.contains(place)) return;
  const auto above = known_.upper_bound(place);
  std::optional<Matches> best;
  for (const bool is_above : {true, false}) {
    if (is_above ? above == known_.end() : above == known_.begin()) continue;
    std::optional<Matches> there = from(place, is_above ? above->second.matches : std::prev(above)->second.matches);
    if (there && (!best || there->log_evidence > best->log_evidence)) best = std::move(there);
  }
  if (!best) return;
  const auto here = keep(place, *std::move(best));
  for (auto near = here; std::next(near) != known_.end() && improve(std::next(near), near->second.matches);) ++near;
  for (auto near = here; near != known_.begin() && improve(std::prev(near), near->second.matches);) --near;
}

const HeldNumber::Place* HeldNumber::at_place(double place) const {
  const auto found = known_.find(place);
  return found == known_.end() ? nullptr : &found->second;
}

HeldNumber::Known::iterator HeldNumber::keep(double place, Matches matches) {
  VectorXd shapes(cohort_.shapes());
  for (Index s = 0; s < shapes.size(); ++s)
    shapes[s] = posterior::LinearAt(*matches.minima[at(s)].linear, matches.model).log_evidence();
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

// @return whether what comes from there gains what matters
bool HeldNumber::improve(Known::iterator place, const Matches& near) {
  std::optional<Matches> other = from(place->first, near);
  if (!other || !(other->log_evidence > place->second.matches.log_evidence + kGain)) return false;
  keep(place->first, *std::move(other));
  return true;
}

// Numbers and matches in turn, of which the best is kept.
Matches HeldNumber::settled(double place, Matches best) const {
  Box box = cohort_.box();
  box.least[held_] = box.most[held_] = place;
  for (int turn = 0; turn < kTurnsAtPlace; ++turn) try {
      const VectorXd there =
          matching::maximise_by_newton([&](const VectorXd& x) { return cohort_.linear_value(best, x); },
                                       [&](const VectorXd& x) { return cohort_.linear_evidence(best, x); }, box,
                                       box.clipped(best.x))
              .x;
      Matches next = cohort_.match(there, &best, CohortModel::Effort::kRough);
      const double gain = next.log_evidence - best.log_evidence;
      if (gain > 0) best = std::move(next);
      if (gain < kGain) break;
    } catch (const NumericalError&) {
      break;  // what was found stands
    }
  return best;
}

}  // namespace pulson::compare
