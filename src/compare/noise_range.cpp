#include "noise_range.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include "evidence_surface.hpp"
#include "held_number.hpp"
#include "number_search.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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
constexpr int kBetween = 16;             // of shares between two places
constexpr double kShareStep = 1e-3;      // of x, for slopes of shares

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

  Evidence operator()(double place, const Matches& matches) {
    greatest_ = std::max(greatest_, matches.log_evidence);
    if (!by_draws_ || matches.log_evidence < greatest_ - kHopelesslyBelow) return {matches.log_evidence, {}};
    const auto known = known_.find(place);
    if (known != known_.end() && known->second.laplace == matches.log_evidence) return known->second.by_draws;
    const std::optional<Evidence> found = evidence_by_draws(cohort_, matches);
    if (!found) {
      by_draws_ = false;
      return {matches.log_evidence, {}};
    }
    known_[place] = {matches.log_evidence, *found};
    return *found;
  }

 private:
  struct Both {
    double laplace = 0;
    Evidence by_draws;
  };
  const CohortModel& cohort_;
  bool by_draws_ = true;
  double greatest_ = -std::numeric_limits<double>::infinity();
  std::map<double, Both> known_;
};

}  // namespace

double noise_share(const CohortModel& cohort, const VectorXd& x) {
  const posterior::Specimen::Model model = cohort.model(x);
  const auto at_rest = posterior::linear_at_rest(cohort.fullest(), model);
  const posterior::LinearAt linear(*at_rest, model);
  const double of_momenta = linear.momentum_share(), of_noise = linear.noise_share();
  const auto data = static_cast<double>(cohort.fullest().coordinates());
  return of_noise + of_momenta > kDetectable * data ? of_noise / (of_noise + of_momenta) : 0;
}

namespace {

// How many kinds of variance explain what varies at CohortModel::start().
auto variances(const CohortModel& cohort) {
  return std::count_if(cohort.open().begin(), cohort.open().end(),
                       [](const ModelNumber& number) { return number.is_variance(); });
}

// The walk along one amplitude, all other numbers where the evidence is greatest, to where that has fallen by kFall.
class UpperEnd {
 public:
  UpperEnd(const CohortModel& cohort, Index amplitude, const Matches& about)
      : cohort_(cohort), amplitude_(amplitude), held_(cohort, amplitude, about), of_matches_(cohort) {}

  void see(NoiseRange& range) {
    visit_levels();
    cut();
    std::sort(places_.begin(), places_.end());
    range.greatest_share = std::max({range.greatest_share, share_within(), share_at(low_), share_at(high_)});
    add_places(range.places);
  }

 private:
  static constexpr double kNothing = -std::numeric_limits<double>::infinity();

  // Levels of noise as long as evidence allows.
  void visit_levels() {
    places_ = {held_.start()};
    const double all = static_cast<double>(variances(cohort_)) * std::expm1(cohort_.start()[amplitude_]);
    for (double part = kFirstPart;; part *= kNextPart) {
      const double place = std::log1p(part * all);
      if (place <= held_.start()) continue;
      if (place > cohort_.box().most[amplitude_]) break;
      places_.push_back(place);
      held_.visit(place);
      // From the start alone, where the kernel may be as narrow as noise makes it, a better fit is not found.
      if (std::optional<Matches> anew = find_matches_at(cohort_, amplitude_, place))
        held_.offer(place, *std::move(anew));
      const HeldNumber::Place* found = held_.at_place(place);
      if (found == nullptr || found->value < held_.at_place(held_.start())->value - kHopelesslyBelow) break;
    }
    const auto last = std::find_if(places_.rbegin(), places_.rend(), [&](double p) { return fall(p) <= kFall; });
    low_ = *last;
    high_ = last == places_.rbegin() ? low_ : *std::prev(last);
  }

  void cut() {
    double step = kStep;  // of the logarithm of the variance, from the end that moved towards the other
    bool low_moved = false;
    for (int count = 0; count < kMostCuts && !is_found(); ++count) {
      double middle = crossing(low_, fall(low_), high_, fall(high_));
      if (count > 0) middle = low_moved ? std::max(middle, moved(low_, step)) : std::min(middle, moved(high_, -step));
      middle = std::clamp(middle, low_ + kLeastPart * (high_ - low_), high_ - kLeastPart * (high_ - low_));
      held_.visit(middle);
      places_.push_back(middle);
      const bool allowed = fall(middle) <= kFall;
      step = count > 0 && allowed == low_moved ? 2 * step : kStep;
      low_moved = allowed;
      (allowed ? low_ : high_) = middle;
    }
  }

  // The end is not that of a place where all is otherwise, and the share less than before.
  bool is_found() const {
    const double share = share_at(low_), next = share_at(high_);
    return next >= share ? next <= kShareRatio * share + kNoShare : std::expm1(high_) <= kShareRatio * std::expm1(low_);
  }

  Evidence evidence(double place) {
    const HeldNumber::Place* found = held_.at_place(place);
    return found == nullptr ? Evidence{kNothing, {}} : of_matches_(place, found->matches);
  }
  // Below the greatest.
  double fall(double place) {
    const Evidence here = evidence(place);
    Evidence best = here;
    for (const double other : places_)
      if (Evidence there = evidence(other); there.value > best.value) best = std::move(there);
    return fall_between(best, here);
  }
  double share_at(double place) const {
    const HeldNumber::Place* found = held_.at_place(place);
    return found == nullptr ? 1 : noise_share(cohort_, found->matches.x);
  }

  // What is known of a place: log(share/(1 − share)), its variance by the other numbers there, and √fall.
  struct Known {
    double place, odds, variance, root;
  };

  // The share is of the other numbers, too: at each amplitude these may be where the evidence has fallen by the rest,
  // f, so that the logarithm of its odds is √(2fv) greater, v its variance by them. (Of 119 cohorts of a model linear
  // at rest, 20 ovals of 12 landmarks, ends without that hold for 86 %, with it for 92 %.)
  double share_within() {
    std::vector<Known> all;
    for (const double place : places_) {
      const HeldNumber::Place* found = held_.at_place(place);
      if (found == nullptr || !std::isfinite(fall(place))) continue;
      const double share = share_at(place);
      if (!(share > 0 && share < 1)) continue;
      all.push_back({place, std::log(share / (1 - share)), variance_of_odds(found->matches), std::sqrt(fall(place))});
    }
    double greatest = 0;
    const auto see = [&](const Known& known) {
      const double rest = kFall - known.root * known.root;
      if (rest >= 0)
        greatest = std::max(greatest, 1 / (1 + std::exp(-known.odds - std::sqrt(2 * rest * known.variance))));
    };
    for (std::size_t i = 0; i < all.size(); ++i) {
      see(all[i]);
      // Between places all that is nearly linear in them.
      for (int k = 1; i + 1 < all.size() && k < kBetween; ++k) {
        const double t = static_cast<double>(k) / kBetween;
        const auto at = [&](double Known::*of) { return (1 - t) * (all[i].*of) + t * (all[i + 1].*of); };
        see({at(&Known::place), at(&Known::odds), at(&Known::variance), at(&Known::root)});
      }
    }
    return greatest;
  }

  // Those known that an interval of 90 % has, and about where it ends between them.
  void add_places(std::vector<VectorXd>& places) {
    const VectorXd* before = nullptr;
    double root_before = 0;
    const double end = std::sqrt(kDropOfNinety);
    for (const double place : places_) {
      const HeldNumber::Place* found = held_.at_place(place);
      if (found == nullptr) continue;
      const VectorXd& x = found->matches.x;
      const double root = std::sqrt(std::max(fall(place), 0.0));
      if (before != nullptr && std::isfinite(root) && (root <= end) != (root_before <= end))
        places.emplace_back(*before + (x - *before) * ((end - root_before) / (root - root_before)));
      if (root <= end) places.push_back(x);
      before = std::isfinite(root) ? &x : nullptr;
      root_before = root;
    }
  }

  double variance_of_odds(const Matches& matches) const {
    const auto odds = [&](const VectorXd& x) {
      const double share = noise_share(cohort_, x);
      return std::log(share / (1 - share));
    };
    std::vector<Index> free;
    VectorXd slope = VectorXd::Zero(cohort_.count());
    const double here = odds(matches.x);
    for (Index i = 0; i < cohort_.count(); ++i) {
      if (i == amplitude_) continue;
      free.push_back(i);
      const double more = odds(matches.x + kShareStep * VectorXd::Unit(cohort_.count(), i));
      if (std::isfinite(more)) slope[i] = (more - here) / kShareStep;
    }
    if (free.empty()) return 0;
    const MatrixXd information = cohort_.linear_evidence(matches, matches.x).information;
    const MatrixXd metric = metric_of(information(free, free));
    const VectorXd of_free = slope(free);
    return of_free.dot(metric.llt().solve(of_free));
  }

  const CohortModel& cohort_;
  Index amplitude_;
  HeldNumber held_;
  EvidenceOfMatches of_matches_;
  std::vector<double> places_;
  double low_ = 0, high_ = 0;
};

}  // namespace

NoiseRange noise_range(const CohortModel& cohort, const Matches& about) {
  NoiseRange range;
  for (Index g = 0; g < cohort.count(); ++g)
    if (cohort.open()[at(g)].kind == ModelNumber::Kind::kAmplitude) UpperEnd(cohort, g, about).see(range);
  return range;
}

}  // namespace pulson::compare
