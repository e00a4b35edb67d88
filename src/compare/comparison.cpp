#include "pulson/compare/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/core.h>

#include "compared_model.hpp"
#include "core/undefined.hpp"
#include "fit.hpp"
#include "notes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/diagnostics.hpp"
#include "recognition.hpp"
#include "sampled.hpp"
#include "sampled_evidence.hpp"
#include "statistics.hpp"
#include "step_error.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the steps, nats: of two cohorts of 12 ovals in 1, 2, 3, 5 and 10 steps, corrections up to 2.3 left at most 0.3 and
// those from 3.5 on more than a third of themselves.
constexpr double kMostCorrected = 2;
constexpr int kMostTimes = 8;          // as many steps are advised: errors of second order are then 64 times smaller
constexpr double kSameEvidence = 0.1;  // nats that two evidences may differ by, beside their errors, without a note

MatrixXd complete_targets(const Cohort& cohort) {
  MatrixXd ends(cohort.source.points.size(), std::ssize(cohort.targets));
  Index count = 0;
  for (const Landmarks& target : cohort.targets)
    if (target.points.allFinite()) ends.col(count++) = target.points.reshaped();
  return ends.leftCols(count);
}

// Where the samples of a shape do not tell its evidence in some model, that of all is Laplace's approximation, so that
// no model is above another by the kind of its evidence. @return whether of all shapes
bool take_the_same_evidence(std::vector<ComparedModel>& models) {
  bool all = true;
  for (std::size_t s = 0; s < models.front().fit.shapes.size(); ++s) {
    if (std::all_of(models.begin(), models.end(), [s](const auto& model) { return is_sampled(model.fit.shapes[s]); })) {
      all = false;
      continue;
    }
    for (ComparedModel& model : models) {
      ShapeFit& shape = model.fit.shapes[s];
      model.fit.log_evidence += shape.laplace - shape.log_evidence;
      shape.log_evidence = shape.laplace;
      shape.variance = 0;
      shape.log_sets.resize(0);
    }
  }
  for (ComparedModel& model : models) {
    double variance = 0;
    for (const ShapeFit& shape : model.fit.shapes) variance += shape.variance;
    model.fit.sampling_error = std::sqrt(variance);
    model.score = model.fit.score();
  }
  return all;
}

// The evidence of Markov chains, unless these find no path for some shape.
bool with_sampled_evidence(Comparison& comparison) {
  auto& models = comparison.models;
  for (ComparedModel& model : models) {
    model.fit.sampled = sample_evidence(comparison.cohort, model.fit, comparison.settings);
    if (!std::isfinite(model.fit.sampled->total.value)) {
      comparison.notes.push_back(
          fmt::format("{}: the evidence of some shape by Markov chains is undetermined, so models are not ranked by it",
                      model.noise));
      for (ComparedModel& other : models) other.fit.sampled.reset();
      return false;
    }
  }
  for (ComparedModel& model : models) {
    CohortFit& fit = model.fit;
    const SampledEvidence& sampled = *fit.sampled;
    const bool is_laplace = without_samples(model) > 0;
    const double before = is_laplace ? fit.laplace : fit.log_evidence;
    const double error = std::hypot(sampled.total.standard_error, is_laplace ? 0 : fit.sampling_error);
    if (std::abs(sampled.total.value - before) > 2 * error + kSameEvidence)
      comparison.notes.push_back(
          fmt::format("{}: log evidence {:.2f} ± {:.2f} by Markov chains, {:.2f} by {}, with which its numbers were "
                      "fitted: these may "
                      "be off",
                      model.noise, sampled.total.value, sampled.total.standard_error, before,
                      is_laplace ? "Laplace's approximation" : "importance samples"));
    if (!(sampled.worst_rhat <= inference::kHighRhatOfShort))
      comparison.notes.push_back(fmt::format(
          "{}: the chains of some shape have not converged (R-hat {}), its evidence is uncertain", model.noise,
          std::isnan(sampled.worst_rhat) ? "is undefined" : fmt::format("{:.2f}", sampled.worst_rhat)));
    fit.log_evidence = sampled.total.value;
    fit.sampling_error = sampled.total.standard_error;
    for (std::size_t s = 0; s < fit.shapes.size(); ++s) {
      fit.shapes[s].log_evidence = sampled.shapes[s].value;
      fit.shapes[s].variance = std::pow(sampled.shapes[s].standard_error, 2);
    }
    model.score = fit.score();
  }
  return true;
}

// A model whose evidence is no number is behind all others, and its fit did not converge.
void put_undetermined_last(Comparison& comparison) {
  for (ComparedModel& model : comparison.models) {
    if (std::isfinite(model.score)) continue;
    model.score = -std::numeric_limits<double>::infinity();
    model.fit.converged = false;
  }
}

void rank(Comparison& comparison) {
  auto& models = comparison.models;
  put_undetermined_last(comparison);
  const auto best =
      std::max_element(models.begin(), models.end(), [](const auto& a, const auto& b) { return a.score < b.score; });
  if (!std::isfinite(best->score))
    throw NumericalError(
        "the evidence of no model is a finite number, so models cannot be ranked; use more `grid.steps`, or a sigma "
        "nearer to the distances between the shapes");
  comparison.best = static_cast<std::size_t>(best - models.begin());
  double sum = 0;
  for (const ComparedModel& model : models) sum += std::exp(model.score - best->score);
  for (ComparedModel& model : models) {
    model.weight = std::exp(model.score - best->score) / sum;
    model.difference = {model.score - best->score, error_of_sum(model.fit.log_evidences() - best->fit.log_evidences())};
  }
}

// All evidences or none, so that no model is above another by its steps.
void take_the_limit_of_steps(Comparison& comparison, const std::vector<NoiseChoice>& noises) {
  std::vector<StepChange> changes;
  std::string undetermined;
  for (std::size_t m = 0; m < noises.size(); ++m) {
    const ComparedModel& model = comparison.models[m];
    changes.push_back(change_of_finer_steps(comparison.cohort, noises[m], comparison.settings, model.fit));
    if (std::isfinite(model.score) && !std::isfinite(changes.back().total.value)) undetermined = model.noise;
  }
  for (std::size_t m = 0; m < noises.size(); ++m) {
    ComparedModel& model = comparison.models[m];
    if (undetermined.empty())
      correct_for_steps(changes[m], comparison.settings, model.fit);
    else
      model.fit.step_error = {kUndefined, kUndefined};
    model.score = model.fit.score();
  }
  if (!undetermined.empty())
    comparison.notes.push_back(
        fmt::format("{}: what twice as many steps would change is not determined, so the evidences are those of {} "
                    "steps; use more `grid.steps`",
                    undetermined, comparison.settings.grid.steps));
}

// Of no noise against each model that has it as its limit: at the limit twice the gain is 0 in half of all cohorts, and
// χ² of one degree in the others.
void test_against_none(Comparison& comparison, const std::vector<NoiseChoice>& noises, const CompareOptions& options) {
  auto& models = comparison.models;
  const auto none = std::find_if(models.begin(), models.end(), [](const auto& m) { return m.noise == "none"; });
  if (none == models.end()) return;
  std::vector<RecoveryRow> drawn;
  if (options.bootstrap > 0) {
    RecoveryOptions study;
    study.settings = options.settings;
    study.cohorts = options.bootstrap;
    study.shapes = static_cast<int>(comparison.cohort.targets.size());
    study.seed = options.settings.seed;
    study.alignment = comparison.cohort.alignment;
    study.about_own_mean = comparison.cohort.about_own_mean;
    drawn = study_recovery(comparison.cohort.source, {{"none", none->fit.lambda, none->fit.kernel, none->fit.sigma}},
                           noises, study);
  }
  const auto place = static_cast<std::size_t>(none - models.begin());
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (models[i].fit.fitted.size() <= none->fit.fitted.size()) continue;
    const double gain = models[i].fit.log_evidence - none->fit.log_evidence;
    if (!std::isfinite(gain)) continue;
    models[i].p_value = gain > 0 && !models[i].fit.noise_vanishes() ? 0.5 * std::erfc(std::sqrt(gain)) : 1;
    if (drawn.empty()) continue;
    const double of_steps = models[i].fit.step_error.value - none->fit.step_error.value;
    const double of_these_steps = gain - (std::isfinite(of_steps) ? of_steps : 0);  // as of the cohorts drawn
    int greater = 0;
    int fitted = 0;
    for (const std::vector<RecoveredFit>& fits : drawn.front().fits) {
      const double by_chance = fits[i].log_evidence - fits[place].log_evidence;
      if (!std::isfinite(by_chance)) continue;
      ++fitted;
      if (by_chance >= of_these_steps) ++greater;
    }
    models[i].p_value = (1.0 + greater) / (1.0 + fitted);
    models[i].bootstrapped = fitted;
  }
}

// The best model, and the others where it does not explain the shapes.
void check_models(Comparison& comparison, const CohortShapes& shapes) {
  const auto check = [&](ComparedModel& model) {
    try {
      model.checks = check_predictions(shapes, comparison.cohort, model.fit, comparison.settings);
    } catch (const NumericalError& error) {
      comparison.notes.push_back(fmt::format("{}: not checked: {}", model.noise, error.what()));
    }
  };
  ComparedModel& best = comparison.models[comparison.best];
  check(best);
  if (!best.checks || best.checks->unexplained().empty()) return;
  for (ComparedModel& model : comparison.models)
    if (&model != &best && std::isfinite(model.score)) check(model);
}

}  // namespace

bool ComparedModel::is_behind() const { return is_decisive(-difference.value, difference.standard_error); }

double Comparison::step_error(const ComparedModel& model) const {
  const double of_difference = model.fit.step_error.value - models[best].fit.step_error.value;
  return &model == &models[best] ? 0 : of_difference;
}

std::optional<int> Comparison::steps_wanted() const {
  if (cohort.targets.size() == 1) return std::nullopt;  // of which the evidence does not judge
  int wanted = settings.grid.steps;
  for (const ComparedModel& model : models) {
    if (!std::isfinite(model.score)) continue;
    int enough = settings.grid.steps;
    for (double error = std::abs(model.fit.step_error.value);
         error > kMostCorrected && enough < kMostTimes * settings.grid.steps; error /= 4)
      enough *= 2;
    wanted = std::max(wanted, enough);
    if (&model == &models[best]) continue;
    const double ahead = -model.difference.value;
    // Of order 1 in place of 2 the limit would be twice the change away, half as far again.
    double left = std::abs(step_error(model)) / 2;
    if (std::isnan(left)) return 2 * settings.grid.steps;
    const auto may_change = [&] {
      const double error = model.difference.standard_error;
      return left > 0 && (left >= ahead || is_decisive(ahead - left, error) != is_decisive(ahead + left, error));
    };
    int steps = settings.grid.steps;
    for (; may_change() && steps < kMostTimes * settings.grid.steps; left /= 4) steps *= 2;
    wanted = std::max(wanted, steps);
  }
  return wanted > settings.grid.steps ? std::optional(wanted) : std::nullopt;
}

Comparison compare_models(const CohortShapes& shapes, const std::vector<NoiseChoice>& noises,
                          const CompareOptions& options) {
  const SerialBlas serial;
  if (noises.empty()) throw InputError("no noise model is named; a comparison needs at least one");
  Comparison comparison{shapes.cohort(), options.settings, {}, 0, {}, {}, {}, {}};
  const Points& source = comparison.cohort.source.points;
  comparison.settings.kernel = options.settings.kernel.make(source).spec();
  comparison.settings.sigma = options.settings.sigma.in(diameter(source));
  CompareOptions same = options;
  same.settings = comparison.settings;
  const KernelBasis basis = kernel_basis(comparison.settings.kernel, source);
  comparison.eigenvalues = basis.eigenvalues;
  std::tie(comparison.observed, comparison.observed_error) =
      spectrum_of(basis, source, complete_targets(comparison.cohort));
  const auto is_none = [](const NoiseChoice& noise) { return noise.spec() == "none"; };
  const auto first_none = std::find_if(noises.begin(), noises.end(), is_none) - noises.begin();
  comparison.models.resize(noises.size());
  std::vector<std::string> failures(noises.size());
  const CohortFit* none = nullptr;
  const auto fit = [&](std::size_t m) {
    if (options.on_model) options.on_model(static_cast<int>(m), noises[m].spec());
    comparison.models[m] = compared_model(comparison, shapes, basis, noises[m], same, none, failures[m]);
  };
  // Without noise first, as the others begin there, too.
  if (first_none < std::ssize(noises)) {
    fit(static_cast<std::size_t>(first_none));
    none = &comparison.models[static_cast<std::size_t>(first_none)].fit;
  }
  parallel_for(static_cast<int>(noises.size()), [&](int m) {
    if (m != first_none) fit(static_cast<std::size_t>(m));
  });
  for (const std::string& failure : failures)
    if (!failure.empty()) comparison.notes.push_back(failure);
  const bool sampled = options.sampled_evidence && with_sampled_evidence(comparison);
  if (!sampled && take_the_same_evidence(comparison.models)) same.settings.importance_samples = 0;
  take_the_limit_of_steps(comparison, noises);
  rank(comparison);
  test_against_none(comparison, noises, same);
  if (options.checks && std::ssize(shapes.targets) >= kFewestToJudge) {
    check_models(comparison, shapes);
    if (noises.size() > 1) comparison.profile = profile_sigma(comparison, noises);
    const std::vector<std::optional<Recognition>> recognitions = find_recognitions(comparison, noises);
    for (std::size_t m = 0; m < recognitions.size(); ++m) comparison.models[m].recognition = recognitions[m];
  }
  add_notes(comparison, options);
  return comparison;
}

}  // namespace pulson::compare
