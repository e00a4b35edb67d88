#include "pulson/cohort/atlas.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "core/determined.hpp"
#include "core/landmark_pairs.hpp"
#include "core/landmark_range.hpp"
#include "core/text.hpp"
#include "displacement_fit.hpp"
#include "geodesics.hpp"
#include "posed_shapes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"
#include "robust_model.hpp"
#include "template_search.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostFits = 30;
constexpr double kFitSettled = 1e-2;  // difference() of fits: as exact as the search for their parameters

AlignmentKind alignment_of(const std::vector<Landmarks>& shapes, const AtlasOptions& options) {
  if (options.align) return *options.align;
  return shapes.front().dimension() == 1 ? AlignmentKind::kNone : AlignmentKind::kSimilarity;
}

void check(const std::vector<Landmarks>& shapes, const AtlasOptions& options) {
  if (shapes.size() < 2) throw InputError("an atlas needs at least two shapes");
  for (const Landmarks& shape : shapes) {
    require_alike(shapes.front(), shape);
    require_usable_range(shape);
  }
  if (shapes.front().count() < 2) throw InputError("an atlas needs shapes of at least two landmarks");
  if (options.lambda) require_positive("lambda", *options.lambda);
  require_positive("tolerance", options.tolerance);
  if (options.steps < 1) throw InputError(fmt::format("steps is {}; it must be at least 1", options.steps));
  if (options.max_iterations < 1)
    throw InputError(fmt::format("max_iterations is {}; it must be at least 1", options.max_iterations));
}

void refuse_coincident(const Landmarks& mean) {
  if (const auto pair = find_coincident(mean.points))
    throw InputError(
        fmt::format("landmarks {} and {} of the mean shape lie at the same position; leave one of them out",
                    mean.describe(pair->first), mean.describe(pair->second)));
}

// Each shape placed by the motion that brings the mean nearest to it.
std::vector<AtlasSpecimen> aligned_with(const Landmarks& mean, const std::vector<Landmarks>& shapes,
                                        AlignmentKind kind) {
  std::vector<AtlasSpecimen> specimens(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    AtlasSpecimen& specimen = specimens[i];
    specimen.shape = shapes[i];
    specimen.centroid_size = centroid_size(shapes[i].points);
    Points& points = specimen.shape.points;
    for (const int a : incomplete_points(points)) points.col(a).setConstant(text::kMissing);
    require_determined(points, mean.points, kind, shapes[i].source);
    points = inverted(align(mean.points, points, kind)).apply(points);
    specimen.momenta = Points::Zero(points.rows(), points.cols());
  }
  return specimens;
}

// The shapes with the mean's landmarks where theirs are missing.
std::vector<Points> filled(std::vector<Points> shapes, const Points& mean) {
  for (Points& points : shapes)
    for (const int a : incomplete_points(points)) points.col(a) = mean.col(a);
  return shapes;
}

// The model of greatest likelihood. Where landmarks are missing, each round (EM) takes the expected scatter under the
// model before, with its poses and its mean.
CohortDisplacements fitted_model(Atlas& atlas, const CohortFitOptions& fit) {
  std::vector<Points> placed;
  for (const AtlasSpecimen& specimen : atlas.specimens) placed.push_back(specimen.shape.points);
  Points mean = atlas.mean.points;
  CohortDisplacements model = fit_cohort_displacements(filled(placed, mean), {}, fit);
  const bool is_complete = std::all_of(placed.begin(), placed.end(), [](const Points& p) { return p.allFinite(); });
  for (int round = 0; !is_complete && round < kMostFits; ++round) {
    const PosedShapes law(mean, atlas.alignment,
                          displacement_covariance(model.kernel, model.lambda, model.sigma, mean));
    ExpectedShapes expected = expected_shapes(law, placed);
    mean = updated_mean(law, expected.complete, atlas.alignment);
    placed = std::move(expected.placed);
    const CohortDisplacements before =
        std::exchange(model, fit_cohort_displacements(expected.complete, expected.uncertain, fit));
    if (difference(before, model, mean) <= kFitSettled) break;
  }
  for (std::size_t i = 0; i < placed.size(); ++i) atlas.specimens[i].shape.points = placed[i];
  return model;
}

// Degrees of freedom that mean and alignment leave.
Index free_coordinates(const Atlas& atlas) {
  const Index d = atlas.mean.points.rows(), parameters = alignment_parameters(atlas.alignment, d);
  Index coordinates = -d * atlas.mean.points.cols() + parameters;
  for (const AtlasSpecimen& specimen : atlas.specimens)
    coordinates += std::ssize(places_of(specimen.shape.points, true)) - parameters;
  return coordinates;
}

// Of width, λσ² and λ, those that are fitted must be fewer than these coordinates: else width and σ have the values
// that a registration without enough landmarks has by default.
void require_determined_model(Atlas& atlas, CohortFitOptions& fit) {
  const auto open = [&] { return (fit.kernel ? 0 : 1) + (fit.lambda ? 0 : 1) + (fit.sigma ? 0 : 1); };
  const Index coordinates = free_coordinates(atlas);
  if (open() > 0 && open() >= coordinates && !(fit.kernel && fit.sigma)) {
    const matching::RegistrationOptions defaults;
    if (!fit.kernel) fit.kernel = KernelChoice("matern32:alpha=100%").make(atlas.mean.points);
    if (!fit.sigma) fit.sigma = defaults.sigma.in(diameter(atlas.mean.points));
    atlas.notes.push_back(
        fmt::format("so few coordinates ({}) determine neither kernel nor sigma: {}, sigma {:.3g}; give more shapes, "
                    "or these as numbers",
                    std::max<Index>(coordinates, 0), fit.kernel->spec(4), *fit.sigma));
  }
  require_determined_parameters("lambda is", open(), coordinates, "give it as a number, or more shapes");
}

// What is given of the model, with numbers in length units.
CohortFitOptions given_of_model(Atlas& atlas, const AtlasOptions& options) {
  CohortFitOptions fit{{}, options.lambda, {}, atlas.alignment};
  const double size = diameter(atlas.mean.points);
  if (options.kernel) fit.kernel = options.kernel->make(atlas.mean.points);
  if (options.sigma) fit.sigma = options.sigma->in(size);
  if (fit.sigma && !(*fit.sigma >= 0))
    throw InputError(fmt::format("sigma is {}; it must be 0 or greater", *fit.sigma));
  if (options.loss && fit.sigma && *fit.sigma == 0)
    throw InputError("sigma is 0; a robust loss needs one that is greater than 0, or fitted");
  require_determined_model(atlas, fit);
  atlas.fitted_kernel = !fit.kernel;
  atlas.fitted_lambda = !fit.lambda;
  atlas.fitted_sigma = !fit.sigma;
  return fit;
}

// The mean of the expected shapes, and the shapes where these lie.
void place_by_expected(Atlas& atlas, std::vector<Landmarks> shapes, const std::vector<Points>& expected) {
  std::vector<Points> given;
  for (std::size_t i = 0; i < shapes.size(); ++i) given.push_back(std::exchange(shapes[i].points, expected[i]));
  atlas.mean = procrustes_mean(shapes, atlas.alignment);
  for (std::size_t i = 0; i < shapes.size(); ++i)
    atlas.specimens[i].shape.points = inverted(align(atlas.mean.points, expected[i], atlas.alignment)).apply(given[i]);
}

// Weights, and the model by these: at first by Tukey's loss and the scale of the median of all t², from the fit without
// weights, in which wrong landmarks make σ and the mean large; then by this loss and the scale of the fit.
CohortDisplacements robustly_fitted(Atlas& atlas, const std::vector<Landmarks>& shapes, const AtlasOptions& options,
                                    CohortDisplacements model) {
  std::vector<Points> given;
  for (const Landmarks& shape : shapes) given.push_back(shape.points);
  RobustShapes robust(matching::RobustLoss{}, atlas.mean.points, given.size());
  place_by_expected(atlas, shapes,
                    settle(robust, given, atlas.mean.points, given_of_model(atlas, options), std::nullopt, model));
  robust.take(*options.loss);
  settle(robust, given, atlas.mean.points, given_of_model(atlas, options), 1, model);
  atlas.loss = loss_spec(*options.loss, atlas.mean.points.rows());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    atlas.specimens[i].weights = robust.weights()[i];
    atlas.specimens[i].precisions = robust.precision(i);
  }
  return model;
}

// Kernel, λ and σ, where they are not given.
void fit_model(Atlas& atlas, const std::vector<Landmarks>& shapes, const AtlasOptions& options) {
  CohortDisplacements model = fitted_model(atlas, given_of_model(atlas, options));
  if (options.loss) model = robustly_fitted(atlas, shapes, options, model);
  atlas.kernel = model.kernel;
  atlas.lambda = model.lambda;
  atlas.sigma = model.sigma;
  atlas.beta = options.beta.in(diameter(atlas.mean.points));
  if (!(atlas.beta >= 0)) throw InputError(fmt::format("beta is {}; it must be 0 or greater", atlas.beta));
}

// Mean, poses and model.
void place_and_fit(Atlas& atlas, const std::vector<Landmarks>& shapes, const AtlasOptions& options) {
  atlas.mean = procrustes_mean(shapes, atlas.alignment);
  refuse_coincident(atlas.mean);
  if (const std::vector<int> alone = placed_as_given(shapes, atlas.alignment); !alone.empty())
    atlas.notes.push_back(fmt::format(
        "no shapes that can be aligned with one another have both landmark {} and the others: where it lies "
        "beside these is taken from one shape's coordinates as they are",
        all_listed(shapes.front(), alone)));
  atlas.specimens = aligned_with(atlas.mean, shapes, atlas.alignment);
  fit_model(atlas, shapes, options);
}

void note_suspects(Atlas& atlas) {
  for (const AtlasSpecimen& specimen : atlas.specimens)
    if (const std::vector<int> suspects = specimen.suspects(); !suspects.empty())
      atlas.notes.push_back(matching::note_of_suspects(specimen.shape, suspects));
}

}  // namespace

VectorXd AtlasSpecimen::distances() const { return (result - shape.points).colwise().norm().transpose(); }

double AtlasSpecimen::rms() const {
  const VectorXd all = distances(), of = weights.size() > 0 ? weights : VectorXd::Ones(all.size());
  double sum = 0, count = 0;
  for (Index a = 0; a < all.size(); ++a)
    if (std::isfinite(all[a])) sum += of[a] * all[a] * all[a], count += of[a];
  return std::sqrt(sum / count);
}

std::vector<int> AtlasSpecimen::suspects() const {
  std::vector<int> found;
  for (int a = 0; a < static_cast<int>(weights.size()); ++a)
    if (weights[a] < matching::kSuspectWeight) found.push_back(a);
  return found;
}

Points AtlasSpecimen::without_suspects() const {
  Points points = shape.points;
  for (const int a : suspects()) points.col(a).setConstant(text::kMissing);
  return points;
}

MatrixXd Atlas::metric() const {
  MatrixXd gram = kernel.gram(template_shape.points, template_shape.points);
  gram.diagonal().array() += nugget();
  return gram;
}

Trajectory Atlas::geodesic(const Points& p0) const {
  return Geodesics(kernel, steps, lambda, beta).path(template_shape.points, p0);
}

double Atlas::exp_log_error() const {
  double largest = 0;
  for (const AtlasSpecimen& specimen : specimens)
    for (const double distance : specimen.distances())
      if (std::isfinite(distance)) largest = std::max(largest, distance);
  return largest / diameter(template_shape.points);
}

Atlas make_atlas(const std::vector<Landmarks>& shapes, const AtlasOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const SerialBlas serial;
  check(shapes, options);
  Atlas atlas;
  atlas.alignment = alignment_of(shapes, options);
  atlas.steps = options.steps;
  place_and_fit(atlas, shapes, options);
  note_suspects(atlas);
  atlas.template_shape = atlas.mean;
  atlas.template_shape.name = "template";
  search_template(atlas, options);
  atlas.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return atlas;
}

}  // namespace pulson::cohort
