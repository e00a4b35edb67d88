#include "noise_range.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "held_number.hpp"
#include "number_search.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using posterior::LinearAt;

// Variance of the end points, in units of σ², below which neither momenta nor noise show: of numbers that vanish it is
// 6 millionths each.
constexpr double kDetectable = 100 * kNegligible;

constexpr double kFall = 0.8212;  // ½·1.2816², of a one-sided interval of 90 %
// Of what varies, which noise explains at places that are searched, as long as evidence allows: the first and their
// ratio.
constexpr double kFirstPart = 0.1, kNextPart = 3;
constexpr double kHopelesslyBelow = 10;  // nats: a maximum behind such a gap is not looked for
constexpr double kShareRatio = 1.1;      // to which the share is found, from above,
constexpr double kNoShare = 1e-3;        // or to this
constexpr double kStep = 0.07;           // of the logarithm of the variance: less than that ratio
constexpr int kMostCuts = 12;            // of the part where it may be,
constexpr double kLeastPart = 1e-3;      // each of so much at least

// Between two places, where the evidence has fallen by that if it falls as the square of the place, which it nearly
// does.
double crossing(double low, double fall_low, double high, double fall_high) {
  if (!std::isfinite(fall_high)) return (low + high) / 2;
  const double begin = std::sqrt(fall_low), end = std::sqrt(fall_high);
  return low + (high - low) * (std::sqrt(kFall) - begin) / (end - begin);
}

// The place of e^step times the variance.
double moved(double place, double step) { return std::log1p(std::exp(step) * std::expm1(place)); }

// The evidence of matches by draws as far as these determine it at all places that are asked for, else Laplace's. The
// latter falls as noise rises where that of draws does not (10 shapes of 6 landmarks, noise of 9 σ: −0.18 and +0.12
// nats), so that ends by it are too low: they held for 81 of 100 such cohorts.
class EvidenceOfMatches {
 public:
  explicit EvidenceOfMatches(const CohortModel& cohort) : cohort_(cohort) {}

  double operator()(double place, const Matches& matches) {
    greatest_ = std::max(greatest_, matches.log_evidence);
    if (!by_draws_ || matches.log_evidence < greatest_ - kHopelesslyBelow) return matches.log_evidence;
    const auto known = known_.find(place);
    if (known != known_.end() && known->second.laplace == matches.log_evidence) return known->second.by_draws;
    const std::optional<double> found = evidence_by_draws(cohort_, matches);
    if (!found) {
      by_draws_ = false;
      return matches.log_evidence;
    }
    known_[place] = {matches.log_evidence, *found};
    return *found;
  }

 private:
  struct Both {
    double laplace = 0, by_draws = 0;
  };
  const CohortModel& cohort_;
  bool by_draws_ = true;
  double greatest_ = -std::numeric_limits<double>::infinity();
  std::map<double, Both> known_;
};

// How many kinds of variance explain what varies at CohortModel::start().
auto variances(const CohortModel& cohort) {
  return std::count_if(cohort.open().begin(), cohort.open().end(),
                       [](const ModelNumber& number) { return number.is_variance(); });
}

}  // namespace

double noise_share(const CohortModel& cohort, const Matches& about, const VectorXd& x) {
  const posterior::Specimen::Model model = cohort.model(x);
  double of_momenta = 0, of_noise = 0;
  Index data = 0;
  for (int s = 0; s < cohort.shapes(); ++s) {
    const LinearAt linear(*about.minima[at(s)].linear, model);
    of_momenta += linear.momentum_share();
    of_noise += linear.noise_share();
    data += cohort.specimen(s).coordinates();
  }
  return of_noise + of_momenta > kDetectable * static_cast<double>(data) ? of_noise / (of_noise + of_momenta) : 0;
}

double greatest_noise_share(const CohortModel& cohort, const Matches& about) {
  double greatest = 0;
  for (Index g = 0; g < cohort.count(); ++g) {
    if (cohort.open()[at(g)].kind != ModelNumber::Kind::kAmplitude) continue;
    HeldNumber held(cohort, g, about);
    EvidenceOfMatches of_matches(cohort);
    std::vector<double> places{held.start()};
    const double all = static_cast<double>(variances(cohort)) * std::expm1(cohort.start()[g]);
    for (double part = kFirstPart;; part *= kNextPart) {
      const double place = std::log1p(part * all);
      if (place <= held.start()) continue;
      if (place > cohort.box().most[g]) break;
      places.push_back(place);
      held.visit(place);
      // From the start alone, where the kernel may be as narrow as noise makes it, a better fit is not found.
      if (std::optional<Matches> anew = find_matches_at(cohort, g, place)) held.offer(place, *std::move(anew));
      const HeldNumber::Place* found = held.at_place(place);
      const double of_start = held.at_place(held.start())->matches.log_evidence;
      if (found == nullptr || found->matches.log_evidence < of_start - kHopelesslyBelow) break;
    }
    const auto evidence = [&](double place) {
      const HeldNumber::Place* found = held.at_place(place);
      return found == nullptr ? -std::numeric_limits<double>::infinity() : of_matches(place, found->matches);
    };
    const auto fall = [&](double place) {
      double best = evidence(place);
      for (const double other : places) best = std::max(best, evidence(other));
      return best - evidence(place);
    };
    const auto is_allowed = [&](double place) { return fall(place) <= kFall; };
    const auto share_at = [&](double place) {
      const HeldNumber::Place* found = held.at_place(place);
      return found == nullptr ? 1 : noise_share(cohort, found->matches, found->matches.x);
    };
    const auto last = std::find_if(places.rbegin(), places.rend(), is_allowed);
    double low = *last, high = last == places.rbegin() ? low : *std::prev(last);
    double step = kStep;  // of the logarithm of the variance, from the end that moved towards the other
    bool low_moved = false;
    // The end is not that of a place where all is otherwise, and the share less than before.
    const auto is_found = [&](double below, double above) {
      const double share = share_at(below), next = share_at(above);
      return next >= share ? next <= kShareRatio * share + kNoShare
                           : std::expm1(above) <= kShareRatio * std::expm1(below);
    };
    for (int cut = 0; cut < kMostCuts && !is_found(low, high); ++cut) {
      double middle = crossing(low, fall(low), high, fall(high));
      if (cut > 0) middle = low_moved ? std::max(middle, moved(low, step)) : std::min(middle, moved(high, -step));
      middle = std::clamp(middle, low + kLeastPart * (high - low), high - kLeastPart * (high - low));
      held.visit(middle);
      places.push_back(middle);
      const bool allowed = is_allowed(middle);
      step = cut > 0 && allowed == low_moved ? 2 * step : kStep;
      low_moved = allowed;
      (allowed ? low : high) = middle;
    }
    greatest = std::max({greatest, share_at(low), share_at(high)});
  }
  return greatest;
}

}  // namespace pulson::compare
