#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "html/html_report.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/picture.hpp"
#include "results.hpp"
#include "shell/options.hpp"
#include "shell/report_parts.hpp"

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
  if (const auto& found = results.regression)
    text += fmt::format(" Regression on {}: R² {:.3f}, p {:.3g}.", results.covariate_name, found->r_squared,
                        found->p_value);
  if (const auto& found = results.comparison)
    text += fmt::format(" Groups: R² {:.3f}, p {:.3g}.", found->r_squared, found->p_value);
  if (!results.converged()) text += " The search did not converge.";
  return text;
}

html::ReportTable model_table(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  FactTable table("setting");
  const auto with_origin = [](const std::string& value, bool fitted) { return fitted ? value + ", fitted" : value; };
  table.add("kernel", with_origin(atlas.kernel.spec(4), atlas.fitted_kernel));
  table.add("lambda", with_origin(report_number(atlas.lambda), atlas.fitted_lambda));
  table.add("sigma", with_origin(report_number(atlas.sigma), atlas.fitted_sigma));
  if (atlas.beta > 0) table.add("noise", fmt::format("ch-sd:beta={:.4g}", atlas.beta));
  table.add("aligned", alignment_name(atlas.alignment));
  table.add("steps", fmt::to_string(atlas.steps));
  table.add("converged", results.converged() ? "yes" : "no");
  table.add("iterations", fmt::to_string(atlas.iterations));
  table.add("last movement of the template, in diameters", atlas.movement);
  table.add("exp(log) error, in diameters", atlas.exp_log_error());
  table.add("error of the time steps, in diameters", atlas.step_error);
  table.add("seconds", fmt::format("{:.2f}", results.seconds));
  return std::move(table).table();
}

html::ReportTable specimen_table(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  html::ReportTable table{
      {"specimen", "shape", "rms", "J", "energy", "centroid size"},
      {},
      "Template in blue, aligned shape as rings, end of the geodesic dark. Click a column heading to "
      "sort."};
  const Eigen::Index scores = std::min<Eigen::Index>(3, results.modes.scores.cols());
  for (Eigen::Index k = 0; k < scores; ++k) table.header.push_back(fmt::format("mode {}", k + 1));
  if (!results.groups.empty()) table.header.emplace_back("group");
  if (!results.covariate.empty()) table.header.push_back(results.covariate_name);
  constexpr std::size_t kMostSketches = 300;
  const bool has_sketches = results.names.size() <= kMostSketches;
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    const cohort::AtlasSpecimen& specimen = atlas.specimens[i];
    std::vector<html::ReportCell> row = {{results.names[i]}};
    row.push_back({.text = ""});
    if (has_sketches)
      row.back().sketch = html::ReportSketch{atlas.template_shape, specimen.shape.points, specimen.result};
    for (const double value : {specimen.rms(), specimen.cost.total(), specimen.cost.energy, specimen.centroid_size})
      row.push_back({report_number(value)});
    for (Eigen::Index k = 0; k < scores; ++k)
      row.push_back({report_number(results.modes.scores(static_cast<Eigen::Index>(i), k))});
    if (!results.groups.empty()) row.push_back({results.groups[i]});
    if (!results.covariate.empty())
      row.push_back({std::isfinite(results.covariate[i]) ? report_number(results.covariate[i]) : ""});
    table.rows.push_back(std::move(row));
  }
  return table;
}

html::ReportTable mode_table(const AtlasResults& results) {
  html::ReportTable table{{"mode", "variance", "part", "of Procrustes coordinates", "part"}, {}, ""};
  const auto add = [](std::vector<html::ReportCell>& row, const cohort::ShapeModes& modes, Eigen::Index k) {
    const bool has = k < modes.eigenvalues.size();
    row.push_back({has ? report_number(modes.eigenvalues[k]) : ""});
    row.push_back({has ? fmt::format("{:.2f} %", 100 * modes.eigenvalues[k] / modes.total()) : ""});
  };
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(20, results.modes.eigenvalues.size()); ++k) {
    std::vector<html::ReportCell> row = {{fmt::to_string(k + 1)}};
    add(row, results.modes, k);
    add(row, results.procrustes.modes, k);
    table.rows.push_back(std::move(row));
  }
  return table;
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

html::ReportTable pair_table(const cohort::GroupComparison& found) {
  html::ReportTable table{
      {"first", "second", "distance", "p"}, {}, "Distances between the means, in the kernel's metric."};
  for (const auto& pair : found.pairs)
    table.rows.push_back({{found.names[static_cast<std::size_t>(pair.first)]},
                          {found.names[static_cast<std::size_t>(pair.second)]},
                          {report_number(pair.distance)},
                          {report_number(pair.p_value)}});
  return table;
}

}  // namespace

html::HtmlReport atlas_report(const AtlasResults& results, int modes, const RunResults& files) {
  html::HtmlReport report = new_report(fmt::format("Atlas of {} shapes", results.atlas.specimens.size()), lead(results),
                                       {}, in_option_words(results.notes));
  const auto add = [&](const std::string& heading, const std::string& stem) {
    add_still(report, heading, files.shown(stem));
  };
  add("The template", "template");
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
  if (results.comparison) report.sections.push_back({"Groups", {pair_table(*results.comparison)}});
  report.sections.push_back({"Specimens", {specimen_table(results)}});
  return report;
}

}  // namespace pulson
