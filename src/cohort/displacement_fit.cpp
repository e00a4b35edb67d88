#include "displacement_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/factorisations.hpp"
#include "matching/displacement_likelihood.hpp"
#include "matching/maximum.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using matching::DisplacementDraws;
using matching::DisplacementLikelihood;
using matching::kNarrowestFit;
using matching::kWidestFit;

constexpr double kLeastTau = 1e-6, kMostTau = 10;  // λσ², over K(0)
constexpr double kLeastNoise = 1e-12;              // σ² over K(0)/λ, for a regular matrix
constexpr double kPrecision = 1e-3;                // of logarithms: a fifth of what rounds of a robust fit end at

// Columns whose outer products sum to a covariance.
MatrixXd factor_of(const MatrixXd& covariance) {
  if (covariance.size() == 0) return MatrixXd::Zero(covariance.rows(), 0);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(covariance);
  return factors.eigenvectors() * factors.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

// Distances from the mean.
DisplacementDraws draws_of(const std::vector<Points>& shapes, const MatrixXd& uncertain, AlignmentKind alignment) {
  const std::vector<Index> used = matching::fitted_landmarks(shapes.front().cols());
  const Index d = shapes.front().rows(), size = d * std::ssize(used), n = std::ssize(shapes);
  std::vector<Index> places;  // of the coordinates used
  for (const Index a : used)
    for (Index axis = 0; axis < d; ++axis) places.push_back(a * d + axis);
  const MatrixXd more = uncertain.size() > 0 ? factor_of(uncertain(places, places)) : MatrixXd(size, 0);
  DisplacementDraws all{{}, MatrixXd(size, n + more.cols()), {}, n - 1};
  for (Index i = 0; i < n; ++i) all.columns.col(i) = shapes[static_cast<std::size_t>(i)].reshaped()(places);
  const VectorXd mean = all.columns.leftCols(n).rowwise().mean();
  all.columns.leftCols(n).colwise() -= mean;
  all.columns.rightCols(more.cols()) = more;
  all.shape = mean.reshaped(d, std::ssize(used));
  std::iota(places.begin(), places.end(), 0);
  all.directions = motion_directions(all.shape, alignment, places);
  return all;
}

double variance_at(const DisplacementLikelihood& likelihood, double tau, const CohortFitOptions& options) {
  if (options.lambda) return 1 / *options.lambda;
  if (options.sigma && *options.sigma > 0) return *options.sigma * *options.sigma / tau;
  return likelihood.best_variance(tau);
}

// τ, where λ and σ leave no choice.
std::optional<double> given_tau(const CohortFitOptions& options) {
  if (!options.sigma) return std::nullopt;
  if (*options.sigma == 0) return 0;
  if (options.lambda) return *options.lambda * *options.sigma * *options.sigma;
  return std::nullopt;
}

}  // namespace

CohortDisplacements fit_cohort_displacements(const std::vector<Points>& shapes, const MatrixXd& uncertain,
                                             const CohortFitOptions& options) {
  const SerialBlas serial;
  const DisplacementDraws data = draws_of(shapes, uncertain, options.alignment);
  const double size = diameter(data.shape);
  const auto kernel_at = [&](double log_width) {
    return options.kernel ? *options.kernel
                          : KernelOperator({{KernelProfile::kMatern32, size * std::exp(log_width), 1}});
  };
  const std::optional<double> tau = given_tau(options);
  // The logarithms of the width, in diameters, and of τ. A likelihood serves all τ of its width.
  double width = std::nan("");
  std::optional<DisplacementLikelihood> likelihood;
  const auto tau_at = [&](const VectorXd& x) { return tau.value_or(std::exp(x[1])); };
  const auto value = [&](const VectorXd& x) {
    if (x[0] != width) likelihood.emplace(kernel_at(width = x[0]), data);
    return (*likelihood)(tau_at(x), variance_at(*likelihood, tau_at(x), options));
  };
  constexpr int kWidths = 5, kTaus = 13;
  const double scale = kernel_at(std::log(std::sqrt(kNarrowestFit * kWidestFit))).at_zero();
  matching::Box box{VectorXd{{std::log(kNarrowestFit), std::log(kLeastTau * scale)}},
                    VectorXd{{std::log(kWidestFit), std::log(kMostTau * scale)}}};
  if (options.kernel) box.most[0] = box.least[0];
  if (tau) box.most[1] = box.least[1];
  const matching::Maximum found =
      maximise_from_grid(value, box, {options.kernel ? 1 : kWidths, tau ? 1 : kTaus}, {.tolerance = kPrecision});
  value(found.x);
  const double t = tau_at(found.x), variance = variance_at(*likelihood, t, options);
  return {kernel_at(width), 1 / variance, options.sigma.value_or(std::sqrt(t * variance)), found.value};
}

double difference(const CohortDisplacements& first, const CohortDisplacements& second, const Points& mean) {
  const MatrixXd before = first.kernel.gram(mean, mean), after = second.kernel.gram(mean, mean);
  const double of_sigma = first.sigma == second.sigma ? 0 : std::abs(std::log(second.sigma / first.sigma));
  return std::max(
      {(after - before).norm() / before.norm(), std::abs(std::log(second.lambda / first.lambda)), of_sigma});
}

MatrixXd displacement_covariance(const KernelOperator& kernel, double lambda, double sigma, const Points& mean) {
  MatrixXd each = kernel.gram(mean, mean) / lambda;
  each.diagonal().array() += std::max(sigma * sigma, kLeastNoise * each(0, 0));
  return matching::on_each_axis(each, mean.rows());
}

}  // namespace pulson::cohort
