// What the verdict would be if σ were another.

#include "pulson/compare/sigma_profile.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "compare/cohort_model.hpp"
#include "compare/newton.hpp"
#include "compare/open_noise.hpp"
#include "compare/statistics.hpp"
#include "core/text.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFactor = 2;    // of σ beyond the fits
constexpr double kWidest = 256;  // the last place over the first: for noise in place of σ, which is ever less
constexpr int kFewestPlaces = 5, kMostPlaces = 9;      // a factor of √2 apart, where that is not too many
constexpr double kBorder = 1.05;                       // how closely it is shown where the verdict changes
constexpr int kMostTurnsAtSigma = 3;                   // of numbers and matches at one σ
constexpr double kGain = 0.05;                         // nats: far below what decides
constexpr auto kEffort = CohortModel::Effort::kRough;  // to 0.01 nat a shape, far below what decides

bool is_none(const ComparedModel& model) { return model.noise == "none"; }

// A model of which σ is a number, at places log(σ/middle).
class Walk {
 public:
  Walk(const Comparison& comparison, const NoiseChoice& noise, const ComparedModel& compared, double middle)
      : score_(compared.score),
        settings_(settings_about(comparison, middle)),
        model_(comparison.cohort, make_open_noise(noise, comparison.cohort.source), settings_) {
    const CohortFit& fit = compared.fit;
    std::vector<double> values;
    for (const ModelNumber& number : model_.open()) {
      const auto found = std::find_if(fit.fitted.begin(), fit.fitted.end(),
                                      [&](const FittedNumber& fitted) { return fitted.name == number.name; });
      values.push_back(found != fit.fitted.end() ? found->value : fit.sigma);
    }
    const VectorXd start = model_.place(values);
    held_ = model_.count() - 1;
    fit_place_ = start[held_];
    Matches about = settled(fit_place_, model_.match(start, nullptr, kEffort));
    shift_ = score_ - about.log_evidence;
    keep(known_.begin(), fit_place_, std::move(about));
  }

  // Outwards from the fit on either side.
  void pass(const VectorXd& places) {
    const auto middle = std::lower_bound(places.begin(), places.end(), fit_place_);
    std::for_each(middle, places.end(), [&](double place) { visit(place); });
    std::for_each(std::make_reverse_iterator(middle), std::make_reverse_iterator(places.begin()),
                  [&](double place) { visit(place); });
  }

  // From the matches of the known places on either side, the better of the two; and back, place by place, as far as
  // that is better there, too.
  void visit(double place) {
    if (known_.contains(place)) return;  // the fit's
    const auto above = known_.upper_bound(place);
    std::optional<Matches> best;
    for (const bool is_above : {true, false}) {
      if (is_above ? above == known_.end() : above == known_.begin()) continue;
      std::optional<Matches> there = from(place, is_above ? above->second.matches : std::prev(above)->second.matches);
      if (there && (!best || there->log_evidence > best->log_evidence)) best = std::move(there);
    }
    if (!best) return;
    const auto here = keep(above, place, *std::move(best));
    for (auto near = here; std::next(near) != known_.end() && improve(std::next(near), near->second.matches);) ++near;
    for (auto near = here; near != known_.begin() && improve(std::prev(near), near->second.matches);) --near;
  }

  // The score, and the evidence of each shape; NaN where some shape has no path.
  double score(double place) const {
    const auto found = known_.find(place);
    return found == known_.end() ? text::kMissing : shift_ + found->second.matches.log_evidence;
  }
  VectorXd shapes(double place) const {
    const auto found = known_.find(place);
    return found == known_.end() ? VectorXd::Constant(model_.shapes(), text::kMissing) : found->second.shapes;
  }

 private:
  static CohortSettings settings_about(const Comparison& comparison, double middle) {
    CohortSettings settings = comparison.settings;
    settings.sigma = middle;
    settings.fit_sigma = true;
    settings.importance_samples = 0;
    settings.on_match = {};
    return settings;
  }

  struct Known {
    Matches matches;
    VectorXd shapes;  // their evidence
  };
  using Place = std::map<double, Known>::iterator;

  Place keep(Place hint, double place, Matches matches) {
    VectorXd shapes(model_.shapes());
    for (Index s = 0; s < shapes.size(); ++s)
      shapes[s] = posterior::LinearAt(*matches.minima[at(s)].linear, matches.model).log_evidence();
    const Place kept = known_.insert_or_assign(hint, place, Known{std::move(matches), std::move(shapes)});
    return kept;
  }

  // Nothing where some shape has no path.
  std::optional<Matches> from(double place, const Matches& near) const try {
    VectorXd x = near.x;
    x[held_] = place;
    return settled(place, model_.match(model_.box().clipped(x), &near, kEffort));
  } catch (const NumericalError&) {
    return std::nullopt;
  }

  // @return whether what comes from there gains what matters
  bool improve(Place place, const Matches& near) {
    std::optional<Matches> other = from(place->first, near);
    if (!other || !(other->log_evidence > place->second.matches.log_evidence + kGain)) return false;
    keep(place, place->first, *std::move(other));
    return true;
  }

  // Numbers and matches in turn, of which the best is kept.
  Matches settled(double place, Matches best) const {
    Box box = model_.box();
    box.least[held_] = box.most[held_] = place;
    for (int turn = 0; turn < kMostTurnsAtSigma; ++turn) try {
        const BoxMaximum there = maximise_in_box(
            [&](const VectorXd& x) { return model_.linear_value(best, x); },
            [&](const VectorXd& x) { return model_.linear_evidence(best, x).slope; }, box, box.clipped(best.x));
        Matches next = model_.match(there.x, &best, kEffort);
        const double gain = next.log_evidence - best.log_evidence;
        if (gain > 0) best = std::move(next);
        if (gain < kGain) break;
      } catch (const NumericalError&) {
        break;  // what was found stands
      }
    return best;
  }

  double score_;  // of the fit
  CohortSettings settings_;
  CohortModel model_;
  Index held_ = 0;  // σ is the last number
  double fit_place_ = 0;
  double shift_ = 0;  // from Laplace's evidence to the score
  std::map<double, Known> known_;
};

// From half the least to twice the greatest σ of the models that the fits do not distinguish, evenly in log σ.
VectorXd places_of(const Comparison& comparison) {
  const ComparedModel& best = comparison.models[comparison.best];
  double low = best.fit.sigma, high = best.fit.sigma;
  for (const ComparedModel& model : comparison.models) {
    if (!std::isfinite(model.score) || model.is_behind()) continue;
    low = std::min(low, model.fit.sigma);
    high = std::max(high, model.fit.sigma);
  }
  high *= kFactor;
  low = std::max(low / kFactor, high / kWidest);
  const double width = std::log(high / low);
  const int places =
      std::clamp(1 + static_cast<int>(std::lround(2 * width / std::log(2.0))), kFewestPlaces, kMostPlaces);
  return VectorXd::LinSpaced(places, std::log(low), std::log(high)).array().exp();
}

// What a model's noise may at least reach: it may vanish, and its evidence is then that without it.
struct Limit {
  Index none = -1;
  VectorXd price;  // of each model's further numbers, nats; NaN where its noise cannot vanish
};

Limit limit_of(const Comparison& comparison, const std::vector<NoiseChoice>& noises) {
  Limit limit{-1, VectorXd::Constant(std::ssize(noises), text::kMissing)};
  const auto none = std::find_if(comparison.models.begin(), comparison.models.end(), is_none);
  if (none == comparison.models.end()) return limit;
  limit.none = none - comparison.models.begin();
  for (std::size_t m = 0; m < noises.size(); ++m) {
    const CohortFit& fit = comparison.models[m].fit;
    if (!make_open_noise(noises[m], comparison.cohort.source).open.empty())
      limit.price[static_cast<Index>(m)] = 0.5 * static_cast<double>(fit.fitted.size() - none->fit.fitted.size()) *
                                           std::log(static_cast<double>(fit.shapes.size()));
  }
  return limit;
}

SigmaProfile profile_at(const std::vector<double>& sigmas, double middle, const Comparison& comparison,
                        const std::vector<std::optional<Walk>>& walks, const Limit& limit) {
  const auto count = std::ssize(sigmas), models = std::ssize(walks), shapes = std::ssize(comparison.cohort.targets);
  SigmaProfile profile{.sigma = Eigen::Map<const VectorXd>(sigmas.data(), count),
                       .scores = MatrixXd::Constant(count, models, text::kMissing),
                       .shapes = std::vector<MatrixXd>(at(count), MatrixXd::Constant(shapes, models, text::kMissing))};
  for (Index k = 0; k < count; ++k) {
    auto scores = profile.scores.row(k);
    MatrixXd& evidence = profile.shapes[at(k)];
    const double place = std::log(sigmas[at(k)] / middle);
    for (Index m = 0; m < models; ++m)
      if (const std::optional<Walk>& walk = walks[at(m)]) {
        scores[m] = walk->score(place);
        evidence.col(m) = walk->shapes(place);
      }
    for (Index m = 0; limit.none >= 0 && m < models; ++m) {
      const double least = scores[limit.none] - limit.price[m];
      if (!std::isfinite(least) || scores[m] >= least) continue;
      scores[m] = least;
      evidence.col(m) = evidence.col(limit.none);
    }
  }
  return profile;
}

// Models that are not behind at a place.
SigmaProfile::Range at_place(const SigmaProfile& profile, const Comparison& comparison, Index k) {
  const VectorXd here = profile.scores.row(k);
  SigmaProfile::Range range;
  Index best = -1;
  for (Index m = 0; m < here.size(); ++m)
    if (std::isfinite(here[m]) && (best < 0 || here[m] > here[best])) best = m;
  for (Index m = 0; best >= 0 && m < here.size(); ++m) {
    const MatrixXd& evidence = profile.shapes[at(k)];
    if (!std::isfinite(here[m]) ||
        (m != best && is_decisive(here[best] - here[m], error_of_sum(evidence.col(best) - evidence.col(m)))))
      continue;
    range.models.push_back(at(m));
    if (is_none(comparison.models[at(m)])) range.has_noise = false;
  }
  range.low = range.high = profile.sigma[k];
  return range;
}

bool are_same(const SigmaProfile::Range& a, const SigmaProfile::Range& b) {
  return a.has_noise == b.has_noise && (!a.has_noise || a.models == b.models);
}

}  // namespace

SigmaProfile profile_sigma(const Comparison& comparison, const std::vector<NoiseChoice>& noises) {
  const SerialBlas serial;
  const auto start = std::chrono::steady_clock::now();
  const double middle = comparison.models[comparison.best].fit.sigma;
  const auto place_of = [&](double sigma) { return std::log(sigma / middle); };
  const VectorXd places = places_of(comparison);
  std::vector<double> sigmas(places.begin(), places.end());
  std::vector<std::optional<Walk>> walks(noises.size());
  for (std::size_t m = 0; m < noises.size(); ++m) try {
      const ComparedModel& model = comparison.models[m];
      if (!std::isfinite(model.score)) continue;
      walks[m].emplace(comparison, noises[m], model, middle);
      walks[m]->pass(places.unaryExpr(place_of));
    } catch (const NumericalError&) {
      walks[m].reset();  // it has no evidence
    }
  const Limit limit = limit_of(comparison, noises);
  SigmaProfile profile = profile_at(sigmas, middle, comparison, walks, limit);
  const auto changes_above = [&](Index k) {
    return profile.sigma[k + 1] > kBorder * profile.sigma[k] &&
           !are_same(at_place(profile, comparison, k), at_place(profile, comparison, k + 1));
  };
  for (Index k = 0; k + 1 < profile.sigma.size();) {
    if (!changes_above(k)) {
      ++k;
      continue;
    }
    const double sigma = std::sqrt(profile.sigma[k] * profile.sigma[k + 1]);
    for (std::optional<Walk>& walk : walks)
      if (walk) walk->visit(place_of(sigma));
    sigmas.insert(sigmas.begin() + k + 1, sigma);
    profile = profile_at(sigmas, middle, comparison, walks, limit);
    k = 0;  // what is found there may be better elsewhere
  }
  profile.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return profile;
}

std::vector<SigmaProfile::Range> SigmaProfile::ranges(const Comparison& comparison) const {
  std::vector<Range> found;
  for (Index k = 0; k < sigma.size(); ++k) {
    Range here = at_place(*this, comparison, k);
    if (here.models.empty()) continue;
    if (!found.empty() && are_same(found.back(), here)) {
      found.back().high = sigma[k];
      continue;
    }
    if (!found.empty()) here.low = found.back().high = std::sqrt(sigma[k - 1] * sigma[k]);
    found.push_back(here);
  }
  return found;
}

}  // namespace pulson::compare
