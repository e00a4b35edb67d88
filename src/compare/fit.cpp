// The record of a fit.

#include "fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>

#include "core/text.hpp"
#include "core/undefined.hpp"
#include "noise_range.hpp"
#include "number_search.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::Minimum;
using posterior::Specimen;

// Of logarithms of variances: a standard deviation above 3, a factor of 24, determines nothing.
constexpr double kLeastInformation = 0.1;

// Standard deviations of numbers of this information; NaN for those that it does not identify.
VectorXd deviations(const MatrixXd& information) {
  if (information.size() == 0) return {};
  constexpr double kLeastPart =
      1e-3;  // a number that is 3 % of a direction which nothing determines: rounding has less
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  VectorXd variances = VectorXd::Zero(information.rows());
  for (Index k = 0; k < variances.size(); ++k) {
    const Eigen::ArrayXd part = axes.eigenvectors().col(k).array().square();
    if (axes.eigenvalues()[k] > kLeastInformation)
      variances.array() += part / axes.eigenvalues()[k];
    else
      variances = (part > kLeastPart).select(std::numeric_limits<double>::quiet_NaN(), variances);
  }
  return variances.cwiseSqrt();
}

// Half of an interval of 90 % is 1.645 deviations, of the side that has an end where the other has none.
VectorXd with_intervals(VectorXd deviations, const VectorXd& x, const Intervals& intervals) {
  for (Index i = 0; i < std::min(intervals.low.size(), deviations.size()); ++i) {
    const double below = x[i] - intervals.low[i], above = intervals.high[i] - x[i];
    if (std::isfinite(below) && std::isfinite(above))
      deviations[i] = (below + above) / (2 * kNinety);
    else if (std::isfinite(deviations[i]) && (std::isfinite(below) || std::isfinite(above)))
      deviations[i] = (std::isfinite(below) ? below : above) / kNinety;
  }
  return deviations;
}

// Ends of intervals are NaN, or infinite, where the evidence does not fall. Deviations are NaN where the data leave a
// direction in which the number moves.
std::vector<FittedNumber> fitted_numbers(const CohortModel& cohort, const Found& found) {
  const Matches& matches = found.about;
  const VectorXd& x = found.x();
  const Index n = cohort.count();
  if (n == 0) return {};
  // Numbers that vanish are known to: what the others determine is asked of these alone.
  std::vector<Index> present;
  for (Index i = 0; i < n; ++i)
    if (!(cohort.open()[at(i)].is_variance() && x[i] < 2 * kNegligible)) present.push_back(i);
  VectorXd errors = VectorXd::Zero(n);
  MatrixXd information = cohort.linear_evidence(matches, x).information;
  if (found.local)  // linear models do not know that fields of noise have the width of the kernel, too
    information.diagonal() = information.diagonal().cwiseMax(found.local->curvatures);
  errors(present) = deviations(information(present, present));
  errors = with_intervals(std::move(errors), x, found.intervals);
  const VectorXd correlations = cohort.correlations_with_sigma(matches);
  const bool at_rest = cohort.open().front().kind == ModelNumber::Kind::kLambda && x[0] < 2 * kNegligible &&
                       cohort.noise().model->traits().linear;
  std::vector<FittedNumber> numbers;
  for (Index i = 0; i < n; ++i) {
    const ModelNumber& number = cohort.open()[at(i)];
    FittedNumber fitted{number.name, number.value(x[i]), kUndefined, false, kUndefined, kUndefined, kUndefined};
    const bool determined = found.intervals.low.size() > 0;
    const double low = determined ? found.intervals.low[i] : kUndefined,
                 high = determined ? found.intervals.high[i] : kUndefined;
    fitted.scales_noise = number.kind == ModelNumber::Kind::kAmplitude;
    if (number.is_variance()) {
      const bool is_lambda = number.kind == ModelNumber::Kind::kLambda;
      fitted.vanishes = x[i] < 2 * kNegligible;
      const double v = number.unit * std::expm1(x[i]);
      const auto end = [&](double place) {
        if (std::isnan(place)) return kUndefined;
        const double variance = number.unit * std::max(std::expm1(place), 0.0);
        return is_lambda ? 1 / variance : std::sqrt(variance);
      };
      if (!fitted.vanishes) {
        fitted.log_deviation = (is_lambda ? 1 : 0.5) * errors[i] * (1 + number.unit / v);
        fitted.correlation_with_sigma = correlations[i];
      }
      fitted.low = end(is_lambda ? high : low);
      fitted.high = end(is_lambda ? low : high);
    } else if (!(number.kind == ModelNumber::Kind::kWidth && at_rest)) {  // of no momenta any width does
      const double slope = number.kind == ModelNumber::Kind::kSigma ? 0.5 * (1 + 1 / std::expm1(x[i])) : 1;
      fitted.log_deviation = slope * errors[i];
      fitted.low = number.value(low);
      fitted.high = number.value(high);
    }
    numbers.push_back(std::move(fitted));
  }
  return numbers;
}

ShapeFit shape_fit(const CohortModel& cohort, const Matches& matches, int shape) {
  const Specimen& specimen = cohort.specimen(shape);
  const Minimum& match = matches.minima[at(shape)];
  const matching::MatchingProblem& problem = specimen.problem();
  ShapeFit fit;
  fit.momenta = specimen.momenta(matches.model, match.z);
  fit.increments = specimen.increments(0, match.z);
  const auto shot = specimen.shoot(matches.model, match.z);  // with the bits of the integrator
  fit.end =
      shot ? shot->paths.front().final().q : Points(match.end.reshaped(problem.source.rows(), problem.source.cols()));
  const VectorXd residual = specimen.residual(matches.model, fit.end.reshaped()).head(specimen.coordinates());
  const Index momenta = specimen.momentum_unknowns();
  fit.cost = {0.5 * match.z.head(momenta).squaredNorm(), 0.5 * match.z.tail(match.z.size() - momenta).squaredNorm(),
              0.5 * residual.squaredNorm()};
  const Landmarks& target = cohort.cohort().targets[at(shape)];
  const auto landmarks = static_cast<double>(target.count() - std::ssize(incomplete_points(target.points)));
  fit.rms = matches.model.sigma * problem.sigma * residual.norm() / std::sqrt(std::max(landmarks, 1.0));
  fit.log_evidence = fit.laplace = LinearAt(*match.linear, matches.model).laplace();
  fit.coordinates = static_cast<int>(specimen.coordinates());
  fit.converged = match.converged;
  try {
    fit.flow_end = problem.integrator
                       ->integrate(matches.model.system, {problem.source, fit.momenta}, problem.grid,
                                   MatrixXd::Zero(fit.increments.rows(), problem.grid.steps))
                       .final()
                       .q;
  } catch (const StepError&) {
    fit.flow_end.resize(0, 0);
  }
  return fit;
}

// The samples' evidence in place of Laplace's. @return whether enough of them are effective
bool sample(const CohortModel& cohort, const Matches& matches, int shape, ShapeFit& fit) {
  const CohortSettings& settings = cohort.settings();
  const double enough = std::pow(settings.sampling_error, 2) / static_cast<double>(cohort.shapes());
  DrawStarts starts;
  const ImportanceEstimate sampled = sample_shape(cohort, shape, matches.model, *matches.minima[at(shape)].linear,
                                                  settings.importance_samples, enough, starts);
  if (std::isfinite(sampled.log_evidence)) fit.log_evidence = sampled.log_evidence;
  fit.variance = sampled.variance;
  const DistantEvidence distant = sample_distant(cohort, shape, matches, sampled.samples);
  if (distant.part > 0) {
    const double near = std::exp(fit.log_evidence - fit.laplace);
    const double sum = near + distant.part;
    fit.distant = distant.part / sum;
    fit.log_evidence += std::log(sum / near);
    fit.variance = (near * near * fit.variance + distant.variance) / (sum * sum);
  }
  fit.log_sets = sampled.log_sets;
  fit.samples = sampled.samples;
  fit.effective_samples = sampled.effective_samples;
  fit.lost_samples = sampled.lost;
  return are_enough(sampled.effective_samples, sampled.samples);
}

CohortFit record(const CohortModel& cohort, const Found& found) {
  const Matches& matches = found.about;
  const posterior::Numbers numbers = cohort.numbers(matches.x);
  CohortFit fit;
  fit.kernel = numbers.kernel->spec();
  fit.noise = numbers.noise->spec();
  if (cohort.noise().is_own) fit.own_noise = numbers.noise;
  fit.lambda = numbers.lambda;
  fit.sigma = numbers.sigma * cohort.specimen(0).problem().sigma;
  fit.fitted = fitted_numbers(cohort, found);
  fit.laplace = matches.log_evidence;
  fit.converged = found.converged && matches.all_converged();
  const int shapes = cohort.shapes();
  fit.shapes.resize(at(shapes));
  parallel_for(shapes, [&](int s) { fit.shapes[at(s)] = shape_fit(cohort, matches, s); });
  bool enough = cohort.settings().importance_samples > 0;
  for (int first = 0; first < shapes && enough;
       first += kShapesAtOnce) {  // the rest is not drawn where none of these has enough
    const int some = std::min(kShapesAtOnce, shapes - first);
    std::vector<char> are_enough(at(some));
    parallel_for(some, [&](int i) {
      are_enough[at(i)] = sample(cohort, matches, first + i, fit.shapes[at(first + i)]) ? 1 : 0;
    });
    enough = std::count(are_enough.begin(), are_enough.end(), 1) > 0;
  }
  fit.log_evidence = fit.of_own_mean = cohort.of_own_mean(matches.x);
  for (int s = 0; s < shapes; ++s) {
    const ShapeFit& shape = fit.shapes[at(s)];
    fit.coordinates += shape.coordinates;
    fit.log_evidence += shape.log_evidence;
    fit.sampling_error = std::hypot(fit.sampling_error, std::sqrt(shape.variance));
    if (shape.samples > 0) fit.effective_part = std::min(fit.effective_part, shape.effective_samples / shape.samples);
  }
  fit.noise_share = fit.greatest_noise_share = noise_share(cohort, matches.x);
  return fit;
}

std::vector<const ShapeFit*> pointers_to(const std::vector<ShapeFit>& shapes) {
  std::vector<const ShapeFit*> pointers;
  for (const ShapeFit& shape : shapes) pointers.push_back(&shape);
  return pointers;
}

// A fit that noise does not improve: that of `none`, with the upper ends of the amplitudes.
// @param matches at the place without noise
CohortFit without_noise(const CohortModel& cohort, const Matches& matches, CohortFit fit, const CohortFit& none) {
  const VectorXd& x = matches.x;
  const posterior::Numbers numbers = cohort.numbers(x);
  std::vector<FittedNumber> fitted = std::move(fit.fitted);
  const VectorXd correlations = cohort.correlations_with_sigma(matches);
  const MatrixXd at_rest = MatrixXd::Zero(fit.shapes.front().increments.rows(), fit.shapes.front().increments.cols());
  fit = none;
  fit.noise = numbers.noise->spec();
  if (cohort.noise().is_own) fit.own_noise = numbers.noise;
  for (ShapeFit& shape : fit.shapes) shape.increments = at_rest;
  for (Index i = 0; i < cohort.count(); ++i) {
    FittedNumber& number = fitted[at(i)];
    const auto same = std::find_if(none.fitted.begin(), none.fitted.end(),
                                   [&](const FittedNumber& other) { return other.name == number.name; });
    if (same != none.fitted.end()) {
      number = *same;
      continue;
    }
    const bool is_amplitude = cohort.open()[at(i)].is_variance();
    number.value = cohort.open()[at(i)].value(x[i]);
    number.log_deviation = kUndefined;
    number.correlation_with_sigma = is_amplitude ? correlations[i] : kUndefined;
    number.vanishes = is_amplitude;
    number.low = is_amplitude ? 0 : kUndefined;
    if (!is_amplitude) number.high = kUndefined;
  }
  fit.fitted = std::move(fitted);
  return fit;
}

// With more noise other numbers are likely than with less: their intervals have those, too.
void widen(FittedNumber& number, double value) {
  if (value >= number.low && value <= number.high) return;
  const double before = std::log(number.high / number.low);
  number.low = std::min(number.low, value);
  number.high = std::max(number.high, value);
  const double now = std::log(number.high / number.low);
  if (before > 0 && std::isfinite(now)) number.log_deviation *= now / before;
}

}  // namespace

CohortFit fit_model(const CohortModel& cohort, const CohortFit* none) {
  if (none != nullptr && !std::isfinite(none->log_evidence)) none = nullptr;
  std::optional<Matches> no_noise;
  if (none != nullptr)
    no_noise = cohort.match_from(cohort.place_without_noise(none->fitted), pointers_to(none->shapes),
                                 CohortModel::Effort::kThorough);
  Found found = find_numbers(cohort, no_noise ? &*no_noise : nullptr);
  CohortFit fit = record(cohort, found);
  // By draws a gain of less is none.
  const double least_gain = found.sampled ? kAtMaximum : 0;
  if (no_noise && (fit.noise_vanishes() || !(fit.log_evidence > none->log_evidence + least_gain))) {
    found.about = *std::move(no_noise);
    fit = without_noise(cohort, found.about, std::move(fit), *none);
  }
  if (!cohort.settings().upper_ends) return fit;
  const NoiseRange range = noise_range(cohort, found.about);
  fit.greatest_noise_share = std::max(fit.noise_share, range.greatest_share);
  for (const VectorXd& x : range.places)
    for (Index i = 0; i < cohort.count(); ++i) widen(fit.fitted[at(i)], cohort.open()[at(i)].value(x[i]));
  return fit;
}

CohortFit fit_roughly(const CohortModel& cohort) {
  Found found = find_numbers_roughly(cohort);
  found.converged = found.about.all_converged();
  return record(cohort, found);
}

CohortFit fit_again(const CohortModel& cohort, const CohortFit& before, const std::vector<int>& shapes) {
  std::vector<double> values;
  for (const ModelNumber& number : cohort.open())
    values.push_back(std::find_if(before.fitted.begin(), before.fitted.end(), [&](const FittedNumber& fitted) {
                       return fitted.name == number.name;
                     })->value);
  std::vector<const ShapeFit*> near;
  for (const int s : shapes) near.push_back(&before.shapes[at(s)]);
  Found found = find_numbers_near(cohort, cohort.match_from(cohort.place(values), near, CohortModel::Effort::kExact));
  found.converged = found.about.all_converged();
  return record(cohort, found);
}

}  // namespace pulson::compare
