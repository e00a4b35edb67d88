#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "displacement_likelihood.hpp"
#include "maximum.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/landmark_predictions.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kFewestFree = 4;  // coordinates beyond the directions of the alignment
constexpr int kWidthsPerOctave = 4;
// Deviations of the displacements, λ^{-½}, in diameters.
constexpr double kLeastDeviation = 1e-4, kMostDeviation = 10;
constexpr int kDeviations = 24;

std::vector<Index> used_landmarks(const Points& source, const Points& target, const VectorXd& weights) {
  std::vector<Index> complete;
  for (Index a = 0; a < source.cols(); ++a)
    if (weights[a] > 0 && source.col(a).allFinite() && target.col(a).allFinite()) complete.push_back(a);
  std::vector<Index> few;
  for (const Index i : fitted_landmarks(std::ssize(complete))) few.push_back(complete[static_cast<std::size_t>(i)]);
  return few;
}

std::vector<Index> whole_range(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// L⁻¹ of R/w = σ²LLᵀ, dN×dN, where covariances are given.
MatrixXd root_of(const DisplacementNoise& noise, double variance, Index d) {
  const Index n = noise.variances.size();
  MatrixXd all = MatrixXd::Zero(d * n, d * n);
  for (Index a = 0; a < n; ++a) all.block(a * d, a * d, d, d) = noise.of(a, d) / variance;
  return all.llt().matrixL().solve(MatrixXd::Identity(d * n, d * n));
}

// Multiplied by L⁻¹, displacements have V = L⁻¹KL⁻ᵀ/λ + σ²I.
class Whitened {
 public:
  Whitened(const DisplacementNoise& noise, double variance, Index d)
      : roots_((variance / noise.variances.array()).sqrt()) {
    if (!noise.covariances.empty()) all_ = root_of(noise, variance, d);
  }

  MatrixXd columns(const MatrixXd& columns) const {
    if (all_.size() > 0) return all_ * columns;
    return roots_.transpose().replicate(columns.rows() / roots_.size(), 1).reshaped().asDiagonal() * columns;
  }

  MatrixXd gram(const MatrixXd& k) const {
    if (all_.size() == 0) return roots_.asDiagonal() * k * roots_.asDiagonal();
    return all_ * on_each_axis(k, all_.rows() / k.rows()) * all_.transpose();
  }

 private:
  VectorXd roots_;
  MatrixXd all_;
};

}  // namespace

std::optional<DisplacementModel> fit_displacements(const Points& source, const Points& target,
                                                   const DisplacementOptions& options) {
  const SerialBlas serial;
  require_positive("sigma", options.sigma);
  require_size("the target of displacements", target, source.rows(), source.cols());
  const VectorXd weights = landmark_weights(options.weights, source.cols());
  const std::vector<Index> used = used_landmarks(source, target, weights);
  const double size = diameter(source);
  const auto n = static_cast<Index>(used.size());
  const Index d = source.rows();
  if (!(size > 0) || n == 0) return std::nullopt;
  const Points q0 = (source(Eigen::all, used).colwise() - source(Eigen::all, used).rowwise().mean()) / size;
  const Points displacements = (target(Eigen::all, used) - source(Eigen::all, used)) / size;
  const MatrixXd directions = motion_directions(q0, options.alignment, whole_range(d * n));
  if (d * n < directions.cols() + kFewestFree) return std::nullopt;

  const double variance = std::pow(options.sigma / size, 2);
  std::vector<MatrixXd> covariances;
  if (!options.covariances.empty())
    for (const Index a : used)
      covariances.emplace_back(options.covariances[static_cast<std::size_t>(a)] / (size * size));
  const DisplacementNoise noise(variance, covariances, weights(used));
  const Whitened whitened(noise, variance, d);
  const DisplacementDraws draws{q0, whitened.columns(displacements.reshaped()), whitened.columns(directions)};
  const auto kernel_of = [&](double alpha) { return KernelOperator({{options.profile, alpha, 1}}); };
  Box deviations{VectorXd{{std::log(kLeastDeviation)}}, VectorXd{{std::log(kMostDeviation)}}};
  if (options.lambda) deviations.least[0] = deviations.most[0] = -0.5 * std::log(*options.lambda * size * size);
  DisplacementModel best;
  best.log_likelihood = -std::numeric_limits<double>::infinity();
  const int widths = static_cast<int>(std::lround(kWidthsPerOctave * std::log2(kWidestFit / kNarrowestFit)));
  for (int i = 0; i <= widths; ++i) {
    const double alpha = kNarrowestFit * std::exp2(static_cast<double>(i) / kWidthsPerOctave);
    const DisplacementLikelihood likelihood(whitened.gram(kernel_of(alpha).gram(q0, q0)), draws);
    const auto at = [&](const VectorXd& log_deviation) {
      const double moved = std::exp(2 * log_deviation[0]);
      return likelihood(variance / moved, moved);
    };
    const Maximum found = maximise_from_grid(at, deviations, {options.lambda ? 1 : kDeviations});
    if (found.value > best.log_likelihood)
      best = {{options.profile, alpha, 1}, std::exp(-2 * found.x[0]), found.value, 0, 0, n};
  }
  if (!std::isfinite(best.log_likelihood)) return std::nullopt;  // sigma leaves the range of numbers
  const std::vector<Index> all = whole_range(n);
  const KnownDisplacements from{q0, displacements, directions, all, noise};
  const KernelOperator fitted({{options.profile, best.kernel.alpha, 1 / best.lambda}});
  best.prediction_error = size * predict_displacements(from, fitted).weighted_error(weights(used));
  best.alignment_error = size * predict_displacements(from, std::nullopt).weighted_error(weights(used));
  if (!std::isfinite(best.prediction_error) || !std::isfinite(best.alignment_error)) return std::nullopt;
  best.kernel.alpha *= size;
  best.lambda = options.lambda.value_or(best.lambda / (size * size));
  return best;
}

}  // namespace pulson::matching
