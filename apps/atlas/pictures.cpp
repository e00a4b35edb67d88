#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "charts/chart.hpp"
#include "coefficient_picture.hpp"
#include "draw/layout.hpp"
#include "draw/shape_panels.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/picture.hpp"
#include "results.hpp"
#include "warp/picture_files.hpp"

namespace pulson {
namespace {

constexpr double kModeDeviations = 2;  // of the pictures of modes, where they show
constexpr double kShows = 0.05;        // of the template's diameter: the largest displacement that is plain to see
constexpr double kMostMagnified = 5;   // beyond which shapes are no longer of the kind
constexpr double kGridMargin = 0.1;    // of the grid, over its larger side
constexpr int kModeCells = 18, kPointsPerModeCell = 5;
constexpr Eigen::Index kBars = 20;  // of the scree plot

// The grid about the template, before and after a path. None where the plane has no path.
std::vector<Points> deformed_grid(const cohort::Atlas& atlas, const Trajectory& path) {
  const auto [low, high] = bounding_box(atlas.template_shape.points);
  const double margin = kGridMargin * (high - low).maxCoeff();
  const std::vector<Points> lines =
      grid_lines(low.array() - margin, high.array() + margin, kModeCells, kPointsPerModeCell);
  try {
    const warp::MaterialFlow flow({atlas.kernel, make_noise("none", {})}, path);
    return split_lines(flow.end(joined_lines(lines)), lines);
  } catch (const StepError&) {
    return {};
  }
}

// 1, 2 or 5, so that the largest displacement by these momenta shows; the picture says it.
double magnification(const cohort::Atlas& atlas, const std::vector<Points>& momenta) {
  const Points& start = atlas.template_shape.points;
  const double seen = kShows * diameter(start);
  const auto displacement = [&](double factor) {
    double most = 0;
    for (const Points& p : momenta)
      most = std::max(most, (atlas.geodesic(factor * p).final().q - start).colwise().norm().maxCoeff());
    return most;
  };
  double factor = std::clamp(draw::round_factor(seen / std::max(displacement(1), 1e-300)), 1.0, kMostMagnified);
  try {
    while (factor > 1 && displacement(factor) > 4 * seen) factor = draw::round_factor(0.9 * factor);
    return factor;
  } catch (const StepError&) {  // no path so far
    return 1;
  }
}

// The mean picture of the cohort, as a path carries it.
std::optional<draw::PlacedImage> picture_below(const AtlasResults& results, const Trajectory* path) {
  if (!results.pictures) return std::nullopt;
  const CohortPictures& pictures = *results.pictures;
  const auto image = path == nullptr ? std::optional(pictures.mean) : carried_picture(pictures, results.atlas, *path);
  if (!image) return std::nullopt;
  return draw::PlacedImage{raster_of(*image), pictures.low, pictures.high};
}

draw::ShapePanel panel_of(const AtlasResults& results, const std::string& heading, const Trajectory& path) {
  draw::ShapePanel panel{heading, path.final().q};
  if (results.atlas.template_shape.dimension() == 2) panel.grid = deformed_grid(results.atlas, path);
  panel.image = picture_below(results, &path);
  return panel;
}

draw::ShapePanels panels_of(const cohort::Atlas& atlas, std::string title) {
  draw::ShapePanels picture{.reference = atlas.template_shape,
                            .reference_name = "template",
                            .shape_name = {},
                            .cloud_name = {},
                            .rows = {},
                            .title = std::move(title),
                            .subtitle = {}};
  picture.subtitle = fmt::format("{} shapes of {} landmarks  ·  {}  ·  sigma {:.3g}", atlas.specimens.size(),
                                 atlas.template_shape.count(), atlas.kernel.spec(3), atlas.sigma);
  return picture;
}

double percentage(const cohort::ShapeModes& modes, Eigen::Index k) {
  return 100 * modes.eigenvalues[k] / modes.total();
}

void draw_template(const AtlasResults& results, const draw::PictureFiles& files) {
  const cohort::Atlas& atlas = results.atlas;
  draw::ShapePanels picture = panels_of(atlas, "Template");
  draw::ShapePanel panel{"Template and aligned shapes", {}};
  for (const cohort::AtlasSpecimen& specimen : atlas.specimens) panel.cloud.push_back(specimen.shape.points);
  panel.image = picture_below(results, nullptr);
  picture.cloud_name = "aligned shapes";
  picture.rows = {{std::move(panel)}};
  write_shape_panels(picture, files);
}

void draw_modes(const AtlasResults& results, int modes, const draw::PictureFiles& files) {
  draw::ShapePanels picture = panels_of(results.atlas, "Modes of variation");
  const int count = std::min<int>(modes, static_cast<int>(results.modes.eigenvalues.size()));
  std::vector<Points> momenta;
  for (int k = 0; k < count; ++k) momenta.push_back(mode_momenta(results, k, kModeDeviations));
  const double factor = magnification(results.atlas, momenta), deviations = factor * kModeDeviations;
  picture.shape_name = fmt::format("{:g} standard deviations along a mode", deviations);
  if (factor > 1) picture.shape_name += fmt::format(" ({:g} magnified {:g} times)", kModeDeviations, factor);
  for (int k = 0; k < count; ++k) {
    picture.rows.emplace_back();
    for (const double s : {-deviations, deviations})
      picture.rows.back().push_back(panel_of(results,
                                             fmt::format("mode {} ({:.1f} %), {}{:g} s.d.", k + 1,
                                                         percentage(results.modes, k), s < 0 ? "−" : "+", std::abs(s)),
                                             mode_path(results, k, s)));
  }
  write_shape_panels(picture, files);
}

// Specimens by group; of no group last, without a name.
std::vector<draw::ScorePlot::Group> plotted_groups(const AtlasResults& results, const Points& scores) {
  std::vector<std::string> names;
  for (const std::string& name : results.groups)
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  if (names.empty()) names.emplace_back();
  std::vector<draw::ScorePlot::Group> groups;
  for (const std::string& name : names) {
    std::vector<int> members;
    for (std::size_t i = 0; i < results.names.size(); ++i)
      if (results.groups.empty() || results.groups[i] == name) members.push_back(static_cast<int>(i));
    draw::ScorePlot::Group group{name, scores(Eigen::all, members)};
    for (const int i : members) group.labels.push_back(results.names[static_cast<std::size_t>(i)]);
    groups.push_back(std::move(group));
  }
  return groups;
}

void draw_scores(const AtlasResults& results, const cohort::ShapeModes& modes, const std::string& title,
                 const draw::PictureFiles& files) {
  Points scores = Points::Zero(2, modes.scores.rows());
  const Eigen::Index shown = std::min<Eigen::Index>(2, modes.scores.cols());
  scores.topRows(shown) = modes.scores.leftCols(shown).transpose();
  const auto label = [&](Eigen::Index k) {
    return k < modes.eigenvalues.size() ? fmt::format("mode {} ({:.1f} % of the variance)", k + 1, percentage(modes, k))
                                        : std::string("no second mode");
  };
  write_score_plot({.groups = plotted_groups(results, scores),
                    .x_label = label(0) + " →",
                    .y_label = label(1) + " ↑",
                    .title = title,
                    .subtitle = fmt::format("{} shapes", results.names.size())},
                   files);
}

void draw_scree(const AtlasResults& results, const draw::PictureFiles& files) {
  const auto series = [](const cohort::ShapeModes& modes, const std::string& name, bool cumulative) {
    charts::Series found{.name = name,
                         .x = {},
                         .y = {},
                         .style = cumulative ? charts::SeriesStyle::kLineAndPoints : charts::SeriesStyle::kBars};
    double sum = 0;
    for (Eigen::Index k = 0; k < std::min(kBars, modes.eigenvalues.size()); ++k) {
      const double part = percentage(modes, k);
      sum += part;
      found.x.push_back(static_cast<double>(k + 1));
      found.y.push_back(cumulative ? sum : part);
    }
    return found;
  };
  const auto panel = [&](const std::string& heading, bool cumulative) {
    return charts::ChartPanel{.heading = heading,
                              .x_label = "mode",
                              .series = {series(results.modes, "momenta, in the kernel's metric", cumulative),
                                         series(results.procrustes.modes, "Procrustes coordinates", cumulative)},
                              .y_range = cumulative ? std::optional(std::pair(0.0, 100.0)) : std::nullopt};
  };
  charts::write_chart(
      {.title = "Variance of the modes",
       .subtitle = fmt::format("{} shapes of {} landmarks", results.names.size(), results.atlas.template_shape.count()),
       .rows = {{panel("Part of the variance (%)", false), panel("Sum of the first modes (%)", true)}}},
      files);
}

// Of a model of one term, by momenta.
std::string test_text(const ShapeModel& model) {
  return fmt::format("R² {:.3f}, p {:.3g}", model.momenta.terms.front().r_squared, model.momenta.terms.front().p_value);
}

void draw_regression(const AtlasResults& results, const draw::PictureFiles& files) {
  const cohort::MomentumRegression& found = *results.regression;
  draw::ShapePanels picture = panels_of(results.atlas, fmt::format("Regression on {}: {}", results.covariate_name,
                                                                   test_text(results.model_of_covariate())));
  picture.shape_name = "predicted";
  picture.rows.emplace_back();
  for (const double value : results.shown_values) {
    if (picture.rows.back().size() == 3) picture.rows.emplace_back();
    picture.rows.back().push_back(panel_of(results, fmt::format("{} = {:.4g}", results.covariate_name, value),
                                           results.atlas.geodesic(found.momenta(value))));
  }
  write_shape_panels(picture, files);
}

// The score along the slope, of unit norm, over the covariate, with the line of the regression.
void draw_regression_scores(const AtlasResults& results, const draw::PictureFiles& files) {
  const cohort::MomentumRegression& found = *results.regression;
  const Points velocity = found.slope * results.atlas.metric();
  const double norm = std::sqrt(found.slope.cwiseProduct(velocity).sum());
  Points all = Points::Constant(2, std::ssize(results.names), std::nan(""));
  std::vector<double> known;
  for (std::size_t i = 0; i < results.names.size(); ++i)
    if (std::isfinite(results.covariate[i])) {
      all.col(static_cast<Eigen::Index>(i)) << results.covariate[i],
          (results.atlas.specimens[i].momenta - found.intercept).cwiseProduct(velocity).sum() / norm;
      known.push_back(results.covariate[i]);
    }
  std::vector<draw::ScorePlot::Group> groups;
  for (draw::ScorePlot::Group& group : plotted_groups(results, all)) {
    std::vector<int> kept;
    std::vector<std::string> labels;
    for (int i = 0; i < group.scores.cols(); ++i)
      if (group.scores.col(i).allFinite()) {
        kept.push_back(i);
        labels.push_back(group.labels[static_cast<std::size_t>(i)]);
      }
    if (!kept.empty()) groups.push_back({group.name, group.scores(Eigen::all, kept), labels});
  }
  const auto [low, high] = std::minmax_element(known.begin(), known.end());
  Points line(2, 2);
  line << *low, *high, norm * (*low - found.mean), norm * (*high - found.mean);
  write_score_plot({.groups = groups,
                    .lines = {line},
                    .x_label = results.covariate_name + " →",
                    .y_label = "score along the regression ↑",
                    .title = fmt::format("Regression on {}", results.covariate_name),
                    .subtitle = fmt::format("{} by {} permutations", test_text(results.model_of_covariate()),
                                            results.model_of_covariate().momenta.permutations),
                    .same_scale = false},
                   files);
}

void draw_groups(const AtlasResults& results, const draw::PictureFiles& files) {
  draw::ShapePanels picture =
      panels_of(results.atlas, fmt::format("Means of the groups: {}", test_text(results.model_of_groups())));
  std::vector<Points> means;
  for (const cohort::GroupMean& mean : results.means) means.push_back(mean.momenta);
  const double factor = magnification(results.atlas, means);
  picture.shape_name = "mean of the group";
  if (factor > 1) picture.shape_name += fmt::format(", magnified {:g} times", factor);
  for (std::size_t g = 0; g < results.means.size(); ++g) {
    if (g % 3 == 0) picture.rows.emplace_back();
    const cohort::GroupMean& mean = results.means[g];
    std::string heading = fmt::format("{} ({})", mean.name, mean.size);
    if (factor > 1) heading += fmt::format(", × {:g}", factor);
    picture.rows.back().push_back(panel_of(results, heading, results.atlas.geodesic(factor * mean.momenta)));
  }
  write_shape_panels(picture, files);
}

}  // namespace

Points mode_momenta(const AtlasResults& results, int k, double deviations) {
  const double length = deviations * std::sqrt(results.modes.eigenvalues[k]);
  return length * results.modes.directions[static_cast<std::size_t>(k)];
}

Trajectory mode_path(const AtlasResults& results, int k, double deviations) {
  return results.atlas.geodesic(mode_momenta(results, k, deviations));
}

std::vector<std::string> AtlasPictures::stems() const {
  const bool has_shapes = dimension > 1;
  std::vector<std::string> stems;
  if (has_shapes) stems = {"template", "modes"};
  stems.insert(stems.end(), {"scores", "procrustes_scores", "scree"});
  if (has_shapes && has_regression) stems.emplace_back("regression");
  if (has_regression) stems.emplace_back("regression_scores");
  if (has_shapes && has_groups) stems.emplace_back("groups");
  if (has_shapes && has_models) stems.emplace_back("coefficients");
  return stems;
}

namespace {

void draw_picture(const std::string& stem, const AtlasResults& results, int modes, const draw::PictureFiles& files) {
  if (stem == "template")
    draw_template(results, files);
  else if (stem == "modes")
    draw_modes(results, modes, files);
  else if (stem == "scores")
    draw_scores(results, results.modes, "Scores of the momenta", files);
  else if (stem == "procrustes_scores")
    draw_scores(results, results.procrustes.modes, "Scores of Procrustes coordinates", files);
  else if (stem == "scree")
    draw_scree(results, files);
  else if (stem == "regression")
    draw_regression(results, files);
  else if (stem == "regression_scores")
    draw_regression_scores(results, files);
  else if (stem == "groups")
    draw_groups(results, files);
  else if (stem == "coefficients")
    draw_coefficients(results, files);
}

}  // namespace

void draw_atlas(const AtlasResults& results, int modes, RunResults& files) {
  const AtlasPictures pictures{results.atlas.template_shape.dimension(), results.regression.has_value(),
                               !results.means.empty(), !results.models.empty()};
  for (const std::string& stem : pictures.stems())
    files.draw(stem, [&](const draw::PictureFiles& of_stem) { draw_picture(stem, results, modes, of_stem); });
}

}  // namespace pulson
