#include "summary.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "compare/facts.hpp"
#include "pulson/core/name_table.hpp"
#include "sentences.hpp"
#include "shell/messages.hpp"
#include "shell/probability_text.hpp"

namespace pulson {
namespace {

std::string nothing_to_tell(const compare::Comparison& comparison) {
  if (!comparison.settings.fit_sigma) return "these shapes do not differ beyond sigma, and say nothing of any model";
  return fmt::format(
      "these shapes say nothing of any model: independent variation of landmarks, sigma {:.3g}, explains all",
      comparison.models[comparison.best].fit.sigma);
}

// By the root mean square of the coordinates that are observed.
bool differ_beyond_sigma(const compare::Comparison& comparison) {
  const double sigma = comparison.models[comparison.best].fit.sigma;
  double square = 0, count = 0;
  for (const Landmarks& target : comparison.cohort.targets)
    for (const double off : (target.points - comparison.cohort.source.points).reshaped())
      if (!std::isnan(off)) {
        square += off / sigma * (off / sigma);
        ++count;
      }
  return square >= count;
}

// Without noise, or with noise that the fit sets to zero.
bool is_geodesic(const compare::CohortFit& fit) { return fit.noise == "none" || fit.noise_vanishes(); }

// Where σ is fitted, too, a noise of the same effect is a part of it.
bool is_part_of_sigma(const compare::Comparison& comparison, const compare::CohortFit& fit) {
  return comparison.settings.fit_sigma &&
         std::any_of(fit.fitted.begin(), fit.fitted.end(), [](const compare::FittedNumber& number) {
           return number.acts_as_sigma() && number.correlation_with_sigma > 0;
         });
}

// Shapes that would show that noise has less than `share`: the error of a variance falls as their number's root.
std::string shapes_needed(std::size_t shapes, double greatest, double share) {
  const double needed = static_cast<double>(shapes) * std::pow(greatest / share, 2);
  const double digit = std::pow(10, std::floor(std::log10(needed)));
  return fmt::format("{:.0f}", std::ceil(needed / digit) * digit);
}

std::string of_variance(double share) {
  return share < 0.1 ? fmt::format("{:.2g} % of the variance", 100 * share)
                     : fmt::format("{:.0f} % of the variance", 100 * share);
}

// Its kind, or all of its specification where another model is of that kind.
std::string noise_name(const compare::Comparison& comparison, const compare::ComparedModel& model) {
  const auto kind = [](const compare::ComparedModel& of) { return of.noise.substr(0, of.noise.find(':')); };
  const auto alike = std::count_if(comparison.models.begin(), comparison.models.end(),
                                   [&](const auto& other) { return kind(other) == kind(model); });
  return alike > 1 ? shortened_spec(model.noise) : kind(model);
}

// By the upper ends of the noises' shares of the variance.
std::string verdict_of_geodesic(const compare::Comparison& comparison) {
  constexpr double kEnough = 0.1;
  std::vector<std::string> as_sigma, excluded;
  double greatest = 0, greatest_excluded = 0;
  std::string widest;
  for (const compare::ComparedModel& model : comparison.models) {
    if (model.noise == "none") continue;
    const std::string name = noise_name(comparison, model);
    const double share = model.fit.greatest_noise_share;
    if (is_part_of_sigma(comparison, model.fit)) {
      as_sigma.push_back(name);
      continue;
    }
    if (share <= kEnough) {
      excluded.push_back(name);
      greatest_excluded = std::max(greatest_excluded, share);
    }
    if (widest.empty() || share > greatest) widest = name;
    greatest = std::max(greatest, share);
  }
  const std::string hidden = as_sigma.empty()
                                 ? ""
                                 : fmt::format("{} {} the effect of sigma, which is fitted", joined_words(as_sigma),
                                               as_sigma.size() > 1 ? "have" : "has");
  if (widest.empty() && !hidden.empty())
    return fmt::format("no noise is found, but {}; a measured sigma would show it", hidden);
  const std::string but = hidden.empty() ? "" : ", but " + hidden;
  if (greatest == 0) return "the geodesic is enough: no noise model explains these shapes better" + but;
  if (greatest <= kEnough)
    return fmt::format("the geodesic is enough: noise has at most {} ({}){}", of_variance(greatest), widest, but);
  const std::size_t shapes = comparison.cohort.targets.size();
  return fmt::format("no noise is found{}, but {} cannot exclude noise of up to {} ({}); about {} could",
                     excluded.empty()
                         ? ""
                         : fmt::format(" ({} {} at most {})", joined_words(excluded),
                                       excluded.size() > 1 ? "have" : "has", of_variance(greatest_excluded)),
                     counted(shapes, "shape"), of_variance(greatest), widest, shapes_needed(shapes, greatest, kEnough));
}

// By the paths that lead there, and their cost: evidence does not tell models apart from one shape.
std::string verdict_of_one_shape(const std::vector<ModelRow>& rows) {
  std::vector<std::string> matching, others;
  for (const ModelRow& row : rows) {
    const compare::ComparedModel& model = *row.model;
    const std::string name = shortened_spec(model.noise);
    if (model.paths && model.paths->matched == 1)
      matching.push_back(fmt::format("{} at cost {:.3g}", name, model.paths->total.value));
    else
      (model.matched == 1 ? matching : others).push_back(name);
  }
  if (matching.empty() || others.empty()) return "one shape does not tell noise models apart; several would";
  return fmt::format("one shape, to which no path of {} leads, but of {}", fmt::join(others, ", "),
                     fmt::join(matching, ", "));
}

using Rows = std::vector<std::vector<std::string>>;

// Specifications of noise in the first column without digits that are not read.
Rows with_short_names(Rows rows) {
  for (std::size_t i = 1; i < rows.size(); ++i) rows[i].front() = shortened_spec(rows[i].front());
  return rows;
}

void print_fitted(const compare::ComparedModel& model) {
  print_text("{}", padded("  " + shortened_spec(model.noise), 30));
  for (const compare::FittedNumber& fitted : model.fit.fitted) print_text("{}  ", fitted_text(fitted));
  print_text("noise {:.0f} % of the variance", 100 * model.fit.noise_share);
  if (model.fit.greatest_noise_share > 0) print_text(", at most {:.3g} %", 100 * model.fit.greatest_noise_share);
  print_text("\n");
}

}  // namespace

std::string kernel_words(const compare::CohortSettings& settings) {
  return shortened_spec(settings.kernel.spec()) + (settings.fit_width ? " (the width fitted, from there)" : "");
}

std::string sigma_words(const compare::CohortSettings& settings) {
  return fmt::format("sigma {:.4g}{}", settings.sigma.in(0), settings.fit_sigma ? " (fitted, from there)" : "");
}

std::string number(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

std::string fitted_text(const compare::FittedNumber& fitted) {
  if (fitted.vanishes) return fitted.name + (fitted.name == "lambda" ? " = ∞" : " = 0");  // 1/λ is the variance
  return fitted.name + " = " + positive_number_text(fitted.value, fitted.log_deviation, fitted.low, fitted.high);
}

std::string verdict(const compare::Comparison& comparison) {
  const std::vector<ModelRow> rows = ranked_rows(comparison);
  const std::string& best = rows.front().model->noise;
  if (rows.size() == 1) return fmt::format("only one model: {}", best);
  if (!differ_beyond_sigma(comparison)) return nothing_to_tell(comparison);
  if (comparison.cohort.targets.size() == 1) return verdict_of_one_shape(rows);
  std::vector<std::string> equal;
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (!rows[i].model->is_behind()) equal.push_back(shortened_spec(rows[i].model->noise));
  const compare::CohortFit& fit = rows.front().model->fit;
  if (is_geodesic(fit) && fit.momenta_vanish()) return nothing_to_tell(comparison);
  if (is_geodesic(fit)) return verdict_of_geodesic(comparison);
  if (equal.empty()) return fmt::format("these shapes are best explained by {}", shortened_spec(best));
  return fmt::format("these shapes favour {}, but do not distinguish it from {}", shortened_spec(best),
                     fmt::join(equal, ", "));
}

std::string as_title(std::string text) {
  if (!text.empty()) text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

void print_comparison(const compare::Comparison& comparison) {
  print_text("{}: {} of {} landmarks in {}D, aligned: {}\n", comparison.cohort.source.source,
             counted(comparison.cohort.targets.size(), "shape"), comparison.cohort.source.count(),
             comparison.cohort.source.dimension(), alignment_name(comparison.cohort.alignment));
  print_text("model      {}, {} in {} steps, {}\n\n", kernel_words(comparison.settings), comparison.settings.integrator,
             comparison.settings.grid.steps, sigma_words(comparison.settings));
  const std::vector<ModelRow> rows = ranked_rows(comparison);
  const auto print = [&](std::initializer_list<std::string_view> keys) {
    print_table(with_short_names(text_table(chosen(model_facts(), keys), rows)));
  };
  print({"noise", "difference", "weight", "p_value", "log_evidence", "laplace", "rms", "energy", "action"});
  print_text("\n");
  print(
      {"noise", "energy_score", "coverage_90", "order_inversions", "flipped_triangles", "folded_fraction", "seconds"});
  if (const std::vector<PathRow> paths = path_rows(rows); !paths.empty()) {
    print_text("\n");
    print_table(text_table(path_facts(), paths));
  }
  print_text("\nfitted\n");
  for (const ModelRow& row : rows) print_fitted(*row.model);
  print_text("\nverdict    {}\n", finding(comparison));
  if (const std::string range = sigma_range(comparison); !range.empty())
    print_text("sigma      the verdict {} ({:.1f} s)\n", range, comparison.profile->seconds);
  print_text("steps      {}\n", steps_words(comparison));
  if (const std::string power = recognition_words(comparison); !power.empty()) print_text("power      {}\n", power);
}

void print_recovery(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                    const compare::RecoveryOptions& options) {
  print_text("{} cohorts of {} shapes from each model, {}, {}: how often each model is chosen\n\n", options.cohorts,
             options.shapes, kernel_words(options.settings), sigma_words(options.settings));
  std::vector<std::string> head = {"drawn from", "noise share"};
  for (const std::string& candidate : candidates) head.push_back(candidate.substr(0, candidate.find(':')));
  Rows table{head};
  for (const compare::RecoveryRow& row : rows) {
    std::vector<std::string> cells = {shortened_spec(row.truth.noise.spec()),
                                      number(100 * row.noise_share, "{:.0f} %")};
    for (const int chosen : row.chosen) cells.push_back(std::to_string(chosen));
    table.push_back(cells);
  }
  print_table(table);
}

}  // namespace pulson
