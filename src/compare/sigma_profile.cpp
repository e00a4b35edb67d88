// What the verdict would be if σ were another.

#include "pulson/compare/sigma_profile.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "compare/held_number.hpp"
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
constexpr int kFewestPlaces = 5, kMostPlaces = 9;  // a factor of √2 apart, where that is not too many
constexpr double kBorder = 1.05;                   // how closely it is shown where the verdict changes

bool is_none(const ComparedModel& model) { return model.noise == "none"; }

// A model of which σ is a number.
class Walk {
 public:
  Walk(const Comparison& comparison, const NoiseChoice& noise, const ComparedModel& compared, double middle)
      : settings_(settings_about(comparison, middle)),
        model_(comparison.cohort, make_open_noise(noise, comparison.cohort.source), settings_),
        numbers_(model_, model_.count() - 1,
                 model_.match(place_of(compared.fit), nullptr, CohortModel::Effort::kExact),  // σ is the last
                 CohortModel::Effort::kExact),
        shift_(compared.score - numbers_.at_place(numbers_.start())->matches.log_evidence),
        of_fit_(compared.fit.log_evidences()) {}

  void visit(double sigma) { numbers_.visit(place(sigma)); }
  void visit_all(const VectorXd& rising) {
    numbers_.visit_all(rising.unaryExpr([&](double sigma) { return place(sigma); }));
  }

  // The score, and the evidence of each shape; NaN where some shape has no path.
  double score(double sigma) const {
    const HeldNumber::Place* found = numbers_.at_place(place(sigma));
    return found == nullptr ? text::kMissing : shift_ + found->matches.log_evidence;
  }
  VectorXd shapes(double sigma) const {
    const HeldNumber::Place* found = numbers_.at_place(place(sigma));
    if (found == nullptr) return VectorXd::Constant(model_.shapes(), text::kMissing);
    return of_fit_ + (found->shapes - numbers_.at_place(numbers_.start())->shapes);
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

  double place(double sigma) const { return model_.open().back().place(sigma); }
  VectorXd place_of(const CohortFit& fit) const {
    std::vector<double> values;
    for (const ModelNumber& number : model_.open()) {
      const auto found = std::find_if(fit.fitted.begin(), fit.fitted.end(),
                                      [&](const FittedNumber& fitted) { return fitted.name == number.name; });
      values.push_back(found != fit.fitted.end() ? found->value : fit.sigma);
    }
    VectorXd x = model_.place(values);
    x[x.size() - 1] = place(values.back());  // wherever it is: it is held
    return x;
  }

  CohortSettings settings_;
  CohortModel model_;
  HeldNumber numbers_;
  double shift_;     // from Laplace's evidence to the score
  VectorXd of_fit_;  // evidences of the shapes, by draws
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

SigmaProfile profile_at(const std::vector<double>& sigmas, const Comparison& comparison,
                        const std::vector<std::optional<Walk>>& walks, const Limit& limit) {
  const auto count = std::ssize(sigmas), models = std::ssize(walks), shapes = std::ssize(comparison.cohort.targets);
  SigmaProfile profile{.sigma = Eigen::Map<const VectorXd>(sigmas.data(), count),
                       .scores = MatrixXd::Constant(count, models, text::kMissing),
                       .shapes = std::vector<MatrixXd>(at(count), MatrixXd::Constant(shapes, models, text::kMissing))};
  for (Index k = 0; k < count; ++k) {
    auto scores = profile.scores.row(k);
    MatrixXd& evidence = profile.shapes[at(k)];
    for (Index m = 0; m < models; ++m)
      if (const std::optional<Walk>& walk = walks[at(m)]) {
        scores[m] = walk->score(sigmas[at(k)]);
        evidence.col(m) = walk->shapes(sigmas[at(k)]);
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
    if (!is_none(comparison.models[at(m)])) continue;
    range.has_noise = false;
    range.is_favoured = !is_none(comparison.models[at(best)]);
  }
  range.low = range.high = profile.sigma[k];
  return range;
}

bool are_same(const SigmaProfile::Range& a, const SigmaProfile::Range& b) {
  return a.has_noise == b.has_noise && (a.has_noise ? a.models == b.models : a.is_favoured == b.is_favoured);
}

}  // namespace

SigmaProfile profile_sigma(const Comparison& comparison, const std::vector<NoiseChoice>& noises) {
  const SerialBlas serial;
  const auto start = std::chrono::steady_clock::now();
  const VectorXd places = places_of(comparison);
  const double middle = std::sqrt(places[0] * places[places.size() - 1]);
  std::vector<double> sigmas(places.begin(), places.end());
  std::vector<std::optional<Walk>> walks(noises.size());
  parallel_for(static_cast<int>(noises.size()), [&](int i) {
    const std::size_t m = at(i);
    const ComparedModel& model = comparison.models[m];
    if (!std::isfinite(model.score)) return;
    try {
      walks[m].emplace(comparison, noises[m], model, middle);
      walks[m]->visit_all(places);
    } catch (const NumericalError&) {
      walks[m].reset();  // it has no evidence
    }
  });
  const Limit limit = limit_of(comparison, noises);
  SigmaProfile profile = profile_at(sigmas, comparison, walks, limit);
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
    parallel_for(static_cast<int>(walks.size()), [&](int m) {
      if (walks[at(m)]) walks[at(m)]->visit(sigma);
    });
    sigmas.insert(sigmas.begin() + k + 1, sigma);
    profile = profile_at(sigmas, comparison, walks, limit);
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
