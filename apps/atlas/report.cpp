#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "atlas/facts.hpp"
#include "atlas/shape_space.hpp"
#include "audit/accused.hpp"
#include "html/html_report.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/picture.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/report_parts.hpp"
#include "warp/picture_files.hpp"

namespace pulson {
namespace {

constexpr int kFrames = 21;              // of a mode's motion
constexpr double kMotionDeviations = 2;  // from minus to plus so many
constexpr int kMotionCells = 14, kPointsPerMotionCell = 3;

std::string lead(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  std::string text = fmt::format(
      "Template of {} shapes with {} landmarks in {}D. The first mode has {:.1f} % of the variance of the momenta.",
      atlas.specimens.size(), atlas.template_shape.count(), atlas.template_shape.dimension(),
      100 * results.modes.eigenvalues[0] / results.modes.total());
  for (const ShapeModel& model : results.models)
    for (std::size_t t = 0; t < model.design.terms.size(); ++t)
      text += fmt::format(" {}: R² {:.3f}, p {:.3g} of Procrustes coordinates, {:.3f} and {:.3g} of momenta.",
                          model.design.terms[t].label, model.procrustes.terms[t].r_squared,
                          model.procrustes.terms[t].p_value, model.momenta.terms[t].r_squared,
                          model.momenta.terms[t].p_value);
  if (!results.converged()) text += " The search did not converge.";
  return text;
}

html::ReportTable model_table(const AtlasResults& results) {
  return report_facts(
      chosen(atlas_facts(), {"kernel", "lambda", "sigma", "fitted", "noise", "alignment", "steps", "converged",
                             "iterations", "movement", "exp_log_error", "step_error", "seconds"}),
      results, "setting");
}

html::ReportTable specimen_table(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  html::ReportTable table = report_table(
      chosen(specimen_facts(), {"specimen", "rms", "total", "energy", "centroid_size"}), specimen_rows(results),
      "Template in blue, aligned shape as rings, end of the geodesic dark. Click a column heading to sort.");
  const Eigen::Index scores = std::min<Eigen::Index>(3, results.modes.scores.cols());
  table.header.insert(table.header.begin() + 1, "shape");
  for (Eigen::Index k = 0; k < scores; ++k) table.header.push_back(fmt::format("mode {}", k + 1));
  if (!results.groups.empty()) table.header.emplace_back("group");
  if (!results.covariate.empty()) table.header.push_back(results.covariate_name);
  constexpr std::size_t kMostSketches = 300;
  const bool has_sketches = results.names.size() <= kMostSketches;
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    const cohort::AtlasSpecimen& specimen = atlas.specimens[i];
    std::vector<html::ReportCell>& row = table.rows[i];
    html::ReportCell shape{.text = ""};
    if (has_sketches) shape.sketch = html::ReportSketch{atlas.template_shape, specimen.shape.points, specimen.result};
    row.insert(row.begin() + 1, std::move(shape));
    for (Eigen::Index k = 0; k < scores; ++k)
      row.push_back({report_number(results.modes.scores(static_cast<Eigen::Index>(i), k))});
    if (!results.groups.empty()) row.push_back({results.groups[i]});
    if (!results.covariate.empty())
      row.push_back({std::isfinite(results.covariate[i]) ? report_number(results.covariate[i]) : ""});
  }
  return table;
}

html::ReportTable mode_table(const AtlasResults& results) {
  constexpr std::size_t kMostModes = 20;
  std::vector<ModeRow> rows = mode_rows(results);
  rows.resize(std::min({rows.size(), kMostModes, static_cast<std::size_t>(results.modes.eigenvalues.size())}));
  return report_table(mode_facts(), rows, "");
}

// The template as it moves along a path of shapes; `path_at(s)` for s from −2 to 2.
template <class PathAt>
std::optional<html::ReportMotion> motion_along(const cohort::Atlas& atlas, const PathAt& path_at, std::string caption) {
  html::ReportMotion motion;
  motion.source = atlas.template_shape;
  std::vector<Points> lines;
  if (atlas.template_shape.dimension() == 2) {
    const auto [low, high] = bounding_box(atlas.template_shape.points);
    const double margin = 0.1 * (high - low).maxCoeff();
    lines = grid_lines(low.array() - margin, high.array() + margin, kMotionCells, kPointsPerMotionCell);
  }
  const Points grid = lines.empty() ? Points() : joined_lines(lines);
  for (int frame = 0; frame < kFrames; ++frame) {
    const double s = kMotionDeviations * (2.0 * frame / (kFrames - 1) - 1);
    const Trajectory path = path_at(s);
    motion.times.push_back(s);
    motion.frames.push_back(path.final().q);
    if (lines.empty()) continue;
    try {
      motion.grid.push_back(warp::MaterialFlow({atlas.kernel, make_noise("none", {})}, path).end(grid));
    } catch (const StepError&) {
      lines.clear();
      motion.grid.clear();
    }
  }
  for (const Points& line : lines) motion.lines.push_back(static_cast<int>(line.cols()));
  if (!can_be_drawn(motion.frames) || !can_be_drawn(motion.grid)) return std::nullopt;
  motion.caption = std::move(caption);
  return motion;
}

}  // namespace

html::HtmlReport atlas_report(const AtlasResults& results, int modes, const RunResults& files) {
  html::HtmlReport report = new_report(fmt::format("Atlas of {} shapes", results.atlas.specimens.size()), lead(results),
                                       {}, in_option_words(results.notes));
  const auto add = [&](const std::string& heading, const std::string& stem) {
    add_still(report, heading, files.shown(stem));
  };
  if (auto space = shape_space(results, modes, results.pictures))
    report.sections.push_back({"The shapes by their scores", {std::move(*space)}});
  add("The template", "template");
  if (results.pictures)
    report.sections.push_back(
        {"The mean picture",
         {html::ReportPicture{.picture = jpeg_of(results.pictures->mean),
                              .caption = fmt::format("Mean of the pictures of {}, each carried to the template.",
                                                     counted(results.pictures->count, "specimen")),
                              .has_photograph = true}}});
  const int shown = std::min<int>(modes, static_cast<int>(results.modes.eigenvalues.size()));
  for (int k = 0; k < shown; ++k)
    if (auto motion = motion_along(
            results.atlas, [&](double s) { return mode_path(results, k, s); },
            fmt::format("From −2 to +2 standard deviations along mode {}, of which t is the number.", k + 1)))
      report.sections.push_back({fmt::format("Mode {}", k + 1), {std::move(*motion)}});
  add("The modes", "modes");
  add("Scores", "scores");
  add("Scores of Procrustes coordinates", "procrustes_scores");
  add("Variance of the modes", "scree");
  report.sections.push_back({"Numbers", {model_table(results), mode_table(results)}});
  add("The regression", "regression");
  add("Scores along the regression", "regression_scores");
  add("Means of the groups", "groups");
  add("Coefficients of the model", "coefficients");
  if (!results.models.empty()) {
    html::ReportSection tests{"Tests",
                              {report_table(term_facts(), term_rows(results.models),
                                            "Analysis of variance: sums of squares of type I, permutations of the "
                                            "residuals of the model without the term and those after it.")}};
    if (const std::vector<PairRow> pairs = pair_rows(results.models); !pairs.empty())
      tests.blocks.emplace_back(
          report_table(pair_facts(), pairs, "Distances between least-squares means, numbers at their means."));
    report.sections.push_back(std::move(tests));
  }
  report.sections.push_back({"Specimens", {specimen_table(results)}});
  if (!results.accused.findings.empty() && results.atlas.template_shape.dimension() > 1 &&
      results.accused.reference.cols() == results.given.front().count() && results.accused.reference.allFinite())
    add_accused(report, results.given, results.accused);
  return report;
}

}  // namespace pulson
