#include "compare/facts.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "compare/summary.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Estimate predicted(const ModelRow& row, double compare::Prediction::*value, double compare::Prediction::*error) {
  const auto& prediction = row.model->prediction;
  return prediction ? Estimate{(*prediction).*value, (*prediction).*error} : Estimate{kNone, kNone};
}

std::string fitted_texts(const compare::CohortFit& fit) {
  std::vector<std::string> texts;
  for (const compare::FittedNumber& fitted : fit.fitted) texts.push_back(fitted_text(fitted));
  return fmt::format("{}", fmt::join(texts, ", "));
}

const compare::ShapeFit& fit_of(const ShapeRow& row) { return row.model->fit.shapes[row.shape]; }
const Landmarks& target_of(const ShapeRow& row) { return row.comparison->cohort.targets[row.shape]; }

}  // namespace

const Facts<ModelRow>& model_facts() {
  using R = ModelRow;
  static const Facts<R> facts = {
      {"noise", "noise", "the noise model", "", [](const R& r) { return r.model->noise; }},
      {"log_evidence", "log evidence", "log p(shapes), nats, with the error of its samples", "{:.1f}",
       [](const R& r) {
         return Estimate{r.model->fit.log_evidence, r.model->fit.sampling_error};
       }},
      {"laplace", "Laplace", "the same by Laplace's approximation", "{:.1f}",
       [](const R& r) { return r.model->fit.laplace; }},
      {"step_error", "step error", "what these steps lack of the limit of fine steps, added to log evidence, nats",
       "{:+.3f}", [](const R& r) { return r.model->fit.step_error; }},
      {"difference_step_error", "of the difference", "the same of the score relative to the best model, nats",
       "{:+.3f}", [](const R& r) { return r.comparison->step_error(*r.model); }},
      {"score", "score", "log evidence - (k/2) log n for k fitted numbers and n shapes, nats", "{:.1f}",
       [](const R& r) { return r.model->score; }},
      {"difference", "score", "score relative to the best model, nats", "{:.1f}",
       [](const R& r) {
         const bool is_best = r.model == &r.comparison->models[r.comparison->best];
         return is_best ? Estimate{0, 0} : r.model->difference;
       }},
      {"weight", "weight", "probability of the model, if one of them is true", "{:.2g}",
       [](const R& r) { return r.model->weight; }},
      {"p_value", "p", "probability of such a gain over none where there is no noise", "{:.2g}",
       [](const R& r) { return r.model->p_value; }},
      {"noise_share", "noise share", "fraction of the variance of the end points due to the noise", "{:.0f} %",
       [](const R& r) { return r.model->fit.noise_share; }, 100},
      {"greatest_noise_share", "at most", "upper end of the interval of 90 % of the noise share", "{:.0f} %",
       [](const R& r) { return r.model->fit.greatest_noise_share; }, 100},
      {"recognised", "recognised", "cohorts of as many shapes drawn from the model that reveal it", "{:.0f} %",
       [](const R& r) { return r.model->recognition ? r.model->recognition->part : kNone; }, 100},
      {"recognised_share", "of share", "noise share of these: as fitted, or a third where less than a tenth is",
       "{:.0f} %", [](const R& r) { return r.model->recognition ? r.model->recognition->noise_share : kNone; }, 100},
      {"fitted", "fitted", "the fitted numbers", "", [](const R& r) { return fitted_texts(r.model->fit); }},
      {"converged", "converged", "whether the fit converged", "", [](const R& r) { return r.model->fit.converged; }},
      {"rms", "rms", "root mean square distance of a landmark from its target, length units, mean of a shape", "{:.3g}",
       [](const R& r) { return r.model->rms; }},
      {"energy", "energy", "(lambda/2) p0'K p0, mean of a shape", "{:.3g}", [](const R& r) { return r.model->energy; }},
      {"action", "action", "1/2 sum |dW|^2/dt, mean of a shape", "{:.3g}", [](const R& r) { return r.model->action; }},
      {"total", "cost", "energy + action + data, mean of a shape", "{:.3g}", [](const R& r) { return r.model->total; }},
      {"matched", "matched", "shapes whose rms is at most 3 sigma", "",
       [](const R& r) { return long{r.model->matched}; }},
      {"order_inversions", "inversions", "pairs of landmarks on a line in reversed order, mean of a shape", "{:.3g}",
       [](const R& r) { return r.model->order_inversions; }},
      {"flipped_triangles", "triangles", "flipped Delaunay triangles in the plane, mean of a shape", "{:.3g}",
       [](const R& r) { return r.model->flipped_triangles; }},
      {"folded_fraction", "folded", "fraction of the shape's box that folds, mean of a shape", "{:.3g} %",
       [](const R& r) { return r.model->folded_fraction; }, 100},
      {"energy_score", "energy score", "of held-out shapes, length units: lower is better", "{:.4g}",
       [](const R& r) {
         return predicted(r, &compare::Prediction::energy_score, &compare::Prediction::energy_score_error);
       }},
      {"coverage_90", "coverage 90 %", "fraction of held-out coordinates in the central 90 % of the draws", "{:.2f}",
       [](const R& r) { return predicted(r, &compare::Prediction::coverage, &compare::Prediction::coverage_error); }},
      {"seconds", "seconds", "of the fit and its predictions", "{:.2f}", [](const R& r) { return r.model->seconds; }}};
  return facts;
}

const Facts<PathRow>& path_facts() {
  using R = PathRow;
  static const Facts<R> facts = {
      {"noise", "noise", "the noise model", "", [](const R& r) { return shortened_spec(r.model->noise); }},
      {"path", "path", "most probable, or of least cost with the same numbers", "",
       [](const R& r) { return std::string(r.paths == nullptr ? "most probable" : "least cost"); }},
      {"matched", "matched", "shapes whose rms is at most 3 sigma", "",
       [](const R& r) {
         return fmt::format("{} of {}", r.paths == nullptr ? r.model->matched : r.paths->matched,
                            r.comparison->cohort.targets.size());
       }},
      {"rms", "rms", "length units", "{:.3g}",
       [](const R& r) { return r.paths == nullptr ? r.model->rms : r.paths->rms; }},
      {"total", "cost", "energy + action + data", "{:.3g}",
       [](const R& r) { return r.paths == nullptr ? r.model->total : r.paths->total; }},
      {"action", "action", "1/2 sum |dW|^2/dt", "{:.3g}",
       [](const R& r) { return r.paths == nullptr ? r.model->action : r.paths->action; }},
      {"reversals", "reversals", "pairs in reversed order on a line, flipped triangles in the plane", "{:.3g}",
       [](const R& r) {
         const Estimate& inversions = r.paths == nullptr ? r.model->order_inversions : r.paths->order_inversions;
         const Estimate& triangles = r.paths == nullptr ? r.model->flipped_triangles : r.paths->flipped_triangles;
         return std::isnan(inversions.value) ? triangles.value : inversions.value;
       }}};
  return facts;
}

const Facts<ShapeRow>& shape_facts() {
  using R = ShapeRow;
  static const Facts<R> facts = {
      {"noise", "noise", "the noise model with its fitted numbers", "", [](const R& r) { return r.model->fit.noise; }},
      {"shape", "shape", "address of the shape", "", [](const R& r) { return target_of(r).source; }},
      {"log_evidence", "log evidence", "nats", "{:.2f}", [](const R& r) { return fit_of(r).log_evidence; }},
      {"laplace", "Laplace", "nats, by Laplace's approximation", "{:.2f}",
       [](const R& r) { return fit_of(r).laplace; }},
      {"effective_samples", "effective samples", "of the importance samples", "{:.3g}",
       [](const R& r) { return fit_of(r).effective_samples; }},
      {"rms", "rms", "length units", "{:.3g}", [](const R& r) { return fit_of(r).rms; }},
      {"energy", "energy", "(lambda/2) p0'K p0", "{:.3g}", [](const R& r) { return fit_of(r).cost.energy; }},
      {"action", "action", "1/2 sum |dW|^2/dt", "{:.3g}", [](const R& r) { return fit_of(r).cost.action; }},
      {"data", "data", "1/2 |r|^2", "{:.3g}", [](const R& r) { return fit_of(r).cost.data; }},
      {"converged", "converged", "whether the match converged", "", [](const R& r) { return fit_of(r).converged; }},
      {"energy_score", "energy score", "of the shape held out, length units", "{:.4g}",
       [](const R& r) { return r.model->prediction ? r.model->prediction->shapes[r.shape].energy_score : kNone; }},
      {"coverage_90", "coverage 90 %", "of its coordinates", "{:.2f}",
       [](const R& r) { return r.model->prediction ? r.model->prediction->shapes[r.shape].coverage : kNone; }},
      {"specimen", "specimen", "name of the shape", "", [](const R& r) { return target_of(r).name; }}};
  return facts;
}

std::vector<ModelRow> model_rows(const compare::Comparison& comparison) {
  std::vector<ModelRow> rows;
  for (const compare::ComparedModel& model : comparison.models) rows.push_back({&comparison, &model});
  return rows;
}

std::vector<ModelRow> ranked_rows(const compare::Comparison& comparison) {
  std::vector<ModelRow> rows = model_rows(comparison);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const ModelRow& a, const ModelRow& b) { return a.model->score > b.model->score; });
  return rows;
}

std::vector<PathRow> path_rows(const std::vector<ModelRow>& models) {
  std::vector<PathRow> rows;
  bool any = false;
  for (const ModelRow& row : models) {
    rows.push_back({row.comparison, row.model, nullptr});
    if (!row.model->paths) continue;
    any = true;
    rows.push_back({row.comparison, row.model, &*row.model->paths});
  }
  if (!any) rows.clear();
  return rows;
}

std::vector<ShapeRow> shape_rows(const std::vector<ModelRow>& models) {
  std::vector<ShapeRow> rows;
  for (const ModelRow& row : models)
    for (std::size_t s = 0; s < row.model->fit.shapes.size(); ++s) rows.push_back({row.comparison, row.model, s});
  return rows;
}

const Facts<CheckRow>& check_facts() {
  using R = CheckRow;
  static const Facts<R> facts = {
      {"noise", "model", "of the model that cohorts are drawn from", "",
       [](const R& r) { return shortened_spec(r.model->noise); }},
      {"statistic", "statistic", "of a cohort", "", [](const R& r) { return r.statistic; }},
      {"observed", "these shapes", "of these shapes", "{:.4g}", [](const R& r) { return r.check.observed; }},
      {"low_90", "model, from", "lower end of the central 90 % of the cohorts drawn", "{:.4g}",
       [](const R& r) { return r.check.low; }},
      {"high_90", "to", "upper end", "{:.4g}", [](const R& r) { return r.check.high; }},
      {"p_value", "p", "of two sides; of the landmarks, of all variances together", "{:.3g}",
       [](const R& r) { return r.check.p_value; }}};
  return facts;
}

std::vector<CheckRow> check_rows(const std::vector<ModelRow>& models, bool with_landmarks) {
  std::vector<CheckRow> rows;
  for (const ModelRow& row : models) {
    if (!row.model->checks) continue;
    const compare::PredictiveChecks& checks = *row.model->checks;
    rows.push_back({row.model,
                    "landmarks with a variance outside",
                    {static_cast<double>(checks.outside), std::nan(""), std::nan(""), checks.variances_p}});
    rows.push_back({row.model, "share of the first mode", checks.share});
    rows.push_back({row.model, "mean energy score", checks.energy});
    rows.push_back({row.model, "largest distance", checks.distance});
    for (std::size_t a = 0; with_landmarks && a < checks.variances.size(); ++a)
      rows.push_back({row.model, fmt::format("variance of landmark {}", a + 1), checks.variances[a]});
  }
  return rows;
}

}  // namespace pulson
