#include "report.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "compare/facts.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "sentences.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/program.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

// Specifications of noise without digits that are not read.
Facts<ModelRow> short_names(Facts<ModelRow> facts) {
  facts.front().value = [](const ModelRow& row) { return shortened_spec(row.model->noise); };
  return facts;
}

html::ReportTable evidence_table(const std::vector<ModelRow>& rows) {
  return report_table(
      short_names(chosen(model_facts(), {"noise", "difference", "weight", "p_value", "log_evidence", "laplace",
                                         "step_error", "difference_step_error", "converged"})),
      rows,
      "Evidence. A score is the log evidence minus (k/2) log n for k fitted numbers and n shapes, in nats, relative to "
      "the best model; p is the probability of as much evidence for noise where there is none; Laplace is Laplace's "
      "approximation of the log evidence. The step error is what these steps lack of the limit of fine steps: the log "
      "evidence and the score have it added. Errors are standard errors.");
}

html::ReportTable numbers_table(const std::vector<ModelRow>& rows) {
  const bool is_known =
      std::any_of(rows.begin(), rows.end(), [](const ModelRow& row) { return row.model->recognition.has_value(); });
  Facts<ModelRow> facts = chosen(model_facts(), {"noise", "fitted", "noise_share", "greatest_noise_share"});
  std::string caption =
      "Fitted numbers, with the standard deviation of their logarithms. The noise has this share of the variance, and "
      "at most the next, the end of an interval of 90 %.";
  if (is_known) {
    facts = chosen(model_facts(),
                   {"noise", "fitted", "noise_share", "greatest_noise_share", "recognised", "recognised_share"});
    caption +=
        " Of 50 cohorts of as many shapes, drawn from the model with noise of the last share, so many would reveal it.";
  }
  return report_table(short_names(std::move(facts)), rows, caption);
}

// Inversions are of shapes on a line, triangles of the plane, scores of shapes that were held out.
html::ReportTable fit_table(const std::vector<ModelRow>& rows) {
  return report_table(
      short_names(chosen(model_facts(), {"noise", "rms", "energy", "action", "order_inversions", "flipped_triangles",
                                         "folded_fraction", "energy_score", "coverage_90", "seconds"})),
      rows,
      "Matches and predictions, as means over the shapes. Inversions, flipped triangles and the folded fraction of the "
      "plane show what no flow can do. The energy score is that of held-out shapes; lower is better.");
}

// The most probable path, and beside it that of least cost.
html::ReportTable path_table(const std::vector<ModelRow>& rows) {
  return report_table(path_facts(), path_rows(rows),
                      "The most probable paths (mode map), and the paths of least cost with the same numbers "
                      "(metamorphosis; without noise deterministic): mean of a shape. A shape is matched where its rms "
                      "is at most 3 sigma.");
}

// Of the models that were checked.
html::ReportTable check_table(const std::vector<ModelRow>& rows) {
  return report_table(
      check_facts(), check_rows(rows),
      "Would the model draw such shapes? Statistics of these shapes, their central 90 % in cohorts drawn "
      "from the model with its fitted numbers and aligned in the same way, and p of two sides; of the "
      "variances of landmarks the number outside, and p of all of them together.");
}

html::ReportTable shape_table(const std::vector<ModelRow>& rows) {
  Facts<ShapeRow> facts = chosen(
      shape_facts(), {"noise", "specimen", "shape", "log_evidence", "rms", "energy", "action", "data", "converged"});
  facts[0].value = [](const ShapeRow& row) { return shortened_spec(row.model->noise); };
  facts[2].value = [](const ShapeRow& row) {
    return std::filesystem::path(row.comparison->cohort.targets[row.shape].source).filename().string();
  };
  return report_table(facts, shape_rows(rows), "Each shape under each model, as in shapes.csv.");
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
                          .lead = fmt::format("{}.", as_title(headline(comparison)))};
  html::ReportSection verdict{"The verdict", {}};
  for (const std::string& sentence : four_sentences(comparison))
    verdict.blocks.emplace_back(html::ReportParagraph{sentence});
  if (const std::string steps = steps_warning(comparison); !steps.empty())
    verdict.blocks.emplace_back(html::ReportParagraph{as_title(steps) + "."});
  report.sections.push_back(std::move(verdict));
  html::ReportSection models{"Models", {}};
  const std::vector<ModelRow> rows = ranked_rows(comparison);
  models.blocks.emplace_back(html::ReportParagraph{fmt::format(
      "{} of {} in {}D from {}, aligned: {}. Kernel {}, {} in {} steps, {}.",
      counted(comparison.cohort.targets.size(), "shape"), counted(comparison.cohort.source.count(), "landmark"),
      comparison.cohort.source.dimension(), comparison.cohort.source.source,
      alignment_name(comparison.cohort.alignment), kernel_words(comparison.settings), comparison.settings.integrator,
      comparison.settings.grid.steps, sigma_words(comparison.settings))});
  models.blocks.emplace_back(evidence_table(rows));
  models.blocks.emplace_back(numbers_table(rows));
  for (const std::filesystem::path& picture : pictures)
    models.blocks.emplace_back(html::ReportPicture{picture, fmt::format("Saved as {}.", picture.filename().string())});
  models.blocks.emplace_back(fit_table(rows));
  if (html::ReportTable checks = check_table(rows); !checks.rows.empty()) models.blocks.emplace_back(std::move(checks));
  if (html::ReportTable paths = path_table(rows); !paths.rows.empty()) models.blocks.emplace_back(std::move(paths));
  report.sections.push_back(std::move(models));
  report.sections.push_back({"Shapes", {shape_table(rows)}});
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
    std::vector<html::ReportCell> cells = {{shortened_spec(row.truth.noise.spec())},
                                           html::ReportCell{number(row.truth.lambda)},
                                           {number(100 * row.noise_share, "{:.0f} %")}};
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
