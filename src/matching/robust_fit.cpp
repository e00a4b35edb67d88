#include "robust_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "displacement_likelihood.hpp"
#include "maximum.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastRatio = 1e-6, kMostRatio = 10;  // λσ²/K(0)
constexpr int kRatios = 13;
constexpr int kWidthsPerDoubling = 4;
// A landmark with less weight is left out: its variance would be beyond that of the others' rounding.
constexpr double kNoWeight = 1e-4;
constexpr int kMostPredictions = 20, kMostMeans = 40;
constexpr Index kFewestMore = 4;  // coordinates beyond the directions of the alignment

double median(VectorXd values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<Index> first_indices(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

std::vector<Index> observed_in_full(const Points& source, const Points& target, const VectorXd& weights) {
  std::vector<Index> observed;
  for (Index a = 0; a < source.cols(); ++a)
    if (weights[a] > 0 && source.col(a).allFinite() && target.col(a).allFinite()) observed.push_back(a);
  return observed;
}

// Rows of some landmarks, dn×r.
MatrixXd rows_of(const MatrixXd& columns, const std::vector<Index>& landmarks, Index d) {
  MatrixXd rows(d * std::ssize(landmarks), columns.cols());
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    rows.middleRows(static_cast<Index>(i) * d, d) = columns.middleRows(landmarks[i] * d, d);
  return rows;
}

// The matrix on each axis, times columns.
MatrixXd times(const MatrixXd& matrix, const MatrixXd& columns, Index d) {
  MatrixXd result(matrix.rows() * d, columns.cols());
  for (Index i = 0; i < columns.cols(); ++i)
    result.col(i) = (columns.col(i).reshaped(d, matrix.cols()) * matrix.transpose()).reshaped();
  return result;
}

}  // namespace

RobustFit::RobustFit(const Points& source, const Points& target, const RobustOptions& options)
    : options_(options),
      weight_(options.loss, source.rows()),
      count_(source.cols()),
      size_(diameter(source)),
      scales_{KernelOperator({KernelTerm{}})} {
  const VectorXd weights = landmark_weights(options.weights, count_);
  observed_ = observed_in_full(source, target, weights);
  given_ = weights(observed_);
  shape_ = source(Eigen::all, observed_) / size_;
  moved_ = (target(Eigen::all, observed_) - source(Eigen::all, observed_)) / size_;
  directions_ = motion_directions(shape_, options.alignment, first_indices(shape_.size()));
  if (!determines(given_))
    throw InputError(
        fmt::format("a robust loss needs more than the {} that both shapes have in full: they cannot show "
                    "which one is wrong",
                    text::counted(observed_.size(), "landmark")));
}

double RobustFit::sigma() const { return size_ * std::sqrt(scales_.noise); }

std::vector<Index> RobustFit::used(const VectorXd& precision) const {
  std::vector<Index> all, few;
  for (Index a = 0; a < precision.size(); ++a)
    if (precision[a] > 0) all.push_back(a);
  for (const Index i : fitted_landmarks(std::ssize(all))) few.push_back(all[static_cast<std::size_t>(i)]);
  return few;
}

bool RobustFit::determines(const VectorXd& precision) const {
  return shape_.rows() * (precision.array() > 0).count() >= directions_.cols() + kFewestMore;
}

int RobustFit::widths() const {
  return options_.kernel
             ? 1
             : 1 + static_cast<int>(std::lround(kWidthsPerDoubling * std::log2(kWidestFit / kNarrowestFit)));
}

double RobustFit::width(int i) const { return kNarrowestFit * std::exp2(static_cast<double>(i) / kWidthsPerDoubling); }

KernelOperator RobustFit::kernel_at(double width) const {
  if (!options_.kernel) return KernelOperator({{KernelProfile::kMatern32, width, 1}});
  std::vector<KernelTerm> terms = options_.kernel->terms();
  for (KernelTerm& term : terms) term.alpha /= size_;
  return KernelOperator(terms);
}

// 1/λ in diameters squared, for τ = λσ²: that given, or the best for which σ is at least the least.
double RobustFit::variance_at(double best, double tau) const {
  if (options_.lambda) return 1 / (*options_.lambda * size_ * size_);
  return std::max(best, std::pow(options_.least_sigma / size_, 2) / tau);
}

DisplacementScales RobustFit::scales_at(const VectorXd& precision) const {
  const Index d = shape_.rows();
  const std::vector<Index> of = used(precision);
  const VectorXd roots = VectorXd(precision(of)).cwiseSqrt();
  const auto whitened = [&](const MatrixXd& columns) -> MatrixXd {
    return roots.transpose().replicate(d, 1).reshaped().asDiagonal() * columns;
  };
  const Points shape = shape_(Eigen::all, of);
  const DisplacementDraws draws{shape, whitened(MatrixXd(moved_(Eigen::all, of)).reshaped()),
                                whitened(rows_of(directions_, of, d))};
  DisplacementScales best{kernel_at(1), 1, 0, -std::numeric_limits<double>::infinity()};
  for (int i = 0; i < widths(); ++i) {
    const KernelOperator kernel = kernel_at(width(i));
    const DisplacementLikelihood likelihood(roots.asDiagonal() * kernel.gram(shape, shape) * roots.asDiagonal(), draws);
    const auto at = [&](const VectorXd& log_tau) {
      const double tau = std::exp(log_tau[0]);
      return likelihood(tau, variance_at(likelihood.best_variance(tau), tau));
    };
    double least = std::log(kLeastRatio * kernel.at_zero());
    const double most = std::log(kMostRatio * kernel.at_zero());
    if (options_.lambda)  // σ² = τ/λ
      least = std::min(most, std::max(least, std::log(*options_.lambda * options_.least_sigma * options_.least_sigma)));
    const Maximum found = maximise_from_grid(at, {VectorXd{{least}}, VectorXd{{most}}}, {kRatios});
    const double tau = std::exp(found.x[0]), variance = variance_at(likelihood.best_variance(tau), tau);
    if (found.value > best.log_likelihood) best = {kernel, variance, tau * variance, found.value};
  }
  return best;
}

RobustFit::LeftOut RobustFit::left_out(const DisplacementScales& scales, const VectorXd& precision) const {
  const Index d = shape_.rows(), n = shape_.cols();
  const std::vector<Index> of = used(precision);
  const Points shape = shape_(Eigen::all, of);
  MatrixXd v = scales.variance * scales.kernel.gram(shape, shape);
  v.diagonal() += scales.noise * VectorXd(precision(of)).cwiseInverse();
  const MatrixXd inverse = v.llt().solve(MatrixXd::Identity(v.rows(), v.cols()));
  const MatrixXd z = rows_of(directions_, of, d), vz = times(inverse, z, d);
  const Eigen::LDLT<MatrixXd> normal(z.transpose() * vz);
  const VectorXd r = MatrixXd(moved_(Eigen::all, of)).reshaped();
  const VectorXd b = z.cols() > 0 ? VectorXd(normal.solve(vz.transpose() * r)) : VectorXd(0);
  const VectorXd pr = times(inverse, r, d) - vz * b;
  const MatrixXd one = MatrixXd::Identity(d, d);
  const auto uncertain = [&](const MatrixXd& rows) -> MatrixXd {
    if (z.cols() == 0) return MatrixXd::Zero(d, d);
    return rows * normal.solve(rows.transpose());
  };
  LeftOut result{MatrixXd(d, n), std::vector<MatrixXd>(static_cast<std::size_t>(n))};
  const MatrixXd cross = scales.variance * scales.kernel.gram(shape_, shape);
  for (Index a = 0; a < n; ++a) {  // by the others, which do not have it
    const VectorXd k = cross.row(a).transpose();
    result.residuals.col(a) = moved_.col(a) - directions_.middleRows(a * d, d) * b - pr.reshaped(d, std::ssize(of)) * k;
    const MatrixXd rest = directions_.middleRows(a * d, d) - times(k.transpose(), vz, d);
    result.flows[static_cast<std::size_t>(a)] =
        (scales.variance * scales.kernel.at_zero() - k.dot(inverse * k)) * one + uncertain(rest);
  }
  for (std::size_t i = 0; i < of.size(); ++i) {  // with those that were used
    const auto at = static_cast<Index>(i);
    const MatrixXd p = inverse(at, at) * one - uncertain(vz.middleRows(at * d, d));
    const MatrixXd whole = p.ldlt().solve(one);
    result.residuals.col(of[i]) = whole * pr.segment(at * d, d);
    result.flows[static_cast<std::size_t>(of[i])] = whole - scales.noise / precision[of[i]] * one;
  }
  return result;
}

VectorXd RobustFit::prediction_squares(const DisplacementScales& scales, const VectorXd& precision) const {
  const LeftOut left = left_out(scales, precision);
  VectorXd squares(given_.size());
  for (Index a = 0; a < squares.size(); ++a) {
    MatrixXd covariance = left.flows[static_cast<std::size_t>(a)];
    covariance.diagonal().array() += scales.noise / given_[a];
    squares[a] = left.residuals.col(a).dot(covariance.ldlt().solve(left.residuals.col(a)));
  }
  return squares;
}

// The width and λσ² of greatest likelihood, where its sum of squares is that which the median of the t² shows.
DisplacementScales RobustFit::robust_start() const {
  const Index d = shape_.rows();
  const std::vector<Index> of = used(given_);
  const Points shape = shape_(Eigen::all, of);
  const MatrixXd z = rows_of(directions_, of, d);
  const DisplacementDraws draws{shape, MatrixXd(moved_(Eigen::all, of)).reshaped(), z};
  const auto degrees = static_cast<double>(shape.size() - z.cols());
  DisplacementScales best{kernel_at(1), 1, 0, -std::numeric_limits<double>::infinity()};
  for (int i = 0; i < widths(); ++i) {
    const KernelOperator kernel = kernel_at(width(i));
    const DisplacementLikelihood likelihood(kernel, draws);
    for (int j = 0; j < kRatios; ++j) {
      const double tau =
          kernel.at_zero() * kLeastRatio * std::pow(kMostRatio / kLeastRatio, static_cast<double>(j) / (kRatios - 1));
      const double shown =
          median(prediction_squares({kernel, 1, tau, 0}, given_)) / kMedianSquare.at(static_cast<std::size_t>(d - 1));
      const double variance = variance_at(shown, tau);
      const double value =
          likelihood(tau, variance) + 0.5 * degrees * (likelihood.best_variance(tau) - shown) / variance;
      if (value > best.log_likelihood) best = {kernel, variance, tau * variance, value};
    }
  }
  return best;
}

VectorXd RobustFit::spread_out(const VectorXd& weights) const {
  VectorXd all = VectorXd::Ones(count_);
  all(observed_) = weights;
  return all;
}

VectorXd RobustFit::predicted_weights() const {
  const SerialBlas serial;
  const LossWeight tukey({LossKind::kTukey, std::nullopt}, shape_.rows());
  const auto weights_of = [&](const VectorXd& squares) -> VectorXd {
    return squares.unaryExpr([&](double square) { return tukey(square); });
  };
  const auto precision_of = [&](const VectorXd& weights) -> VectorXd {
    return (weights.array() < kNoWeight).select(0, weights.cwiseProduct(given_));
  };
  VectorXd weights = weights_of(prediction_squares(robust_start(), given_));
  if (!determines(precision_of(weights))) return VectorXd::Ones(count_);
  for (int i = 0; i < kMostPredictions; ++i) {
    const VectorXd precision = precision_of(weights);
    const VectorXd next = weights_of(prediction_squares(scales_at(precision), precision));
    if (!determines(precision_of(next))) break;
    const double change = (next - weights).cwiseAbs().maxCoeff();
    weights = next;
    if (change < kSettledWeights) break;
  }
  return spread_out(weights);
}

VectorXd RobustFit::data_weights(const VectorXd& weights) const {
  VectorXd all = landmark_weights(options_.weights, count_);
  return all.cwiseProduct((weights.array() < kNoWeight).select(0, weights) / weight_.consistency());
}

// E|e_a|²/σ² m_a. @param residuals of a flow, of all landmarks; null: of the linear model
VectorXd RobustFit::noise_squares(const DisplacementScales& scales, const VectorXd& precision,
                                  const Points* residuals) const {
  const LeftOut left = left_out(scales, precision);
  const Index d = shape_.rows();
  VectorXd squares(given_.size());
  for (Index a = 0; a < squares.size(); ++a) {
    const MatrixXd& flow = left.flows[static_cast<std::size_t>(a)];
    VectorXd mean = left.residuals.col(a);
    MatrixXd covariance = flow;
    if (precision[a] > 0) {
      const double own = scales.noise / precision[a];
      const MatrixXd gain = own * (flow + own * MatrixXd::Identity(d, d)).inverse();
      mean = gain * mean;
      covariance = own * (MatrixXd::Identity(d, d) - gain);
    }
    if (residuals != nullptr) mean = residuals->col(observed_[static_cast<std::size_t>(a)]) / size_;
    squares[a] = (mean.squaredNorm() + covariance.trace()) * given_[a] / scales.noise;
  }
  return squares;
}

VectorXd RobustFit::settle(VectorXd weights) {
  const SerialBlas serial;
  for (int i = 0; i < kMostMeans; ++i) {
    const VectorXd precision = data_weights(weights)(observed_);
    scales_ = scales_at(precision);
    const VectorXd squares = noise_squares(scales_, precision, nullptr);
    const VectorXd next = spread_out(squares.unaryExpr([&](double square) { return weight_(square); }));
    if (!determines(data_weights(next)(observed_))) break;
    const double change = (next - weights).cwiseAbs().maxCoeff();
    weights = next;
    if (change < kSettledWeights) break;
  }
  return weights;
}

VectorXd RobustFit::updated(const VectorXd& weights, const Points& residuals) const {
  const SerialBlas serial;
  const VectorXd precision = data_weights(weights)(observed_);
  const VectorXd squares = noise_squares(scales_, precision, &residuals);
  return spread_out(squares.unaryExpr([&](double square) { return weight_(square); }));
}

}  // namespace pulson::matching
