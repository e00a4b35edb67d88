#include "displacement_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/factorisations.hpp"
#include "inference/log_maximum.hpp"
#include "matching/displacement_likelihood.hpp"
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
  const auto value = [&](const DisplacementLikelihood& likelihood, double log_tau) {
    const double t = tau.value_or(std::exp(log_tau));
    return likelihood(t, variance_at(likelihood, t, options));
  };

  // The best of a grid, and Powell's method from there.
  const double middle = std::log(std::sqrt(kNarrowestFit * kWidestFit)),
               half = std::log(std::sqrt(kWidestFit / kNarrowestFit));
  const double scale = kernel_at(middle).at_zero();
  const double least = std::log(kLeastTau * scale), most = std::log(kMostTau * scale);
  double log_width = middle, log_tau = least, best = -std::numeric_limits<double>::infinity();
  constexpr int kWidths = 2, kTaus = 12;
  for (int i = options.kernel ? 0 : -kWidths; i <= (options.kernel ? 0 : kWidths); ++i) {
    const double width = middle + i * half / kWidths;
    const DisplacementLikelihood likelihood(kernel_at(width), data);
    for (int j = 0; j <= (tau ? 0 : kTaus); ++j) {
      const double at = least + j * (most - least) / kTaus;
      if (const double here = value(likelihood, at); here > best) log_width = width, log_tau = at, best = here;
    }
  }
  const Index free = (options.kernel ? 0 : 1) + (tau ? 0 : 1);
  if (free > 0) {
    inference::LogSearch search =
        inference::log_search(free, half, 0.01, 60);  // the grid's best may lie on a bound, up to rounding
    search.with_deviations = false;
    Index next = 0;
    if (!options.kernel) {
      search.least[next] = std::min(0.0, middle - half - log_width);
      search.most[next++] = std::max(0.0, middle + half - log_width);
    }
    if (!tau) {
      search.least[next] = std::min(0.0, least - log_tau);
      search.most[next] = std::max(0.0, most - log_tau);
    }
    const auto place = [&](const VectorXd& x) {
      return std::pair(log_width + (options.kernel ? 0 : x[0]), log_tau + (tau ? 0 : x[x.size() - 1]));
    };
    const inference::LogMaximum found = maximise_over_logs(
        [&](const VectorXd& x) {
          return value(DisplacementLikelihood(kernel_at(place(x).first), data), place(x).second);
        },
        search);
    std::tie(log_width, log_tau) = place(found.x);
    best = found.value;
  }
  const KernelOperator kernel = kernel_at(log_width);
  const double t = tau.value_or(std::exp(log_tau));
  const double variance = variance_at(DisplacementLikelihood(kernel, data), t, options);
  return {kernel, 1 / variance, options.sigma.value_or(std::sqrt(t * variance)), best};
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
