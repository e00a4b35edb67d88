#include "pulson/matching/registration.hpp"

#include <chrono>
#include <cmath>

#include <fmt/core.h>

#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

// Squares and their inverses must stay in the range of numbers.
constexpr double kLargestCoordinate = 1e100;
constexpr double kSmallestSize = 1e-100;

void check_range(const Landmarks& shape) {
  const double largest = shape.points.cwiseAbs().maxCoeff();
  const auto [low, high] = bounding_box(shape.points);
  const double size = (high - low).maxCoeff();
  if (largest > kLargestCoordinate)
    throw InputError(fmt::format("{}: a coordinate is {}; at most {} in size is supported, change the unit",
                                 shape.source, largest, kLargestCoordinate));
  if (size > 0 && size < kSmallestSize)
    throw InputError(fmt::format("{}: the shape is {} across; at least {} is supported, change the unit", shape.source,
                                 size, kSmallestSize));
}

void check_finite(const Landmarks& shape) {
  for (int a = 0; a < shape.count(); ++a)
    if (!shape.points.col(a).allFinite())
      throw InputError(
          fmt::format("{}: landmark {} has a coordinate that is not a finite number", shape.source, shape.describe(a)));
}

void check_pair(const Landmarks& source, const Landmarks& target) {
  if (source.count() == 0) throw InputError(fmt::format("{}: the shape has no landmarks", source.source));
  if (source.dimension() != target.dimension())
    throw InputError(fmt::format("the shapes have different dimensions: {} is {}D, {} is {}D", source.source,
                                 source.dimension(), target.source, target.dimension()));
  if (source.dimension() < 1 || source.dimension() > 3)
    throw InputError(
        fmt::format("{}: landmarks in {} dimensions; 1, 2 or 3 are supported", source.source, source.dimension()));
  if (source.count() != target.count())
    throw InputError(fmt::format("the shapes have different numbers of landmarks: {} has {}, {} has {}", source.source,
                                 source.count(), target.source, target.count()));
  for (const Landmarks* shape : {&source, &target}) {
    check_finite(*shape);
    check_range(*shape);
  }
}

void check_distinct(const Landmarks& source) {
  const auto pair = find_coincident(source.points);
  if (!pair) return;
  const std::string hint = pair->first == 0 && pair->second == source.count() - 1
                               ? "a closed outline needs its first point only once: remove the last"
                               : "remove or move one of them, in the target too";
  throw InputError(fmt::format("{}: landmarks {} and {} are at the same place, so the kernel matrix is singular; {}",
                               source.source, source.describe(pair->first), source.describe(pair->second), hint));
}

MatchingMode choose_mode(const RegistrationOptions& options, const NoiseModel& noise, const Landmarks& source) {
  const bool noisy = noise.channels(source.dimension(), source.count()) > 0;
  const MatchingMode mode = options.mode.value_or(noisy ? MatchingMode::kMap : MatchingMode::kDeterministic);
  if (mode == MatchingMode::kMap && !noisy)
    throw InputError("mode map fits the noise, and there is none; give one, as in --noise ch-sd:beta=1");
  return mode;
}

double choose_lambda(const RegistrationOptions& options, const Points& source) {
  if (options.lambda) return *options.lambda;
  const double size = diameter(source);
  if (!(size > 0)) throw InputError("lambda auto needs at least two landmarks apart; give a number");
  return 1 / (size * size);
}

void record_solution(const MatchingObjective& objective, const MinimiseSummary& summary, Registration& registration) {
  const MatchingObjective::Evaluation& at = summary.solution;
  registration.result = at.path.final().q;
  registration.momenta = objective.momenta(at.z);
  registration.increments = objective.increments(at.z);
  registration.cost = at.cost;
  registration.solver = summary.solver;
  registration.converged = summary.converged;
  registration.stop_reason = summary.reason;
  registration.iterations = summary.iterations;
  registration.evaluations = summary.evaluations;
  registration.relative_gradient = summary.relative_gradient;
}

double root_mean_square(const Points& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
}

}  // namespace

MatchingMode parse_mode(std::string_view name) {
  if (name == "deterministic") return MatchingMode::kDeterministic;
  if (name == "map") return MatchingMode::kMap;
  throw InputError(fmt::format("unknown mode '{}'; valid: deterministic, map", name));
}

std::string mode_name(MatchingMode mode) { return mode == MatchingMode::kMap ? "map" : "deterministic"; }

Eigen::VectorXd Registration::distances() const { return (result - target.points).colwise().norm(); }

double Registration::rms() const { return root_mean_square(result - target.points); }

double Registration::initial_rms() const { return root_mean_square(source.points - target.points); }

double Registration::max_residual() const { return distances().maxCoeff(); }

bool Registration::matched() const { return rms() <= std::max(3 * sigma, initial_rms() / 20); }

Registration register_shapes(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  check_pair(source, target);
  check_distinct(source);
  Registration registration;
  registration.original = source;
  registration.target = target;
  registration.source = source;
  registration.alignment = align(source.points, target.points, options.align);
  if (options.align != AlignmentKind::kNone) registration.source.points = registration.alignment.apply(source.points);

  const Points& q0 = registration.source.points;
  StochasticSystem system{make_kernel(options.kernel, q0), make_noise(options.noise, registration.source)};
  system.noise->check(source.dimension(), source.count());
  registration.mode = choose_mode(options, *system.noise, source);
  if (registration.mode == MatchingMode::kDeterministic) system.noise = make_noise("none");
  registration.kernel = system.kernel.spec();
  registration.noise = system.noise->spec();
  registration.integrator = options.integrator;
  registration.grid = options.grid;
  registration.sigma = options.sigma;
  registration.lambda = choose_lambda(options, q0);

  const MatchingObjective objective({std::move(system), make_integrator(options.integrator), options.grid, q0,
                                     target.points, registration.sigma, registration.lambda});
  record_solution(objective, minimise(objective, options.minimise), registration);
  registration.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return registration;
}

StochasticSystem registration_system(const Registration& registration) {
  return {make_kernel(registration.kernel, registration.source.points),
          make_noise(registration.noise, registration.source)};
}

Trajectory replay(const Registration& registration) {
  return make_integrator(registration.integrator)
      ->integrate(registration_system(registration), {registration.source.points, registration.momenta},
                  registration.grid, registration.increments);
}

int order_inversions(const Points& before, const Points& after) {
  int count = 0;
  for (Eigen::Index b = 1; b < before.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a)
      if ((before(0, a) - before(0, b)) * (after(0, a) - after(0, b)) < 0) ++count;
  return count;
}

}  // namespace pulson
