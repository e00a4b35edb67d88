#include "pulson/cohort/atlas.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "anderson.hpp"
#include "core/determined.hpp"
#include "core/landmark_range.hpp"
#include "core/text.hpp"
#include "core/undefined.hpp"
#include "displacement_fit.hpp"
#include "geodesics.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMatched = 1e-12;       // defect of a match, in diameters
constexpr double kRoundOff = 1e-8;       // one that counts as converged where the search cannot do better
constexpr double kBelowMovement = 1e-3;  // defects, beside the last movement of the template
constexpr double kUnmatched = 0.01;      // defect of a specimen that has no weight in the template, in diameters
constexpr int kTemplateWindow = 5;
constexpr double kCoarse = 1e-4;  // step error, in diameters, that is reported

std::vector<Index> observed_landmarks(const Points& points) {
  std::vector<Index> observed;
  for (Index a = 0; a < points.cols(); ++a)
    if (points.col(a).allFinite()) observed.push_back(a);
  return observed;
}

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

// Each shape aligned with the mean.
std::vector<AtlasSpecimen> aligned_with(const Landmarks& mean, const std::vector<Landmarks>& shapes,
                                        AlignmentKind kind) {
  std::vector<AtlasSpecimen> specimens(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    AtlasSpecimen& specimen = specimens[i];
    specimen.shape = shapes[i];
    specimen.centroid_size = centroid_size(shapes[i].points);
    Points& points = specimen.shape.points;
    for (const int a : incomplete_points(points)) points.col(a).setConstant(io::kMissing);
    require_determined(points, mean.points, kind, shapes[i].source);
    if (kind != AlignmentKind::kNone) points = align(points, mean.points, kind).apply(points);
    specimen.momenta = Points::Zero(points.rows(), points.cols());
  }
  return specimens;
}

// Where landmarks are missing, to first order the most probable positions given the others.
std::vector<Points> completed(const std::vector<AtlasSpecimen>& specimens, const Points& mean,
                              const CohortDisplacements* model) {
  std::vector<Points> complete;
  std::optional<TemplateMetric> metric;
  if (model != nullptr) metric.emplace(model->kernel, 0, model->lambda * model->sigma * model->sigma, mean);
  for (const AtlasSpecimen& specimen : specimens) {
    Points points = specimen.shape.points;
    if (const std::vector<int> missing = incomplete_points(points); !missing.empty()) {
      Points moved = mean;
      if (metric) {
        const MatchModel match(*metric, observed_landmarks(points));
        Points displacement = points - mean;
        displacement(Eigen::all, missing).setZero();
        moved += metric->velocity(match.momenta(displacement));
      }
      points(Eigen::all, missing) = moved(Eigen::all, missing);
    }
    complete.push_back(std::move(points));
  }
  return complete;
}

// Coordinates beyond mean and alignment.
Index free_coordinates(const Atlas& atlas) {
  const Index d = atlas.mean.points.rows(), parameters = alignment_parameters(atlas.alignment, d);
  Index coordinates = -d * atlas.mean.points.cols() + parameters;
  for (const AtlasSpecimen& specimen : atlas.specimens)
    coordinates += d * std::ssize(observed_landmarks(specimen.shape.points)) - parameters;
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

// Kernel, λ and σ, where they are not given.
void fit_model(Atlas& atlas, const AtlasOptions& options) {
  CohortFitOptions fit{{}, options.lambda, {}, atlas.alignment};
  const double size = diameter(atlas.mean.points);
  if (options.kernel) fit.kernel = options.kernel->make(atlas.mean.points);
  if (options.sigma) fit.sigma = options.sigma->in(size);
  if (fit.sigma && !(*fit.sigma >= 0))
    throw InputError(fmt::format("sigma is {}; it must be 0 or greater", *fit.sigma));
  require_determined_model(atlas, fit);
  CohortDisplacements model = fit_cohort_displacements(completed(atlas.specimens, atlas.mean.points, nullptr), fit);
  const bool has_missing = std::any_of(atlas.specimens.begin(), atlas.specimens.end(), [](const auto& specimen) {
    return !incomplete_points(specimen.shape.points).empty();
  });
  for (int round = 0; has_missing && round < 3; ++round)
    model = fit_cohort_displacements(completed(atlas.specimens, atlas.mean.points, &model), fit);
  atlas.kernel = model.kernel;
  atlas.lambda = model.lambda;
  atlas.sigma = model.sigma;
  atlas.fitted_kernel = !fit.kernel;
  atlas.fitted_lambda = !fit.lambda;
  atlas.fitted_sigma = !fit.sigma;
  atlas.beta = options.beta.in(size);
  if (!(atlas.beta >= 0)) throw InputError(fmt::format("beta is {}; it must be 0 or greater", atlas.beta));
}

// λ∫H dt, ½∫|u|² dt with u = λβp, and the data term.
matching::MatchingCost cost_of(const Atlas& atlas, const Trajectory& path, const AtlasSpecimen& specimen) {
  const double nugget = atlas.nugget();
  matching::MatchingCost cost;
  const double total =
      atlas.lambda * (hamiltonian(atlas.kernel, path.initial()) + 0.5 * nugget * path.initial().p.squaredNorm());
  for (int k = 0; nugget > 0 && k < path.grid.steps; ++k) {
    const auto square = [&](int i) { return path.states[static_cast<std::size_t>(i)].p.squaredNorm(); };
    cost.action += 0.5 * atlas.lambda * nugget * path.grid.dt() * 0.5 * (square(k) + square(k + 1));
  }
  cost.energy = total - cost.action;
  if (atlas.sigma > 0)
    for (const double distance : specimen.distances())
      if (std::isfinite(distance)) cost.data += 0.5 * std::pow(distance / atlas.sigma, 2);
  return cost;
}

// The search for a template, and the momenta that match its specimens.
class TemplateSearch {
 public:
  TemplateSearch(Atlas& atlas, const AtlasOptions& options)
      : atlas_(atlas),
        options_(options),
        size_(diameter(atlas.mean.points)),
        geodesics_(atlas.kernel, options.steps, atlas.lambda, atlas.beta) {
    for (const AtlasSpecimen& specimen : atlas.specimens)
      observed_.push_back(observed_landmarks(specimen.shape.points));
  }

  void run() {
    Anderson search(kTemplateWindow);
    Points& q0 = atlas_.template_shape.points;
    double tolerance = kBelowMovement;
    for (atlas_.iterations = 1;; ++atlas_.iterations) {
      const TemplateMetric metric(atlas_.kernel, atlas_.nugget(), atlas_.lambda * atlas_.sigma * atlas_.sigma, q0);
      match_all(metric, size_ * std::max(kMatched, kBelowMovement * tolerance));
      const Points mean = mean_momenta();
      const Points step = metric.displacement(mean);
      atlas_.movement = step.norm() / std::sqrt(static_cast<double>(step.cols())) / size_;
      if (options_.on_iteration) options_.on_iteration(atlas_.iterations, atlas_.movement);
      atlas_.converged = atlas_.movement <= options_.tolerance;
      if (atlas_.converged && tolerance <= options_.tolerance) break;
      if (atlas_.iterations >= options_.max_iterations || search.is_lost()) break;
      tolerance = atlas_.converged ? options_.tolerance : atlas_.movement;
      if (atlas_.converged) continue;  // once more, with matches as accurate
      q0 = search.next(q0.reshaped(), -step.reshaped()).reshaped(q0.rows(), q0.cols());
      for (AtlasSpecimen& specimen : atlas_.specimens) specimen.momenta -= mean;
    }
    finish();
  }

 private:
  void match_all(const TemplateMetric& metric, double tolerance) {
    std::vector<Index> all(static_cast<std::size_t>(metric.shape().cols()));
    std::iota(all.begin(), all.end(), 0);
    const MatchModel complete(metric, all);
    std::vector<double> shots(atlas_.specimens.size());
    share(
        [&](int i) {
          const auto s = static_cast<std::size_t>(i);
          AtlasSpecimen specimen = atlas_.specimens[s];
          const int count = observed_[s].size() == all.size()
                                ? match(metric, complete, specimen, tolerance)
                                : match(metric, MatchModel(metric, observed_[s]), specimen, tolerance);
          VectorXd made(2 * specimen.momenta.size() + 3);
          made << specimen.momenta.reshaped(), specimen.result.reshaped(), specimen.defect,
              specimen.converged ? 1.0 : 0.0, count;
          return made;
        },
        [&](int i, const VectorXd& made) {
          AtlasSpecimen& specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          const Points& q0 = metric.shape();
          specimen.momenta = made.head(q0.size()).reshaped(q0.rows(), q0.cols());
          specimen.result = made.segment(q0.size(), q0.size()).reshaped(q0.rows(), q0.cols());
          specimen.defect = made[made.size() - 3];
          specimen.converged = made[made.size() - 2] != 0;
          shots[static_cast<std::size_t>(i)] = made[made.size() - 1];
        });
    for (const double count : shots) atlas_.shots += static_cast<long>(count);
  }

  void share(const std::function<VectorXd(int)>& make, const std::function<void(int, const VectorXd&)>& store) const {
    const int count = static_cast<int>(atlas_.specimens.size());
    if (options_.share)
      options_.share(count, make, store);
    else
      parallel_for(count, [&](int i) { store(i, make(i)); });
  }

  int match(const TemplateMetric& metric, const MatchModel& model, AtlasSpecimen& specimen, double tolerance) const {
    const auto from = [&](const Points& start) {
      return geodesics_.match(metric, model, specimen.shape.points, start, tolerance);
    };
    GeodesicMatch found;
    try {
      found = from(specimen.momenta);
    } catch (const StepError&) {
      found = from(Points::Zero(specimen.momenta.rows(), specimen.momenta.cols()));
    }
    int shots = found.shots;
    if (!found.converged && found.defect > kRoundOff * size_) {
      if (const std::optional<Points> start = path_search(metric, specimen)) {
        found = from(*start);
        shots += found.shots;
      }
    }
    specimen.momenta = found.momenta;
    specimen.result = found.end.q;
    specimen.defect = found.defect;
    specimen.converged = found.converged || found.defect <= kRoundOff * size_;
    return shots;
  }

  // The momenta that a search over paths finds, for targets that are too far away to be shot at.
  std::optional<Points> path_search(const TemplateMetric& metric, const AtlasSpecimen& specimen) const {
    Landmarks source = atlas_.template_shape;
    source.points = metric.shape();
    matching::RegistrationOptions options;
    options.kernel = atlas_.kernel;
    if (atlas_.beta > 0) options.noise = fmt::format("ch-sd:beta={}", atlas_.beta);
    options.lambda = atlas_.lambda;
    options.sigma = std::max(atlas_.sigma, 1e-4 * size_);
    options.align = AlignmentKind::kNone;
    options.grid = geodesics_.grid();
    try {
      return register_shapes(source, specimen.shape, options).momenta;
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  // Of the specimens that are matched: another's momenta mean nothing.
  Points mean_momenta() const {
    Points sum = Points::Zero(atlas_.mean.points.rows(), atlas_.mean.points.cols());
    double count = 0;
    for (const AtlasSpecimen& specimen : atlas_.specimens)
      if (specimen.defect <= std::max(kUnmatched, 0.1 * atlas_.sigma / size_) * size_) {
        sum += specimen.momenta;
        count += 1;
      }
    return count > 0 ? Points(sum / count) : sum;
  }

  void finish() {
    const Geodesics finer(atlas_.kernel, 2 * options_.steps, atlas_.lambda, atlas_.beta);
    const Points& q0 = atlas_.template_shape.points;
    std::vector<double> errors(atlas_.specimens.size());
    share(
        [&](int i) {
          AtlasSpecimen specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          const Trajectory path = geodesics_.path(q0, specimen.momenta);
          specimen.result = path.final().q;
          const matching::MatchingCost cost = cost_of(atlas_, path, specimen);
          const double error = (finer.shoot(q0, specimen.momenta).q - specimen.result).norm() /
                               std::sqrt(static_cast<double>(q0.cols())) / size_;
          VectorXd made(q0.size() + 4);
          made << specimen.result.reshaped(), cost.energy, cost.action, cost.data, error;
          return made;
        },
        [&](int i, const VectorXd& made) {
          AtlasSpecimen& specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          specimen.result = made.head(q0.size()).reshaped(q0.rows(), q0.cols());
          specimen.cost = {made[q0.size()], made[q0.size() + 1], made[q0.size() + 2]};
          errors[static_cast<std::size_t>(i)] = made[q0.size() + 3];
        });
    atlas_.step_error = std::accumulate(errors.begin(), errors.end(), 0.0, max_or_undefined);
    if (!(atlas_.step_error <= kCoarse))
      atlas_.notes.push_back(
          fmt::format("twice the steps move an end by {:.2g} diameters: more steps are needed", atlas_.step_error));
  }

  Atlas& atlas_;
  const AtlasOptions& options_;
  double size_;
  Geodesics geodesics_;
  std::vector<std::vector<Index>> observed_;
};

}  // namespace

VectorXd AtlasSpecimen::distances() const { return (result - shape.points).colwise().norm().transpose(); }

double AtlasSpecimen::rms() const {
  double sum = 0, count = 0;
  for (const double distance : distances())
    if (std::isfinite(distance)) sum += distance * distance, count += 1;
  return std::sqrt(sum / count);
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
  atlas.mean = procrustes_mean(shapes, atlas.alignment);
  refuse_coincident(atlas.mean);
  atlas.specimens = aligned_with(atlas.mean, shapes, atlas.alignment);
  fit_model(atlas, options);
  atlas.template_shape = atlas.mean;
  atlas.template_shape.name = "template";
  TemplateSearch(atlas, options).run();
  atlas.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return atlas;
}

}  // namespace pulson::cohort
