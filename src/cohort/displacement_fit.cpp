#include "displacement_fit.hpp"

#include <cmath>
#include <numeric>

#include "core/factorisations.hpp"
#include "inference/log_maximum.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostLandmarks = 128;
constexpr double kNarrowest = 0.1, kWidest = 0.4;  // widths, in diameters
constexpr double kLeastTau = 1e-6, kMostTau = 10;  // λσ², over K(0)
constexpr double kLeastNoise = 1e-12;              // σ² over K(0)/λ, for a regular matrix
constexpr double kSmallestVariance = 1e-300;

std::vector<Index> used_landmarks(Index count) {
  std::vector<Index> used(static_cast<std::size_t>(std::min(count, kMostLandmarks)));
  for (std::size_t i = 0; i < used.size(); ++i)
    used[i] = static_cast<Index>(i) * count / static_cast<Index>(used.size());
  return used;
}

// The mean, and the displacements from it, a column for each specimen (index a·d + axis).
struct Displacements {
  Points mean;
  Index specimens;
  MatrixXd columns;
  MatrixXd directions;  // of the alignment
};

// Columns whose outer products sum to a covariance.
MatrixXd factor_of(const MatrixXd& covariance) {
  if (covariance.size() == 0) return MatrixXd::Zero(covariance.rows(), 0);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(covariance);
  return factors.eigenvectors() * factors.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

Displacements displacements_of(const std::vector<Points>& shapes, const MatrixXd& uncertain, AlignmentKind alignment) {
  const std::vector<Index> used = used_landmarks(shapes.front().cols());
  const Index d = shapes.front().rows(), size = d * static_cast<Index>(used.size()), n = std::ssize(shapes);
  std::vector<Index> places;  // of the coordinates used
  for (const Index a : used)
    for (Index axis = 0; axis < d; ++axis) places.push_back(a * d + axis);
  const MatrixXd more = uncertain.size() > 0 ? factor_of(uncertain(places, places)) : MatrixXd(size, 0);
  Displacements all{{}, n, MatrixXd(size, n + more.cols()), {}};
  for (Index i = 0; i < n; ++i) all.columns.col(i) = shapes[static_cast<std::size_t>(i)].reshaped()(places);
  const VectorXd mean = all.columns.leftCols(n).rowwise().mean();
  all.columns.leftCols(n).colwise() -= mean;
  all.columns.rightCols(more.cols()) = more;
  all.mean = mean.reshaped(d, std::ssize(used));
  std::iota(places.begin(), places.end(), 0);
  all.directions = motion_directions(all.mean, alignment, places);
  return all;
}

// The likelihood of one kernel as a function of τ = λσ² and, where it is given, of the variance 1/λ.
class KernelLikelihood {
 public:
  KernelLikelihood(const KernelOperator& kernel, const Displacements& data)
      : dimension_(data.mean.rows()), specimens_(data.specimens), size_(data.columns.rows()) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(kernel.gram(data.mean, data.mean));
    values_ = factors.eigenvalues().cwiseMax(0);
    columns_ = rotated(data.columns, factors.eigenvectors());
    directions_ = rotated(data.directions, factors.eigenvectors());
    squares_ = columns_.rowwise().squaredNorm();
  }

  // For λ = 1: log det V + log det ZᵀV⁻¹Z, and Σ rᵀPr.
  std::pair<double, double> terms(double tau) const {
    const VectorXd v = (values_.array() + tau).max(kSmallestVariance);
    const VectorXd inverse = v.cwiseInverse().transpose().replicate(dimension_, 1).reshaped();
    double determinant = static_cast<double>(dimension_) * v.array().log().sum();
    double squares = inverse.dot(squares_);
    if (directions_.cols() > 0) {
      const MatrixXd scaled = inverse.asDiagonal() * directions_;
      const Eigen::LDLT<MatrixXd> normal(directions_.transpose() * scaled);
      determinant += normal.vectorD().array().abs().log().sum();
      const MatrixXd moved = scaled.transpose() * columns_;
      squares -= moved.cwiseProduct(normal.solve(moved)).sum();
    }
    return {determinant, std::max(squares, kSmallestVariance)};
  }

  double degrees() const {
    return static_cast<double>(specimens_ - 1) * static_cast<double>(size_ - directions_.cols());
  }

  // The variance 1/λ of greatest likelihood, where it is not given.
  double best_variance(double tau) const { return terms(tau).second / degrees(); }

  double operator()(double tau, double variance) const {
    const auto [determinant, squares] = terms(tau);
    return -0.5 *
           (static_cast<double>(specimens_ - 1) * determinant + degrees() * std::log(variance) + squares / variance);
  }

 private:
  MatrixXd rotated(const MatrixXd& columns, const MatrixXd& vectors) const {
    MatrixXd result(columns.rows(), columns.cols());
    for (Index i = 0; i < columns.cols(); ++i)
      result.col(i) = (columns.col(i).reshaped(dimension_, vectors.rows()) * vectors).reshaped();
    return result;
  }

  Index dimension_, specimens_, size_;
  VectorXd values_, squares_;
  MatrixXd columns_, directions_;
};

double variance_at(const KernelLikelihood& likelihood, double tau, const CohortFitOptions& options) {
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
  const Displacements data = displacements_of(shapes, uncertain, options.alignment);
  const double size = diameter(data.mean);
  const auto kernel_at = [&](double log_width) {
    return options.kernel ? *options.kernel
                          : KernelOperator({{KernelProfile::kMatern32, size * std::exp(log_width), 1}});
  };
  const std::optional<double> tau = given_tau(options);
  const auto value = [&](const KernelLikelihood& likelihood, double log_tau) {
    const double t = tau.value_or(std::exp(log_tau));
    return likelihood(t, variance_at(likelihood, t, options));
  };

  // The best of a grid, and Powell's method from there.
  const double middle = std::log(std::sqrt(kNarrowest * kWidest)), half = std::log(std::sqrt(kWidest / kNarrowest));
  const double scale = kernel_at(middle).at_zero();
  const double least = std::log(kLeastTau * scale), most = std::log(kMostTau * scale);
  double log_width = middle, log_tau = least, best = -std::numeric_limits<double>::infinity();
  constexpr int kWidths = 2, kTaus = 12;
  for (int i = options.kernel ? 0 : -kWidths; i <= (options.kernel ? 0 : kWidths); ++i) {
    const double width = middle + i * half / kWidths;
    const KernelLikelihood likelihood(kernel_at(width), data);
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
        [&](const VectorXd& x) { return value(KernelLikelihood(kernel_at(place(x).first), data), place(x).second); },
        search);
    std::tie(log_width, log_tau) = place(found.x);
    best = found.value;
  }
  const KernelOperator kernel = kernel_at(log_width);
  const double t = tau.value_or(std::exp(log_tau));
  const double variance = variance_at(KernelLikelihood(kernel, data), t, options);
  return {kernel, 1 / variance, options.sigma.value_or(std::sqrt(t * variance)), best};
}

MatrixXd displacement_covariance(const KernelOperator& kernel, double lambda, double sigma, const Points& mean) {
  MatrixXd each = kernel.gram(mean, mean) / lambda;
  each.diagonal().array() += std::max(sigma * sigma, kLeastNoise * each(0, 0));
  const Index d = mean.rows(), n = mean.cols();
  MatrixXd all = MatrixXd::Zero(d * n, d * n);
  for (Index b = 0; b < n; ++b)
    for (Index a = 0; a < n; ++a) all.block(a * d, b * d, d, d).diagonal().setConstant(each(a, b));
  return all;
}

}  // namespace pulson::cohort
