#include "registration_problem.hpp"

#include <cmath>

#include <Eigen/QR>
#include <fmt/core.h>

#include "core/determined.hpp"
#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "curve_alignment.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"
#include "registration_input.hpp"

namespace pulson::matching {
namespace {

// Widths of kernels that nothing is fitted to, in diameters: few landmarks move together, outlines have detail.
constexpr double kWidthOfFew = 1;
constexpr double kWidthOfCurves = 0.25;
// Of the data, in their own width, where searches in curves begin. From rest in the data's own width two skulls are not
// matched in 1000 iterations (J 4.5 aligned by similarity, 1800 by translation); from the path of four times the width
// they are in 295 and 404 (0.88, 1.04).
constexpr double kCoarseData = 4;
// Of realisations: 20 steps doubled until a search in drawn noise takes no more.
constexpr int kFinestSteps = 1280;

bool searches_paths(const RegistrationOptions& options) {
  return options.minimise.solver == Solver::kAuto || options.minimise.solver == Solver::kPaths;
}

// By the steps of (20); where there is nothing to compensate those as printed are the same.
bool asks_for_paper(const RegistrationOptions& options) {
  return options.integrator == "variational" || options.integrator == "variational-paper";
}

// Metamorphosis is searched for over paths in midpoint steps, or shot by those of (20); other wishes, and
// probabilities, are of mode map.
MatchingMode usual_mode(const RegistrationOptions& options, const NoiseModel& noise, bool noisy) {
  if (!noisy) return MatchingMode::kDeterministic;
  const bool is_auto = options.integrator == "auto";
  const bool shot = options.minimise.solver == Solver::kShooting && (is_auto || asks_for_paper(options));
  const bool along_path = shot || (searches_paths(options) && (is_auto || options.integrator == "midpoint"));
  return noise.traits().linear && along_path && !options.uncertainty ? MatchingMode::kMetamorphosis
                                                                     : MatchingMode::kMap;
}

MatchingMode choose_mode(const RegistrationOptions& options, const NoiseModel& noise, bool noisy) {
  const MatchingMode mode = options.mode.value_or(usual_mode(options, noise, noisy));
  if (mode != MatchingMode::kDeterministic && !noisy)
    throw InputError(
        fmt::format("mode {} {} the noise, and there is none; give one, as in `noise = ch-sd:beta=1`", mode_name(mode),
                    mode == MatchingMode::kMap || mode == MatchingMode::kMetamorphosis ? "fits" : "draws"));
  if (mode == MatchingMode::kMetamorphosis && !noise.traits().linear)
    throw InputError(
        fmt::format("mode metamorphosis needs noise whose potentials are linear in the momenta, such as "
                    "ch-sd or p-sd; for '{}' there is mode map",
                    noise.spec()));
  if (mode == MatchingMode::kMetamorphosis && options.uncertainty)
    throw InputError("uncertainties are those of mode map, whose cost is the logarithm of a probability");
  if (mode == MatchingMode::kExpected && options.samples < 1)
    throw InputError(fmt::format("samples is {}; mode expected needs at least 1", options.samples));
  return mode;
}

// Whether noise takes two landmarks apart that are at one place, along each axis: in metamorphosis, where it moves one
// otherwise than the other.
bool may_separate(const Landmarks& source, int first, int second, const RegistrationOptions& options) {
  const std::shared_ptr<const NoiseModel> noise = options.noise.make(source);
  const int d = source.dimension(), channels = noise->channels(d, source.count());
  if (channels == 0 || options.mode.value_or(usual_mode(options, *noise, true)) != MatchingMode::kMetamorphosis ||
      !noise->traits().linear)
    return false;
  const Points none = Points::Zero(d, source.count());
  Eigen::MatrixXd apart(channels, d);
  for (int axis = 0; axis < d; ++axis) {
    PhaseState with{none, none};
    with.p(axis, first) = 1;
    with.p(axis, second) = -1;
    apart.col(axis) = noise->contract({source.points, none}, with);
  }
  return apart.colPivHouseholderQr().rank() == d;
}

std::string integrator_of_metamorphosis(const RegistrationOptions& options) {
  const bool is_auto = options.integrator == "auto";
  const bool by_paths = searches_paths(options) && (is_auto || options.integrator == "midpoint");
  if (by_paths) return "midpoint";
  if (options.minimise.solver != Solver::kPaths && (is_auto || asks_for_paper(options))) return "variational";
  throw InputError(
      options.minimise.solver == Solver::kPaths
          ? fmt::format("solver paths takes steps of 'midpoint', not of '{}'; with solver shooting mode metamorphosis "
                        "takes those of 'variational'",
                        options.integrator)
          : fmt::format("mode metamorphosis is searched for over paths in steps of 'midpoint', or shot in those of "
                        "'variational'; integrator '{}' goes with mode map",
                        options.integrator));
}

// The search over paths takes midpoint steps, and holds a matrix of dN×dN for each.
std::string choose_integrator(const RegistrationOptions& options, MatchingMode mode) {
  if (mode == MatchingMode::kMetamorphosis) return integrator_of_metamorphosis(options);
  if (options.integrator != "auto") return options.integrator;
  const bool drawn = mode == MatchingMode::kPathwise || mode == MatchingMode::kExpected;
  if (options.minimise.solver == Solver::kShooting || drawn) return "variational";
  if (mode != MatchingMode::kDeterministic || !searches_paths(options)) return "variational-2";
  return options.data.kind == DataKind::kLandmarks ? "rk4" : "midpoint";
}

// On a line there is nothing to turn, and a motion would hide what the landmarks do.
AlignmentKind choose_alignment(const RegistrationOptions& options, int dimension) {
  if (options.align) return *options.align;
  return dimension == 1 ? AlignmentKind::kNone : AlignmentKind::kSimilarity;
}

CurveMeasure measure_of(const DataOptions& data) {
  return data.kind == DataKind::kVarifold ? CurveMeasure::kVarifold : CurveMeasure::kCurrent;
}

// A motion of least squares takes one weight for each landmark: 1 over its mean variance along the axes.
Eigen::VectorXd alignment_weights(const DataOptions& data) {
  if (data.covariances.empty()) return data.weights;
  Eigen::VectorXd weights = landmark_weights(data.weights, std::ssize(data.covariances));
  for (Eigen::Index a = 0; a < weights.size(); ++a) {
    const Eigen::MatrixXd& covariance = data.covariances[static_cast<std::size_t>(a)];
    weights[a] *= static_cast<double>(covariance.rows()) / covariance.trace();
  }
  return weights;
}

Alignment find_alignment(const MatchingShapes& shapes, const RegistrationOptions& options) {
  const AlignmentKind kind = choose_alignment(options, shapes.source.dimension());
  const DataOptions& data = shapes.data;
  if (data.kind == DataKind::kLandmarks)
    return align(shapes.source.points, shapes.target.points, kind,
                 {.weights = alignment_weights(data), .reflect = options.reflect});
  const Curve target = make_curve(shapes.target, data.ends);
  return align_curves({shapes.source.points, shapes.source_edges}, target, kind,
                      {measure_of(data), *data.width, options.reflect});
}

// y that points up in one file and down in the other is common, and no flow that keeps orientation mends it well.
void note_mirrored_shapes(MatchingShapes& shapes, const RegistrationOptions& options) {
  const Points& source = shapes.source.points;
  const Points& target = shapes.target.points;
  const Eigen::Index known = target.array().isFinite().colwise().all().count();
  if (options.reflect || source.rows() < 2 || known <= source.rows() + 1) return;
  const Eigen::VectorXd weights = alignment_weights(shapes.data);
  const auto apart = [&](bool reflect) {
    const Points moved =
        align(source, target, AlignmentKind::kSimilarity, {.weights = weights, .reflect = reflect}).apply(source);
    const Eigen::ArrayXXd squares = (moved - target).array().square();
    return std::sqrt(squares.isNaN().select(0, squares).sum() / static_cast<double>(source.cols()));
  };
  constexpr double kMuchCloser = 0.3, kNearlyAlike = 0.02;
  const double as_it_is = apart(false), turned_over = apart(true);
  if (turned_over > kMuchCloser * as_it_is || as_it_is < kNearlyAlike * diameter(target)) return;
  shapes.notes.push_back(
      fmt::format("the shapes look mirrored: aligned they are {:.3g} apart, and {:.3g} if one is reflected; if y "
                  "points up in one file and down in the other use `points.row(1) *= -1`, else `reflect`",
                  as_it_is, turned_over));
}

std::shared_ptr<const DataTerm> landmark_data(const Landmarks& target, const DataOptions& data, double sigma) {
  return std::make_shared<LandmarkTerm>(LandmarkObservations{target.points, sigma, data.weights, data.covariances});
}

// @param widening of the data's width
std::shared_ptr<const DataTerm> curve_data(const MatchingShapes& shapes, double sigma, double widening = 1) {
  return std::make_shared<CurveTerm>(shapes.source_edges, shapes.source.count(),
                                     make_curve(shapes.target, shapes.data.ends),
                                     CurveTermOptions{measure_of(shapes.data), sigma, widening * *shapes.data.width});
}

// The kernel, λ and σ in numbers, for an aligned source.
struct Scales {
  KernelOperator kernel;
  double lambda = 1;
  double sigma = 0;
  std::optional<DisplacementModel> fitted;
};

double length_scale(const Points& q0) {
  const double size = diameter(q0);
  if (!(size > 0))
    throw InputError(
        "the source has no two distinct landmarks, and so no size: kernel, lambda and sigma must be numbers");
  return size;
}

Scales choose_scales(const MatchingShapes& shapes, const Points& q0, const RegistrationOptions& options,
                     AlignmentKind alignment) {
  const bool is_auto = options.kernel.spec() == "auto";
  const double size = is_auto || options.sigma.is_relative() || !options.lambda ? length_scale(q0) : 0;
  const double sigma = options.sigma.in(size);
  require_positive("sigma", sigma);
  const double lambda = options.lambda.value_or(1 / (size * size));
  if (!is_auto) return {options.kernel.make(q0), lambda, sigma, std::nullopt};
  DisplacementOptions model;
  model.alignment = alignment;
  model.sigma = sigma;
  model.lambda = options.lambda;
  model.weights = shapes.data.weights;
  model.covariances = shapes.data.covariances;
  const bool curves = shapes.data.kind != DataKind::kLandmarks;
  if (!curves)
    if (const auto fitted = fit_displacements(q0, shapes.target.points, model))
      return {KernelOperator({fitted->kernel}), fitted->lambda, sigma, fitted};
  const double width = (curves ? kWidthOfCurves : kWidthOfFew) * size;
  return {KernelOperator({{model.profile, width, 1}}), lambda, sigma, std::nullopt};
}

void check_loss(const MatchingShapes& shapes) {
  if (shapes.data.kind != DataKind::kLandmarks)
    throw InputError("a loss is for `data.kind = landmarks`: curves have no corresponding points");
  if (!shapes.data.covariances.empty())
    throw InputError("a loss fits one sigma for all landmarks, and covariances give each its own; take one of the two");
}

RobustOptions robust_options(const Points& q0, const RegistrationOptions& options, AlignmentKind alignment,
                             const Eigen::VectorXd& weights) {
  RobustOptions robust;
  robust.loss = *options.loss;
  robust.alignment = alignment;
  const bool is_auto = options.kernel.spec() == "auto";
  const double size = length_scale(q0);
  if (!is_auto) robust.kernel = options.kernel.make(q0);
  if (!is_auto || options.lambda) robust.lambda = options.lambda.value_or(1 / (size * size));
  robust.least_sigma = options.sigma.in(size);
  require_positive("sigma", robust.least_sigma);
  robust.weights = weights;
  return robust;
}

// Alignment and weights in turn: weights of prediction until they settle, then those of the loss. `shapes.data` then
// has the weights of the data.
RobustData fit_robustly(MatchingShapes& shapes, const RegistrationOptions& options) {
  constexpr int kMostAlignments = 6;
  const Eigen::VectorXd given = landmark_weights(shapes.data.weights, shapes.source.count());
  const auto fit = [&](const Eigen::VectorXd& weights) -> RobustFit {
    shapes.data.weights = given.cwiseProduct(weights);
    const Alignment alignment = find_alignment(shapes, options);
    const Points q0 = alignment.apply(shapes.source.points);
    return {q0, shapes.target.points, robust_options(q0, options, alignment.kind, given)};
  };
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(given.size());
  for (int i = 0; i < kMostAlignments; ++i) {
    const Eigen::VectorXd next = fit(weights).predicted_weights();
    const double change = (next - weights).cwiseAbs().maxCoeff();
    weights = next;
    if (change < 2 * kSettledWeights) break;
  }
  weights = fit(weights).settle(weights);
  RobustFit last = fit(weights);
  weights = last.settle(weights);
  shapes.data.weights = last.data_weights(weights);
  return {last, weights};
}

}  // namespace

std::vector<Eigen::MatrixXd> realisations(const NoiseModel& noise, const Points& shape, const TimeGrid& grid,
                                          std::uint64_t seed, int count) {
  if (count == 0 || grid.steps < 1) return {};
  const int channels = noise.channels(static_cast<int>(shape.rows()), static_cast<int>(shape.cols()));
  int ratio = 1;
  while (grid.steps * ratio < kFinestSteps) ratio *= 2;
  std::vector<Eigen::MatrixXd> all(static_cast<std::size_t>(count));
  parallel_for(count, [&](int s) {
    const Eigen::MatrixXd fine =
        brownian_increments(seed, static_cast<std::uint64_t>(s), channels, {grid.time, ratio * grid.steps});
    all[static_cast<std::size_t>(s)] = coarsened(fine, ratio);
  });
  return all;
}

Eigen::Index free_coordinates(const RegistrationProblem& problem) {
  const Points& q0 = problem.matching.source;
  const LandmarkTerm* data = problem.matching.data->landmarks();
  const Eigen::Index observed = data != nullptr ? data->residual(q0).size() : problem.target.points.size();
  return observed - alignment_parameters(problem.alignment.kind, q0.rows());
}

RegistrationProblem make_problem(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options) {
  const SerialBlas serial;
  MatchingShapes shapes = matching_shapes(
      source, target, options.data,
      [&](const Landmarks& shape, int first, int second) { return may_separate(shape, first, second, options); });
  const bool curves = shapes.data.kind != DataKind::kLandmarks;
  if (curves && !shapes.data.width)
    shapes.data.width = automatic_data_width(make_curve(shapes.target, shapes.data.ends));
  if (!curves) note_mirrored_shapes(shapes, options);
  RegistrationOptions chosen = options;
  std::optional<RobustData> robust;
  if (options.loss) {
    check_loss(shapes);
    robust = fit_robustly(shapes, options);
    chosen.sigma = robust->fit.sigma();
  }
  Alignment alignment = find_alignment(shapes, options);
  Landmarks aligned = shapes.source;
  if (alignment.kind != AlignmentKind::kNone) aligned.points = alignment.apply(shapes.source.points);

  const Points& q0 = aligned.points;
  Scales scales = choose_scales(shapes, q0, chosen, alignment.kind);
  std::shared_ptr<const NoiseModel> noise = options.noise.make(aligned);
  noise->check(aligned.dimension(), aligned.count());
  if (!curves)
    require_determined(shapes.source.points, shapes.target.points, alignment.kind, shapes.target.source,
                       shapes.data.weights);
  const bool noisy = noise->channels(aligned.dimension(), aligned.count()) > 0;
  const MatchingMode mode = choose_mode(options, *noise, noisy);
  const int frozen = mode == MatchingMode::kExpected ? options.samples : mode == MatchingMode::kPathwise ? 1 : 0;
  std::vector<Eigen::MatrixXd> drawn = realisations(*noise, q0, options.grid, options.seed, frozen);
  if (mode == MatchingMode::kDeterministic) noise = make_noise("none");
  const std::string integrator = choose_integrator(options, mode);
  std::shared_ptr<const DataTerm> data =
      curves ? curve_data(shapes, scales.sigma) : landmark_data(shapes.target, shapes.data, scales.sigma);
  std::shared_ptr<const DataTerm> coarse = curves ? curve_data(shapes, scales.sigma, kCoarseData) : nullptr;
  MatchingProblem matching{{std::move(scales.kernel), std::move(noise)},
                           make_integrator(integrator),
                           options.grid,
                           q0,
                           std::move(data),
                           scales.sigma,
                           scales.lambda,
                           std::move(drawn),
                           0,
                           mode == MatchingMode::kDeterministic || mode == MatchingMode::kMetamorphosis};
  return {std::move(shapes.source), std::move(aligned),     std::move(shapes.target),
          std::move(alignment),     scales.fitted,          mode,
          std::move(shapes.data),   std::move(matching),    std::move(coarse),
          std::move(robust),        std::move(shapes.notes)};
}

bool reweight(RegistrationProblem& problem, const Points& result) {
  if (!problem.robust) return false;
  const RobustFit& fit = problem.robust->fit;
  const Eigen::VectorXd weights = fit.updated(problem.robust->weights, result - problem.target.points);
  const Eigen::VectorXd data_weights = fit.data_weights(weights);
  const double change = (weights - problem.robust->weights).cwiseAbs().maxCoeff();
  if (change < kSettledWeights ||
      !is_determined(problem.original.points, problem.target.points, problem.alignment.kind, data_weights))
    return false;
  problem.robust->weights = weights;
  problem.data.weights = data_weights;
  problem.matching.data = landmark_data(problem.target, problem.data, problem.matching.sigma);
  return true;
}

}  // namespace pulson::matching
