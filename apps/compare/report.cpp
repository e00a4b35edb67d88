#include "report.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/program.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

// A cell that is empty where there is not a number, so that a column of numbers stays one.
html::ReportCell cell(double value, const char* format = "{:.3g}") {
  return {std::isnan(value) ? "" : number(value, format)};
}

html::ReportCell cell(const Estimate& estimate, const char* format = "{:.3g}") {
  return {std::isnan(estimate.value) ? "" : with_error(estimate, format)};
}

std::string fitted_numbers(const compare::CohortFit& fit) {
  std::vector<std::string> texts;
  for (const compare::FittedNumber& fitted : fit.fitted) texts.push_back(fitted_text(fitted));
  return fmt::format("{}", fmt::join(texts, ", "));
}

html::ReportTable evidence_table(const compare::Comparison& comparison) {
  html::ReportTable table{
      {"noise", "score relative to the best", "weight", "p", "log evidence", "Laplace", "fitted", "noise share",
       "converged"},
      {},
      "Evidence. A score is the log evidence minus (k/2) log n for k fitted numbers and n shapes, in nats; "
      "p is the probability of as much evidence for noise where there is none; Laplace is Laplace's approximation of "
      "the log evidence. Errors are standard errors."};
  for (const std::size_t i : ranked(comparison)) {
    const compare::ComparedModel& model = comparison.models[i];
    table.rows.push_back({{shortened_spec(model.noise)},
                          i == comparison.best ? html::ReportCell{"0"} : cell(model.difference, "{:.1f}"),
                          cell(model.weight, "{:.2g}"),
                          cell(model.p_value, "{:.2g}"),
                          cell(Estimate{model.fit.log_evidence, model.fit.sampling_error}, "{:.1f}"),
                          cell(model.fit.laplace, "{:.1f}"),
                          {fitted_numbers(model.fit)},
                          {number(100 * model.fit.noise_share, "{:.0f} %")},
                          {model.fit.converged ? "yes" : "no"}});
  }
  return table;
}

// Inversions are of shapes on a line, triangles of the plane, scores of shapes that were held out.
html::ReportTable without_empty_columns(html::ReportTable table) {
  for (std::size_t column = table.header.size(); column-- > 0;) {
    const auto is_empty = [&](const std::vector<html::ReportCell>& row) { return row[column].text.empty(); };
    if (!std::all_of(table.rows.begin(), table.rows.end(), is_empty)) continue;
    const auto at = static_cast<std::ptrdiff_t>(column);
    table.header.erase(table.header.begin() + at);
    for (std::vector<html::ReportCell>& row : table.rows) row.erase(row.begin() + at);
  }
  return table;
}

html::ReportTable fit_table(const compare::Comparison& comparison) {
  html::ReportTable table{
      {"noise", "rms", "energy", "action", "inversions", "triangles", "folded", "energy score", "coverage 90 %",
       "seconds"},
      {},
      "Matches and predictions, as means over the shapes. Inversions, flipped triangles and the folded fraction of the "
      "plane show what no flow can do. The energy score is that of held-out shapes; lower is better."};
  for (const std::size_t i : ranked(comparison)) {
    const compare::ComparedModel& model = comparison.models[i];
    const auto& prediction = model.prediction;
    table.rows.push_back(
        {{shortened_spec(model.noise)},
         cell(model.rms),
         cell(model.energy),
         cell(model.action),
         cell(model.order_inversions.value),
         cell(model.flipped_triangles.value),
         cell(100 * model.folded_fraction.value, "{:.2g} %"),
         prediction ? cell({prediction->energy_score, prediction->energy_score_error}, "{:.4g}") : html::ReportCell{""},
         prediction ? cell({prediction->coverage, prediction->coverage_error}, "{:.2f}") : html::ReportCell{""},
         cell(model.seconds, "{:.2f}")});
  }
  return without_empty_columns(std::move(table));
}

// The most probable path, and beside it that of least cost.
html::ReportTable path_table(const compare::Comparison& comparison) {
  html::ReportTable table{
      {"noise", "path", "matched", "rms", "cost", "action", "inversions", "triangles"},
      {},
      "The most probable paths (mode map), and the paths of least cost with the same numbers "
      "(metamorphosis; without noise deterministic): mean of a shape. A shape is matched where its rms is "
      "at most 3 sigma."};
  const std::size_t shapes = comparison.cohort.targets.size();
  for (const std::size_t i : ranked(comparison)) {
    const compare::ComparedModel& model = comparison.models[i];
    const std::string name = shortened_spec(model.noise);
    table.rows.push_back({{name},
                          {"most probable"},
                          {fmt::format("{} of {}", model.matched, shapes)},
                          cell(model.rms),
                          cell(model.total),
                          cell(model.action),
                          cell(model.order_inversions.value),
                          cell(model.flipped_triangles.value)});
    if (const auto& paths = model.paths)
      table.rows.push_back({{name},
                            {"least cost"},
                            {fmt::format("{} of {}", paths->matched, shapes)},
                            cell(paths->rms),
                            cell(paths->total),
                            cell(paths->action),
                            cell(paths->order_inversions.value),
                            cell(paths->flipped_triangles.value)});
  }
  return without_empty_columns(std::move(table));
}

html::ReportTable shape_table(const compare::Comparison& comparison) {
  html::ReportTable table{
      {"noise", "specimen", "shape", "log evidence", "rms", "energy", "action", "data", "converged"},
      {},
      "Each shape under each model, as in shapes.csv."};
  for (const std::size_t i : ranked(comparison)) {
    const compare::ComparedModel& model = comparison.models[i];
    for (std::size_t s = 0; s < model.fit.shapes.size(); ++s) {
      const compare::ShapeFit& shape = model.fit.shapes[s];
      const Landmarks& target = comparison.cohort.targets[s];
      table.rows.push_back({{shortened_spec(model.noise)},
                            {target.name},
                            {std::filesystem::path(target.source).filename().string()},
                            cell(shape.log_evidence, "{:.2f}"),
                            cell(shape.rms),
                            cell(shape.cost.energy),
                            cell(shape.cost.action),
                            cell(shape.cost.data),
                            {shape.converged ? "yes" : "no"}});
    }
  }
  return table;
}

void add_ends(html::HtmlReport& report, const std::vector<std::string>& notes, double seconds) {
  html::ReportSection remarks{"Remarks", {}};
  for (const std::string& note : notes)
    remarks.blocks.emplace_back(html::ReportParagraph{"Note: " + in_option_words(note)});
  if (!notes.empty()) report.sections.push_back(std::move(remarks));
  report.command = command_line();
  report.version = fmt::format("pulson {}, {:.1f} s", version(), seconds);
}

}  // namespace

html::HtmlReport comparison_report(const compare::Comparison& comparison, const std::vector<std::string>& notes,
                                   double seconds, const std::vector<std::filesystem::path>& pictures) {
  html::HtmlReport report{.title = "Which noise model best explains these shapes?",
                          .lead = as_title(verdict(comparison)) + "."};
  html::ReportSection models{"Models", {}};
  models.blocks.emplace_back(html::ReportParagraph{fmt::format(
      "{} of {} in {}D from {}, aligned: {}. Kernel {}, {} steps, {}.",
      counted(comparison.cohort.targets.size(), "shape"), counted(comparison.cohort.source.count(), "landmark"),
      comparison.cohort.source.dimension(), comparison.cohort.source.source,
      alignment_name(comparison.cohort.alignment), kernel_words(comparison.settings), comparison.settings.grid.steps,
      sigma_words(comparison.settings))});
  models.blocks.emplace_back(evidence_table(comparison));
  for (const std::filesystem::path& picture : pictures)
    models.blocks.emplace_back(html::ReportPicture{picture, fmt::format("Saved as {}.", picture.filename().string())});
  models.blocks.emplace_back(fit_table(comparison));
  models.blocks.emplace_back(path_table(comparison));
  report.sections.push_back(std::move(models));
  report.sections.push_back({"Shapes", {shape_table(comparison)}});
  add_ends(report, notes, seconds);
  return report;
}

html::HtmlReport recovery_report(const std::vector<compare::RecoveryRow>& rows,
                                 const std::vector<std::string>& candidates, const compare::RecoveryOptions& options,
                                 const std::vector<std::string>& notes, double seconds,
                                 const std::filesystem::path& picture) {
  html::HtmlReport report{
      .title = "Would the right model be chosen?",
      .lead =
          fmt::format("{} cohorts of {} shapes were drawn from each model, and all models were fitted to each cohort.",
                      options.cohorts, options.shapes)};
  html::ReportTable table{{"drawn from", "lambda", "noise share"},
                          {},
                          fmt::format("Number of cohorts for which each model was chosen. Kernel {}, {}, seed {}.",
                                      kernel_words(options.settings), sigma_words(options.settings), options.seed)};
  for (const std::string& candidate : candidates) table.header.push_back(shortened_spec(candidate));
  table.header.emplace_back("no model could be fitted");
  for (const compare::RecoveryRow& row : rows) {
    std::vector<html::ReportCell> cells = {
        {shortened_spec(row.truth.noise.spec())}, cell(row.truth.lambda), {number(100 * row.noise_share, "{:.0f} %")}};
    for (const int chosen : row.chosen) cells.push_back({std::to_string(chosen)});
    cells.push_back({std::to_string(row.unfit)});
    table.rows.push_back(std::move(cells));
  }
  html::ReportSection section{"Recovery", {std::move(table)}};
  if (!picture.empty())
    section.blocks.emplace_back(html::ReportPicture{picture, fmt::format("Saved as {}.", picture.filename().string())});
  report.sections.push_back(std::move(section));
  add_ends(report, notes, seconds);
  return report;
}

}  // namespace pulson
