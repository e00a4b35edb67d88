// What the verdict would be if σ were another.

#include "pulson/compare/sigma_profile.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "compare/cohort_model.hpp"
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
constexpr int kMostTurnsAtSigma = 3;                   // of numbers and matches at one σ
constexpr auto kEffort = CohortModel::Effort::kRough;  // to 0.01 nat a shape, far below what decides
constexpr int kBorderCuts = 20;                        // halvings between two places: to 1e-6

bool is_none(const ComparedModel& model) { return model.noise == "none"; }

// A model of which σ is a number, with the matches at one place.
class Walk {
 public:
  Walk(const Comparison& comparison, const NoiseChoice& noise, const CohortFit& fit, double middle)
      : settings_(settings_about(comparison, middle)),
        model_(comparison.cohort, make_open_noise(noise, comparison.cohort.source), settings_) {
    std::vector<double> values;
    for (const ModelNumber& number : model_.open()) {
      const auto found = std::find_if(fit.fitted.begin(), fit.fitted.end(),
                                      [&](const FittedNumber& fitted) { return fitted.name == number.name; });
      values.push_back(found != fit.fitted.end() ? found->value : fit.sigma);
    }
    start_ = model_.place(values);
    held_ = model_.count() - 1;
    about_ = settled(start_[held_], model_.match(start_, nullptr, kEffort));
    at_fit_ = about_->log_evidence;
  }

  // At σ = middle·e^place, from the matches at a neighbour. @throws NumericalError where some shape has no path
  Matches at(double place, const Matches& near) const {
    VectorXd x = near.x;
    x[held_] = place;
    return settled(place, model_.match(model_.box().clipped(x), &near, kEffort));
  }

  const Matches& about() const { return *about_; }
  double at_fit() const { return at_fit_; }

 private:
  static CohortSettings settings_about(const Comparison& comparison, double middle) {
    CohortSettings settings = comparison.settings;
    settings.sigma = middle;
    settings.fit_sigma = true;
    settings.importance_samples = 0;
    settings.on_match = {};
    return settings;
  }

  // Numbers and matches in turn, of which the best is kept.
  Matches settled(double place, Matches best) const {
    Box box = model_.box();
    box.least[held_] = box.most[held_] = place;
    for (int turn = 0; turn < kMostTurnsAtSigma; ++turn) try {
        const VectorXd there =
            maximise_by_newton([&](const VectorXd& x) { return model_.linear_value(best, x); },
                               [&](const VectorXd& x) { return model_.linear_evidence(best, x); }, box, best.x)
                .x;
        Matches next = model_.match(there, &best, kEffort);
        const double gain = next.log_evidence - best.log_evidence;
        if (gain > 0) best = std::move(next);
        constexpr double kGain = 0.05;  // nats: far below what decides
        if (gain < kGain) break;
      } catch (const NumericalError&) {
        break;  // what was found stands
      }
    return best;
  }

  CohortSettings settings_;
  CohortModel model_;
  VectorXd start_;
  Index held_ = 0;  // σ is the last number
  std::optional<Matches> about_;
  double at_fit_ = 0;
};

double error_of_difference(const CohortFit& a, const CohortFit& b) {
  VectorXd differences(std::ssize(a.shapes));
  for (Index s = 0; s < differences.size(); ++s)
    differences[s] = a.shapes[at(s)].log_evidence - b.shapes[at(s)].log_evidence;
  return std::sqrt(static_cast<double>(differences.size())) * standard_deviation(differences);
}

// From half the least to twice the greatest σ of the models that the fits do not distinguish, evenly in log σ.
VectorXd places_of(const Comparison& comparison) {
  const ComparedModel& best = comparison.models[comparison.best];
  double low = best.fit.sigma, high = best.fit.sigma;
  for (const ComparedModel& model : comparison.models) {
    if (!std::isfinite(model.score) || is_decisive(best.score - model.score, error_of_difference(model.fit, best.fit)))
      continue;
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

}  // namespace

SigmaProfile profile_sigma(const Comparison& comparison, const std::vector<NoiseChoice>& noises) {
  const SerialBlas serial;
  const auto start = std::chrono::steady_clock::now();
  const double middle = comparison.models[comparison.best].fit.sigma;
  SigmaProfile profile;
  profile.sigma = places_of(comparison);
  const auto count = static_cast<int>(profile.sigma.size());
  const VectorXd places = (profile.sigma / middle).array().log();
  profile.scores = MatrixXd::Constant(count, std::ssize(noises), text::kMissing);
  for (std::size_t m = 0; m < noises.size(); ++m) try {
      const ComparedModel& model = comparison.models[m];
      if (!std::isfinite(model.score)) continue;
      const Walk walk(comparison, noises[m], model.fit, middle);
      int nearest = 0;
      (places.array() - std::log(model.fit.sigma / middle)).abs().minCoeff(&nearest);
      const auto note = [&](int k, const Matches& there) {
        double& score = profile.scores(k, static_cast<Index>(m));
        const double found = model.score + there.log_evidence - walk.at_fit();
        if (!(score >= found)) score = found;
      };
      // Outwards on either side; without noise, which is the limit of others, back as well, to the better maximum.
      for (const int direction : {1, -1}) {
        std::vector<Matches> passed{walk.about()};
        for (int k = direction > 0 ? nearest : nearest - 1; k >= 0 && k < count; k += direction) {
          passed.push_back(walk.at(places[k], passed.back()));
          note(k, passed.back());
        }
        if (!is_none(model) || passed.size() < 3) continue;
        Matches back = passed.back();
        int k = direction > 0 ? count - 1 : 0;
        for (std::size_t left = passed.size() - 2; left > 0; --left) {
          k -= direction;
          back = walk.at(places[k], back);
          note(k, back);
        }
      }
    } catch (const NumericalError&) {
      // no evidence from there on
    }
  // A noise may vanish: its evidence is no less than without it.
  const auto none = std::find_if(comparison.models.begin(), comparison.models.end(), is_none);
  for (std::size_t m = 0; none != comparison.models.end() && m < noises.size(); ++m) {
    const CohortFit& fit = comparison.models[m].fit;
    if (make_open_noise(noises[m], comparison.cohort.source).open.empty()) continue;
    const double price = 0.5 * static_cast<double>(fit.fitted.size() - none->fit.fitted.size()) *
                         std::log(static_cast<double>(fit.shapes.size()));
    for (Index k = 0; k < count; ++k) {
      const double limit = profile.scores(k, none - comparison.models.begin()) - price;
      double& score = profile.scores(k, static_cast<Index>(m));
      if (std::isfinite(limit) && !(score >= limit)) score = limit;
    }
  }
  profile.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return profile;
}

std::vector<SigmaProfile::Range> SigmaProfile::ranges(const Comparison& comparison) const {
  const auto at_place = [&](const VectorXd& here) {
    Range range;
    Index best = -1;
    for (Index m = 0; m < here.size(); ++m)
      if (std::isfinite(here[m]) && (best < 0 || here[m] > here[best])) best = m;
    for (Index m = 0; best >= 0 && m < here.size(); ++m) {
      const ComparedModel& model = comparison.models[at(m)];
      const double error = m == best ? 0 : error_of_difference(model.fit, comparison.models[at(best)].fit);
      if (!std::isfinite(here[m]) || is_decisive(here[best] - here[m], error)) continue;
      range.models.push_back(at(m));
      if (is_none(model)) range.has_noise = false;
    }
    return range;
  };
  const auto same = [](const Range& a, const Range& b) {
    return a.has_noise == b.has_noise && (!a.has_noise || a.models == b.models);
  };
  std::vector<Range> found;
  for (Index k = 0; k < sigma.size(); ++k) {
    Range here = at_place(scores.row(k).transpose());
    here.low = here.high = sigma[k];
    if (here.models.empty()) continue;
    if (!found.empty() && same(found.back(), here)) {
      found.back().high = sigma[k];
      continue;
    }
    if (!found.empty() && k > 0) {
      double below = 0, above = 1;
      for (int cut = 0; cut < kBorderCuts; ++cut) {
        const double part = (below + above) / 2;
        const Range there = at_place(((1 - part) * scores.row(k - 1) + part * scores.row(k)).transpose());
        (same(there, found.back()) ? below : above) = part;
      }
      here.low = found.back().high = sigma[k - 1] * std::pow(sigma[k] / sigma[k - 1], above);
    }
    found.push_back(here);
  }
  return found;
}

}  // namespace pulson::compare
