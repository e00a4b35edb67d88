#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "displacement_likelihood.hpp"
#include "golden_maximum.hpp"
#include "pulson/core/parallel.hpp"
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

// How well landmarks were observed, with lengths in diameters.
struct Precision {
  double variance = 0;         // σ²
  VectorXd weights;            // N, of each landmark
  std::vector<MatrixXd> each;  // R_a, N; empty: σ²I

  // R/w, dN×dN.
  MatrixXd covariance(Index d) const {
    MatrixXd all = MatrixXd::Zero(d * weights.size(), d * weights.size());
    for (Index a = 0; a < weights.size(); ++a) {
      auto block = all.block(a * d, a * d, d, d);
      if (each.empty())
        block.diagonal().setConstant(variance / weights[a]);
      else
        block = each[static_cast<std::size_t>(a)] / weights[a];
    }
    return all;
  }

  // L⁻¹ of R/w = σ²LLᵀ, dN×dN, where covariances are given.
  MatrixXd root(Index d) const {
    const Eigen::LLT<MatrixXd> factors(covariance(d) / variance);
    return factors.matrixL().solve(MatrixXd::Identity(d * weights.size(), d * weights.size()));
  }
};

// Multiplied by L⁻¹, displacements have V = L⁻¹KL⁻ᵀ/λ + σ²I.
class Whitened {
 public:
  Whitened(const Precision& precision, Index d) : roots_(precision.weights.cwiseSqrt()) {
    if (!precision.each.empty()) all_ = precision.root(d);
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

// Root mean square over the landmarks of |(P_aa)⁻¹(Pr)_a|, P as in the header with the covariance V.
double left_out_error(const MatrixXd& v, const MatrixXd& directions, const Points& displacements,
                      const VectorXd& weights) {
  const Index d = displacements.rows(), n = displacements.cols();
  const Eigen::LLT<MatrixXd> factors(v);
  const MatrixXd vz = factors.solve(directions);
  MatrixXd p = factors.solve(MatrixXd::Identity(d * n, d * n));
  if (directions.cols() > 0) p -= vz * (directions.transpose() * vz).ldlt().solve(vz.transpose());
  const VectorXd pr = p * displacements.reshaped();
  double sum = 0;
  for (Index a = 0; a < n; ++a) {
    const MatrixXd block = p.block(a * d, a * d, d, d);
    sum += weights[a] * block.ldlt().solve(pr.segment(a * d, d)).squaredNorm();
  }
  return std::sqrt(sum / weights.sum());
}

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
  Precision precision{variance, weights(used), {}};
  if (!options.covariances.empty())
    for (const Index a : used)
      precision.each.emplace_back(options.covariances[static_cast<std::size_t>(a)] / (size * size));
  const Whitened whitened(precision, d);
  const DisplacementDraws draws{q0, whitened.columns(displacements.reshaped()), whitened.columns(directions)};
  const auto kernel_of = [&](double alpha) { return KernelOperator({{options.profile, alpha, 1}}); };
  DisplacementModel best;
  best.log_likelihood = -std::numeric_limits<double>::infinity();
  const int widths = static_cast<int>(std::lround(kWidthsPerOctave * std::log2(kWidestFit / kNarrowestFit)));
  for (int i = 0; i <= widths; ++i) {
    const double alpha = kNarrowestFit * std::exp2(static_cast<double>(i) / kWidthsPerOctave);
    const DisplacementLikelihood likelihood(whitened.gram(kernel_of(alpha).gram(q0, q0)), draws);
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
  const MatrixXd noise = precision.covariance(d);
  const MatrixXd v = on_each_axis(kernel_of(best.kernel.alpha).gram(q0, q0), d) / best.lambda + noise;
  best.prediction_error = size * left_out_error(v, directions, displacements, precision.weights);
  best.alignment_error = size * left_out_error(noise, directions, displacements, precision.weights);
  if (!std::isfinite(best.prediction_error) || !std::isfinite(best.alignment_error)) return std::nullopt;
  best.kernel.alpha *= size;
  best.lambda = options.lambda.value_or(best.lambda / (size * size));
  return best;
}

}  // namespace pulson::matching
