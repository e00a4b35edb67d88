#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>

#include <fmt/core.h>

#include "pulson/core/name_table.hpp"
#include "sentences.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

double or_zero(double value) { return std::isfinite(value) ? value : 0; }

std::vector<double> counting(std::size_t size) {
  std::vector<double> numbers(size);
  for (std::size_t i = 0; i < size; ++i) numbers[i] = static_cast<double>(i + 1);
  return numbers;
}

std::string name_of(const compare::ComparedModel& model) { return shortened_spec(model.noise); }

// The names of a noise's terms without their parameters.
std::string kinds_of(const std::string& noise) {
  std::string kinds;
  for (const Spec& term : parse_spec_sum(noise, "noise")) kinds += (kinds.empty() ? "" : "+") + term.name;
  return kinds;
}

// A name short enough for a panel that still distinguishes the noise models.
std::vector<std::string> short_names(const std::vector<std::string>& noises) {
  std::vector<std::string> kinds;
  std::transform(noises.begin(), noises.end(), std::back_inserter(kinds), kinds_of);
  if (std::set<std::string>(kinds.begin(), kinds.end()).size() == kinds.size()) return kinds;
  std::transform(noises.begin(), noises.end(), kinds.begin(), shortened_spec);
  return kinds;
}

// One dot with its error for each model.
charts::ChartPanel dots(const compare::Comparison& comparison, charts::ChartPanel panel,
                        Estimate (*value)(const compare::ComparedModel&)) {
  std::vector<std::string> noises;
  for (const compare::ComparedModel& model : comparison.models) noises.push_back(model.noise);
  panel.x_names = short_names(noises);
  for (std::size_t i = 0; i < comparison.models.size(); ++i) {
    const compare::ComparedModel& model = comparison.models[i];
    const Estimate estimate = value(model);
    if (!std::isfinite(estimate.value)) continue;
    panel.series.push_back({.name = name_of(model),
                            .x = {static_cast<double>(i + 1)},
                            .y = {estimate.value},
                            .error = {or_zero(estimate.standard_error)},
                            .style = charts::SeriesStyle::kPoints});
  }
  return panel;
}

// The axis shows the best three models in its upper half, as one that is far behind would press them together; those
// further behind than it reaches stand on its lower edge, with their number in the name.
charts::ChartPanel scores(const compare::Comparison& comparison) {
  constexpr std::size_t kShown = 3;
  constexpr double kLeastRange = 10;  // nats, odds of 1 to 22,000
  charts::ChartPanel panel =
      dots(comparison, {.heading = "Score relative to the best model (nats)", .reference_lines = {{0, ""}}},
           [](const compare::ComparedModel& model) { return model.difference; });
  std::vector<double> values;
  for (const charts::Series& series : panel.series) values.push_back(series.y.front());
  std::sort(values.begin(), values.end(), std::greater<>());
  if (values.size() <= kShown) return panel;
  const double range = std::max(kLeastRange, 2 * std::abs(values[kShown - 1]));
  if (values.back() > -1.5 * range) return panel;
  panel.y_range = std::pair{-range, 0.0};
  panel.heading += fmt::format(", below −{:.0f} on the lower edge", range);
  for (charts::Series& series : panel.series) {
    if (series.y.front() >= -range) continue;
    std::string& name = panel.x_names[static_cast<std::size_t>(std::lround(series.x.front())) - 1];
    name += fmt::format(": −{:.3g}", -series.y.front());
    series.y.front() = -range;
    series.error.clear();
  }
  return panel;
}

charts::ChartPanel predictions(const compare::Comparison& comparison) {
  return dots(comparison, {.heading = "Energy score of held-out shapes (lower is better)"},
              [](const compare::ComparedModel& model) {
                return model.prediction ? Estimate{model.prediction->energy_score, model.prediction->energy_score_error}
                                        : Estimate{std::nan(""), 0};
              });
}

// Side by side: where models agree, one would hide the others.
double abreast(std::size_t model, std::size_t models) {
  constexpr double kAbreast = 0.5;  // of the distance between neighbours, for all models
  return kAbreast * ((static_cast<double>(model) + 0.5) / static_cast<double>(models) - 0.5);
}

// Where the variance of so many shapes is in 90 of 100 cohorts: that of m independent squares of a normal distribution
// is within 1 ± 1.645 √(2/m) of its mean on a logarithmic scale.
void add_band(const compare::Comparison& comparison, charts::Series& series) {
  const double squares = static_cast<double>(comparison.cohort.targets.size()) * comparison.cohort.source.dimension();
  const double factor = std::exp(1.645 * std::sqrt(2 / squares));
  for (const double value : series.y) {
    series.low.push_back(value / factor);
    series.high.push_back(value * factor);
  }
}

charts::ChartPanel spectrum(const compare::Comparison& comparison) {
  charts::ChartPanel panel{.heading = "Variance along eigenvectors (band: 90 % of cohorts)",
                           .x_label = "eigenvector, low to high frequency",
                           .counts_x = true,
                           .log_y = true};
  charts::Series observed{
      .name = "observed", .x = {}, .y = {}, .style = charts::SeriesStyle::kPoints, .colour = charts::Series::kInk};
  const std::vector<double> places = counting(static_cast<std::size_t>(comparison.eigenvalues.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (!(comparison.observed.size() > row && comparison.observed[row] > 0)) continue;
    observed.x.push_back(places[i]);
    observed.y.push_back(comparison.observed[row]);
    observed.error.push_back(or_zero(comparison.observed_error[row]));
  }
  const compare::ComparedModel& best = comparison.models[comparison.best];
  for (std::size_t i = 0; i < comparison.models.size(); ++i) {
    const compare::ComparedModel& model = comparison.models[i];
    if (!(model.spectrum.size() > 0 && (model.spectrum.array() > 0).all())) continue;
    charts::Series series{.name = name_of(model),
                          .x = places,
                          .y = {model.spectrum.begin(), model.spectrum.end()},
                          .style = charts::SeriesStyle::kLineAndPoints};
    for (double& place : series.x) place += abreast(i, comparison.models.size());
    if (&model == &best) add_band(comparison, series);
    panel.series.push_back(std::move(series));
  }
  panel.series.push_back(std::move(observed));
  return panel;
}

charts::ChartPanel noise_displacements(const compare::Comparison& comparison) {
  charts::ChartPanel panel{
      .heading = "Displacement by the noise (root mean square)", .x_label = "landmark", .counts_x = true};
  for (std::size_t i = 0; i < comparison.models.size(); ++i) {
    const compare::ComparedModel& model = comparison.models[i];
    std::vector<double> places = counting(static_cast<std::size_t>(comparison.cohort.source.count()));
    for (double& place : places) place += abreast(i, comparison.models.size());
    panel.series.push_back({.name = name_of(model),
                            .x = std::move(places),
                            .y = {model.noise_displacement.begin(), model.noise_displacement.end()},
                            .style = charts::SeriesStyle::kLineAndPoints});
  }
  return panel;
}

// Without what stands in brackets, for a title of one line.
std::string without_brackets(std::string text) {
  for (std::size_t open = text.find(" ("); open != std::string::npos; open = text.find(" (", open))
    text.erase(open, text.find(')', open) - open + 1);
  return text;
}

}  // namespace

charts::Chart comparison_chart(const compare::Comparison& comparison) {
  charts::Chart chart{
      .title = as_title(without_brackets(headline(comparison))),
      .subtitle = fmt::format("{} shape{} of {} landmarks, {}, {}", comparison.cohort.targets.size(),
                              comparison.cohort.targets.size() == 1 ? "" : "s", comparison.cohort.source.count(),
                              kernel_words(comparison.settings), sigma_words(comparison.settings)),
      .rows = {{scores(comparison), spectrum(comparison)}, {predictions(comparison), noise_displacements(comparison)}}};
  if (chart.rows[1][0].series.empty()) chart.rows[1].erase(chart.rows[1].begin());
  return chart;
}

charts::Chart sigma_chart(const compare::Comparison& comparison) {
  const compare::SigmaProfile& profile = *comparison.profile;
  charts::ChartPanel panel{.heading = "Score relative to the best model at that sigma (nats)",
                           .x_label = "sigma, length units",
                           .reference_lines = {{0, ""}, {-3, "3 nats"}},
                           .log_x = true};
  for (std::size_t m = 0; m < comparison.models.size(); ++m) {
    charts::Series series{
        .name = name_of(comparison.models[m]), .x = {}, .y = {}, .style = charts::SeriesStyle::kLineAndPoints};
    for (Eigen::Index k = 0; k < profile.sigma.size(); ++k) {
      double best = profile.scores(k, static_cast<Eigen::Index>(m));
      if (!std::isfinite(best)) continue;
      for (const double score : profile.scores.row(k))
        if (std::isfinite(score)) best = std::max(best, score);
      series.x.push_back(profile.sigma[k]);
      series.y.push_back(profile.scores(k, static_cast<Eigen::Index>(m)) - best);
    }
    if (!series.x.empty()) panel.series.push_back(std::move(series));
  }
  const std::string range = sigma_range(comparison);
  const std::size_t colon = range.find(": ");  // what follows is too long for a title
  return {.title = as_title("the verdict " + range.substr(0, colon)),
          .subtitle = fmt::format("{}sigma {:.3g} in the best model",
                                  colon == std::string::npos ? "" : range.substr(colon + 2) + "; ",
                                  comparison.models[comparison.best].fit.sigma),
          .rows = {{panel}}};
}

charts::Chart recovery_chart(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                             const compare::RecoveryOptions& options) {
  charts::ChartPanel panel{.heading = "Fraction of the cohorts for which each model, by colour, is chosen",
                           .x_label = "model that the cohorts are drawn from  (error bars: one standard error)",
                           .y_range = std::pair{0.0, 1.0}};
  std::vector<std::string> drawn;
  for (const compare::RecoveryRow& row : rows) drawn.push_back(row.truth.noise.spec());
  panel.x_names = short_names(drawn);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    charts::Series series{.name = shortened_spec(candidates[c]), .x = {}, .y = {}, .style = charts::SeriesStyle::kBars};
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const double part = rows[r].chosen[c] / static_cast<double>(options.cohorts);
      series.x.push_back(static_cast<double>(r + 1));
      series.y.push_back(part);
      series.error.push_back(std::sqrt(part * (1 - part) / options.cohorts));
    }
    panel.series.push_back(std::move(series));
  }
  return {.title = "How often each model is chosen",
          .subtitle = fmt::format("{} cohorts of {} shapes from each model, {}, {}", options.cohorts, options.shapes,
                                  kernel_words(options.settings), sigma_words(options.settings)),
          .rows = {{panel}}};
}

}  // namespace pulson
