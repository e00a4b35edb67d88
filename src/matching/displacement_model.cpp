#include <cmath>
#include <numeric>
#include <vector>

#include "core/text.hpp"
#include "displacement_likelihood.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/landmark_predictions.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kFewestFree = 4;  // coordinates beyond the directions of the alignment
constexpr int kWidthsPerOctave = 4;
// Deviations of the displacements, λ^{-½}, in diameters.
constexpr double kLeastDeviation = 1e-4, kMostDeviation = 10;
constexpr int kDeviations = 24;
constexpr double kGolden = 0.6180339887498949;

std::vector<Index> used_landmarks(const Points& source, const Points& target) {
  std::vector<Index> complete;
  for (Index a = 0; a < source.cols(); ++a)
    if (source.col(a).allFinite() && target.col(a).allFinite()) complete.push_back(a);
  std::vector<Index> few;
  for (const Index i : fitted_landmarks(std::ssize(complete))) few.push_back(complete[static_cast<std::size_t>(i)]);
  return few;
}

std::vector<Index> whole_range(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// Largest value of f on [low, high]: the best of a grid, then golden sections about it.
template <class Function>
double maximum_on(double low, double high, int count, const Function& f) {
  const double step = (high - low) / (count - 1);
  double best = low, value = f(low);
  for (int i = 1; i < count; ++i) {
    const double x = low + i * step;
    if (const double here = f(x); here > value) best = x, value = here;
  }
  double a = std::max(low, best - step), b = std::min(high, best + step);
  double left = b - kGolden * (b - a), right = a + kGolden * (b - a);
  double at_left = f(left), at_right = f(right);
  while (b - a > 1e-4) {
    if (at_left > at_right) {
      b = right, right = left, at_right = at_left;
      left = b - kGolden * (b - a), at_left = f(left);
    } else {
      a = left, left = right, at_left = at_right;
      right = a + kGolden * (b - a), at_right = f(right);
    }
  }
  return (a + b) / 2;
}

}  // namespace

std::optional<DisplacementModel> fit_displacements(const Points& source, const Points& target,
                                                   const DisplacementOptions& options) {
  const SerialBlas serial;
  require_positive("sigma", options.sigma);
  require_size("the target of displacements", target, source.rows(), source.cols());
  const std::vector<Index> used = used_landmarks(source, target);
  const double size = diameter(source);
  const auto n = static_cast<Index>(used.size());
  const Index d = source.rows();
  if (!(size > 0) || n == 0) return std::nullopt;
  const Points q0 = (source(Eigen::all, used).colwise() - source(Eigen::all, used).rowwise().mean()) / size;
  const Points displacements = (target(Eigen::all, used) - source(Eigen::all, used)) / size;
  const DisplacementDraws draws{q0, displacements.reshaped(),
                                motion_directions(q0, options.alignment, whole_range(d * n))};
  if (d * n < draws.directions.cols() + kFewestFree) return std::nullopt;

  const double variance = std::pow(options.sigma / size, 2);
  const auto kernel_of = [&](double alpha) { return KernelOperator({{options.profile, alpha, 1}}); };
  DisplacementModel best;
  best.log_likelihood = -std::numeric_limits<double>::infinity();
  const int widths = static_cast<int>(std::lround(kWidthsPerOctave * std::log2(kWidestFit / kNarrowestFit)));
  for (int i = 0; i <= widths; ++i) {
    const double alpha = kNarrowestFit * std::exp2(static_cast<double>(i) / kWidthsPerOctave);
    const DisplacementLikelihood likelihood(kernel_of(alpha), draws);
    const auto at = [&](double log_deviation) {
      const double moved = std::exp(2 * log_deviation);
      return likelihood(variance / moved, moved);
    };
    const double log_deviation = options.lambda
                                     ? -0.5 * std::log(*options.lambda * size * size)
                                     : maximum_on(std::log(kLeastDeviation), std::log(kMostDeviation), kDeviations, at);
    if (const double value = at(log_deviation); value > best.log_likelihood)
      best = {{options.profile, alpha, 1}, std::exp(-2 * log_deviation), value, 0, 0, n};
  }
  if (!std::isfinite(best.log_likelihood)) return std::nullopt;  // sigma leaves the range of numbers
  const std::vector<Index> all = whole_range(n);
  const KnownDisplacements known{q0, displacements, draws.directions, all};
  const KernelTerm fitted{options.profile, best.kernel.alpha, 1 / best.lambda};
  best.prediction_error = size * predict_displacements(known, KernelOperator({fitted}), variance).error();
  best.alignment_error = size * predict_displacements(known, std::nullopt, 1).error();
  if (!std::isfinite(best.prediction_error) || !std::isfinite(best.alignment_error)) return std::nullopt;
  best.kernel.alpha *= size;
  best.lambda = options.lambda.value_or(best.lambda / (size * size));
  return best;
}

}  // namespace pulson::matching
