#include "shape_space.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>
#include <fmt/format.h>

#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/picture.hpp"
#include "warp/picture_files.hpp"

namespace pulson {
namespace {

constexpr int kMostScores = 3;
constexpr int kDegree = 3;
constexpr int kSpaceCells = 12, kPointsPerSpaceCell = 2;
constexpr double kSpaceMargin = 0.12;  // of the grid, as that of the mean picture
constexpr std::size_t kMostChecked = 12;

using Scores = Eigen::VectorXd;

/// Exponents of all terms up to the degree, the constant first.
std::vector<std::vector<int>> powers_of(int scores) {
  std::vector<std::vector<int>> all{std::vector<int>(static_cast<std::size_t>(scores), 0)};
  for (int k = 0; k < scores; ++k) {
    std::vector<std::vector<int>> more;
    for (const std::vector<int>& known : all) {
      int sum = 0;
      for (const int power : known) sum += power;
      for (int power = 0; power <= kDegree - sum; ++power) {
        more.push_back(known);
        more.back()[static_cast<std::size_t>(k)] = power;
      }
    }
    all = std::move(more);
  }
  return all;
}

double term(const std::vector<int>& powers, const Scores& scores) {
  double product = 1;
  for (Eigen::Index k = 0; k < scores.size(); ++k) product *= std::pow(scores[k], powers[static_cast<std::size_t>(k)]);
  return product;
}

/// Where geodesics are shot: along each score, and with the signs of two or all together, within the range.
std::vector<Scores> design_of(int scores, double range) {
  std::vector<Scores> design{Scores::Zero(scores)};
  for (int k = 0; k < scores; ++k)
    for (const double part : {-1.0, -0.5, 0.5, 1.0}) design.emplace_back(part * range * Scores::Unit(scores, k));
  for (int k = 0; k < scores; ++k)
    for (int j = 0; j < k; ++j)
      for (const int signs : {0, 1, 2, 3})
        design.emplace_back(
            range * std::sqrt(0.5) *
            ((signs & 1 ? 1 : -1) * Scores::Unit(scores, k) + (signs & 2 ? 1 : -1) * Scores::Unit(scores, j)));
  if (scores > 2)
    for (int signs = 0; signs < 8; ++signs)
      design.emplace_back(range * std::sqrt(1.0 / 3) *
                          Eigen::Vector3d(signs & 1 ? 1 : -1, signs & 2 ? 1 : -1, signs & 4 ? 1 : -1));
  return design;
}

Trajectory path_to(const AtlasResults& results, const Scores& scores) {
  Points momenta = Points::Zero(results.atlas.template_shape.dimension(), results.atlas.template_shape.count());
  for (Eigen::Index k = 0; k < scores.size(); ++k)
    momenta +=
        scores[k] * std::sqrt(results.modes.eigenvalues[k]) * results.modes.directions[static_cast<std::size_t>(k)];
  return results.atlas.geodesic(momenta);
}

/// The coefficients of each coordinate, least squares. @param values of the design, all of one size
std::vector<Points> fitted_terms(const std::vector<std::vector<int>>& powers, const std::vector<Scores>& design,
                                 const std::vector<Points>& values) {
  Eigen::MatrixXd terms(std::ssize(design), std::ssize(powers)), sides(std::ssize(design), values.front().size());
  for (Eigen::Index i = 0; i < terms.rows(); ++i) {
    for (Eigen::Index t = 0; t < terms.cols(); ++t)
      terms(i, t) = term(powers[static_cast<std::size_t>(t)], design[static_cast<std::size_t>(i)]);
    sides.row(i) = values[static_cast<std::size_t>(i)].reshaped().transpose();
  }
  const Eigen::MatrixXd found = terms.colPivHouseholderQr().solve(sides);
  std::vector<Points> list;
  for (const auto& row : found.rowwise()) list.emplace_back(row.reshaped(values.front().rows(), values.front().cols()));
  return list;
}

Points value_at(const html::ReportShapeSpace& space, const Scores& scores) {
  Points sum = Points::Zero(space.terms.front().rows(), space.terms.front().cols());
  for (std::size_t t = 0; t < space.terms.size(); ++t) sum += term(space.powers[t], scores) * space.terms[t];
  return sum;
}

/// Scores in standard deviations.
Scores scores_of(const AtlasResults& results, std::size_t specimen, Eigen::Index count) {
  Scores scores(count);
  for (Eigen::Index k = 0; k < count; ++k)
    scores[k] = results.modes.scores(static_cast<Eigen::Index>(specimen), k) / std::sqrt(results.modes.eigenvalues[k]);
  return scores;
}

/// The largest distance of a landmark of the polynomial from the geodesic, at scores of specimens within the range,
/// over the diameter.
double error_of(const AtlasResults& results, const html::ReportShapeSpace& space, Eigen::Index count) {
  const std::size_t step = (results.names.size() + kMostChecked - 1) / kMostChecked;
  double most = 0;
  for (std::size_t i = 0; i < results.names.size(); i += step) {
    const Scores scores = scores_of(results, i, count).cwiseMax(-space.range).cwiseMin(space.range);
    most = std::max(most, (value_at(space, scores) - path_to(results, scores).final().q).colwise().norm().maxCoeff());
  }
  return most / diameter(results.atlas.template_shape.points);
}

/// The grid about the template, and where it is at each point of the design.
void add_grid(const AtlasResults& results, const std::vector<Trajectory>& paths, const std::vector<Scores>& design,
              const std::optional<CohortPictures>& pictures, html::ReportShapeSpace& space) {
  if (results.atlas.template_shape.dimension() != 2) return;
  Eigen::Vector2d low, high;
  if (pictures) {
    low = pictures->low, high = pictures->high;
  } else {
    const auto [from, to] = bounding_box(results.atlas.template_shape.points);
    const double margin = kSpaceMargin * (to - from).maxCoeff();
    low = from.array() - margin, high = to.array() + margin;
  }
  const std::vector<Points> lines = grid_lines(low, high, kSpaceCells, kPointsPerSpaceCell);
  const Points joined = joined_lines(lines);
  std::vector<Points> grids;
  try {
    for (const Trajectory& path : paths)
      grids.push_back(warp::MaterialFlow({results.atlas.kernel, make_noise("none", {})}, path).end(joined));
  } catch (const StepError&) {  // the plane between the landmarks has no path though they have one
    return;
  }
  space.grid_terms = fitted_terms(space.powers, design, grids);
  space.shapes.grid.assign(space.shapes.times.size(), joined);
  for (const Points& line : lines) space.shapes.lines.push_back(static_cast<int>(line.cols()));
  if (!pictures) return;
  const bool y_down = results.atlas.template_shape.frame.y_down;
  const auto columns = static_cast<int>(
      std::count_if(lines.begin(), lines.end(), [](const Points& line) { return line(0, 0) == line(0, 1); }));
  space.shapes.image = html::MotionImage{
      jpeg_of(pictures->mean), {0, y_down ? 0 : 1}, {1, y_down ? 1 : 0}, columns, kPointsPerSpaceCell};
}

std::optional<html::ReportShapeSpace> space_within(const AtlasResults& results, int scores, double range,
                                                   const std::optional<CohortPictures>& pictures) try {
  html::ReportShapeSpace space;
  space.range = range;
  space.powers = powers_of(scores);
  const std::vector<Scores> design = design_of(scores, range);
  std::vector<Trajectory> paths;
  for (const Scores& at : design) paths.push_back(path_to(results, at));
  html::ReportMotion& shapes = space.shapes;
  shapes.source = results.atlas.template_shape;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    shapes.times.push_back(static_cast<double>(i));
    shapes.frames.push_back(paths[i].final().q);
  }
  space.terms = fitted_terms(space.powers, design, shapes.frames);
  add_grid(results, paths, design, pictures, space);
  return space;
} catch (const StepError&) {
  return std::nullopt;
}

void add_specimens(const AtlasResults& results, const std::optional<CohortPictures>& pictures,
                   html::ReportShapeSpace& space) {
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    const Scores scores = scores_of(results, i, std::ssize(space.axes));
    html::ReportShapeSpace::Specimen specimen{
        results.names[i], results.groups.empty() ? "" : results.groups[i], {scores.begin(), scores.end()}, {}};
    if (pictures && space.shapes.image && pictures->each[i]) specimen.picture = jpeg_of(*pictures->each[i]);
    space.specimens.push_back(std::move(specimen));
  }
}

}  // namespace

std::optional<html::ReportShapeSpace> shape_space(const AtlasResults& results, int modes,
                                                  const std::optional<CohortPictures>& pictures) {
  if (results.atlas.template_shape.dimension() < 2) return std::nullopt;
  const int scores = std::min({kMostScores, modes, static_cast<int>(results.modes.eigenvalues.size())});
  if (scores < 1) return std::nullopt;
  std::optional<html::ReportShapeSpace> space;
  for (const double range : {3.0, 2.0, 1.0})
    if (!space) space = space_within(results, scores, range, pictures);
  if (!space) return std::nullopt;
  for (int k = 0; k < scores; ++k)
    space->axes.push_back(
        fmt::format("mode {} ({:.1f} %)", k + 1, 100 * results.modes.eigenvalues[k] / results.modes.total()));
  add_specimens(results, pictures, *space);
  space->caption = fmt::format(
      "Sliders: scores in standard deviations. A click on the map shows the shape there{}, or on a dot that of the "
      "specimen by its first {}{}. At the specimens' scores, landmarks are within {:.1g} % of the diameter of those "
      "that "
      "are shot.",
      space->shapes.image ? ", with the mean picture" : "", scores == 1 ? "score" : fmt::format("{} scores", scores),
      space->shapes.image ? ", with its own picture" : "", 100 * error_of(results, *space, scores));
  return space;
}

}  // namespace pulson
