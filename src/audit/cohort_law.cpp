#include "cohort_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "robust_alignment.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFitRounds = 3;     // of means and weights
constexpr double kHuber = 1.5;    // of root mean square distances over their median: further away weighs less
constexpr double kOwnScale = 10;  // observations that a landmark's scale of 1 is worth a priori
constexpr std::array kTails = {2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0};
constexpr std::array kStrengths = {1.0,  2.0,   4.0,   8.0,   16.0,   32.0,
                                   64.0, 128.0, 256.0, 512.0, 1024.0, 4096.0};  // ν0−m−1

MatrixXd on_each_axis(const MatrixXd& covariance, Index d) {
  MatrixXd all = MatrixXd::Zero(covariance.rows() * d, covariance.cols() * d);
  for (Index a = 0; a < covariance.rows(); ++a)
    for (Index b = 0; b < covariance.cols(); ++b)
      all.block(a * d, b * d, d, d).diagonal().setConstant(covariance(a, b));
  return all;
}

// log Γ_m(b/2) − log Γ_m(a/2)
double log_gamma_ratio(double a, double b, Index m) {
  double sum = 0;
  for (Index j = 0; j < m; ++j) {
    const auto less = static_cast<double>(j);
    sum += std::lgamma((b - less) / 2) - std::lgamma((a - less) / 2);
  }
  return sum;
}

// The covariance of greatest Gaussian likelihood of this scatter, times its scale g.
MatrixXd best_covariance(const std::vector<ShapeDirections::Kernel>& kernels, const MatrixXd& scatter, double count) {
  const auto m = static_cast<double>(scatter.rows());
  const ShapeDirections::Kernel* best = nullptr;
  double most = -std::numeric_limits<double>::infinity(), scale = 1;
  for (const ShapeDirections::Kernel& kernel : kernels) {
    const double g = kernel.precision.cwiseProduct(scatter).sum() / (count * m);
    const double likelihood = -count / 2 * (kernel.log_determinant + m * std::log(g));
    if (likelihood > most) most = likelihood, best = &kernel, scale = g;
  }
  return scale * best->precision.llt().solve(MatrixXd::Identity(scatter.rows(), scatter.cols()));
}

}  // namespace

ShapeDirections::ShapeDirections(const Points& reference_shape)
    : reference(reference_shape), basis(directions_of_shape(reference_shape)) {
  for (const MatrixXd& kernel : kernel_covariances(reference)) {
    const MatrixXd covariance = basis.transpose() * on_each_axis(kernel, reference.rows()) * basis;
    const Eigen::LLT<MatrixXd> factors(covariance);
    kernels.push_back({factors.solve(MatrixXd::Identity(basis.cols(), basis.cols())),
                       2 * factors.matrixLLT().diagonal().array().log().sum()});
  }
}

CohortLaw::CohortLaw(const std::vector<Points>& shapes, const ShapeDirections& shape_directions,
                     const std::vector<bool>& accused)
    : directions_of_mean_(&shape_directions),
      reference_(shape_directions.reference),
      displacements_(reference_.size(), static_cast<Index>(shapes.size())),
      is_accused_(accused) {
  weights_.resize(displacements_.cols());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    weights_[static_cast<Index>(i)] = accused[i] ? 0 : 1;
    std::vector<int>& missing = missing_.emplace_back();
    for (int a = 0; a < reference_.cols(); ++a)
      if (!shapes[i].col(a).allFinite()) missing.push_back(a);
    const Points apart = robustly_aligned(shapes[i], reference_) - reference_;
    displacements_.col(static_cast<Index>(i)) = apart.reshaped().array().isNaN().select(0, apart.reshaped());
  }
  for (int round = 0; round < kFitRounds; ++round) {
    fit();
    fill_in();
    weigh();
  }
  fit();
  fit_tails();
}

// Missing landmarks are where the others expect them: P_bb y_b = −P_bk y_k.
void CohortLaw::fill_in() {
  const Index d = reference_.rows();
  for (std::size_t i = 0; i < missing_.size(); ++i) {
    std::vector<Index> rows;
    for (const int a : missing_[i])
      for (Index axis = 0; axis < d; ++axis) rows.push_back(a * d + axis);
    if (rows.empty()) continue;
    auto own = displacements_.col(static_cast<Index>(i));
    own(rows).setZero();
    const VectorXd weighted = precision_ * own;
    own(rows) = -precision_(rows, rows).llt().solve(weighted(rows));
  }
}

void CohortLaw::weigh() {
  std::vector<double> distances;
  for (Index i = 0; i < weights_.size(); ++i)
    distances.push_back(std::sqrt(displacements_.col(i).dot(precision_ * displacements_.col(i))));
  const double middle = median_of(distances);
  for (Index i = 0; i < weights_.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    weights_[i] = is_accused_[at] ? 0 : std::min(1.0, kHuber * middle / distances[at]);
  }
}

void CohortLaw::fit() {
  const double count = weights_.sum();
  const VectorXd mean = displacements_ * weights_ / count;
  reference_ += mean.reshaped(reference_.rows(), reference_.cols());
  displacements_.colwise() -= mean;
  const MatrixXd z = directions().transpose() * displacements_;
  const MatrixXd scatter = z * weights_.asDiagonal() * z.transpose();
  const MatrixXd covariance = best_covariance(directions_of_mean_->kernels, scatter, count);
  const Eigen::LLT<MatrixXd> factors(covariance);
  const MatrixXd half = factors.matrixL().solve(scatter);
  const VectorXd values =
      Eigen::SelfAdjointEigenSolver<MatrixXd>(factors.matrixL().solve(half.transpose()), Eigen::EigenvaluesOnly)
          .eigenvalues()
          .cwiseMax(0);
  const Index m = z.rows();
  double most = -std::numeric_limits<double>::infinity(), best = 1;
  for (const double strength : kStrengths) {
    const double prior = strength + static_cast<double>(m) + 1, posterior = prior + count - 1;
    const double evidence = log_gamma_ratio(prior, posterior, m) +
                            prior / 2 * static_cast<double>(m) * std::log(strength) -
                            posterior / 2 * (strength + values.array()).log().sum();
    if (evidence > most) most = evidence, best = strength;
  }
  prior_degrees_ = best + static_cast<double>(m) + 1;
  const Eigen::LLT<MatrixXd> all(best * covariance + scatter);
  precision_ = directions() * all.solve(directions().transpose());
  log_determinant_ = 2 * all.matrixLLT().diagonal().array().log().sum();
}

LandmarkLaw::Member CohortLaw::member_without(std::size_t i) const {
  const auto place = static_cast<Index>(i);
  const double all = weights_.sum(), own = weights_[place], others = all - own;
  const VectorXd along = precision_ * displacements_.col(place);
  const double square = displacements_.col(place).dot(along);
  const double weight = own * all / others;  // about the mean of the others
  const auto m = static_cast<double>(directions().cols());
  // the mean covariance is A/(ν0 + W − m − 1), and that of a new shape has the error of the mean as well
  const double factor = (prior_degrees_ + others - 1 - m - 1) * others / (others + 1);
  LandmarkLaw::Member member;
  member.precision = factor * (precision_ + weight / (1 - weight * square) * along * along.transpose());
  member.log_constant = -(log_determinant_ + std::log(1 - weight * square)) / 2 + m / 2 * std::log(factor);
  return member;
}

LandmarkLaw CohortLaw::law_without(std::size_t i) const {
  const auto place = static_cast<Index>(i);
  const double own = weights_[place], others = weights_.sum() - own;
  Points mean = reference_;
  mean.reshaped() -= own / others * displacements_.col(place);
  LandmarkLaw::Member member = member_without(i);
  member.log_constant += degrees_ / 2 * std::log(degrees_ * scale_) - std::lgamma(degrees_ / 2);
  LandmarkLaw law(std::move(mean), {std::move(member)}, static_cast<double>(directions().cols()), degrees_,
                  degrees_ * scale_);
  law.set_tail(tail_);
  return law;
}

double CohortLaw::typical_distance() const {
  const Eigen::VectorXd distances = (directions().transpose() * displacements_).colwise().norm().transpose();
  return median_of({distances.begin(), distances.end()}) / std::sqrt(static_cast<double>(reference_.cols()));
}

void CohortLaw::fit_tails() {
  const auto m = static_cast<double>(directions().cols());
  std::vector<std::size_t> sound;
  for (std::size_t i = 0; i < is_accused_.size(); ++i)
    if (!is_accused_[i]) sound.push_back(i);
  VectorXd squares(static_cast<Index>(sound.size()));
  for (std::size_t k = 0; k < sound.size(); ++k) {
    const auto place = static_cast<Index>(sound[k]);
    const double all = weights_.sum(), others = all - weights_[place];
    const VectorXd own = all / others * displacements_.col(place);
    squares[static_cast<Index>(k)] = own.dot(member_without(sound[k]).precision * own);
  }
  double most = -std::numeric_limits<double>::infinity();
  for (const double degrees : kTails) {
    double scale = 1;
    for (int round = 0; round < 50; ++round)  // EM
      scale = ((degrees + m) * squares.array() / (degrees + squares.array() / scale)).mean() / m;
    const double likelihood =
        static_cast<double>(sound.size()) *
            (std::lgamma((degrees + m) / 2) - std::lgamma(degrees / 2) - m / 2 * std::log(degrees * scale)) -
        (degrees + m) / 2 * (squares.array() / (degrees * scale)).log1p().sum();
    if (likelihood > most) most = likelihood, degrees_ = degrees, scale_ = scale;
  }
  tail_ = {};
  const Index n = reference_.cols();
  const auto d = static_cast<double>(reference_.rows());
  MatrixXd distances = MatrixXd::Constant(n, static_cast<Index>(sound.size()), std::nan(""));
  for (std::size_t k = 0; k < sound.size(); ++k) {
    LandmarkLaw law = law_without(sound[k]);
    for (const int landmark : missing_[sound[k]]) law.drop(landmark);
    const auto place = static_cast<Index>(sound[k]);
    const double all = weights_.sum(), others = all - weights_[place];
    const auto predictions = law.predict(VectorXd(all / others * displacements_.col(place)));
    for (Index a = 0; a < n; ++a)
      if (law.has(static_cast<int>(a)))
        distances(a, static_cast<Index>(k)) = predictions[static_cast<std::size_t>(a)].distance;
  }
  const Eigen::ArrayXXd known = distances.array().isNaN().select(0, distances).array().square();
  const Eigen::ArrayXd counts =
      distances.array().isNaN().select(0, MatrixXd::Ones(n, distances.cols())).rowwise().sum();
  most = -std::numeric_limits<double>::infinity();
  for (const double degrees : kTails) {
    Eigen::ArrayXd scales = Eigen::ArrayXd::Ones(n);
    for (int round = 0; round < 50; ++round)
      scales = (kOwnScale + ((degrees + d) * known / (degrees + known.colwise() / scales)).rowwise().sum()) /
               (kOwnScale + counts * d);
    const double likelihood =
        counts.sum() * (std::lgamma((degrees + d) / 2) - std::lgamma(degrees / 2) - d / 2 * std::log(degrees)) -
        d / 2 * (counts * scales.log()).sum() -
        (degrees + d) / 2 * ((known.colwise() / scales) / degrees).log1p().sum();
    if (likelihood > most) most = likelihood, tail_ = {degrees, scales.matrix()};
  }
}

}  // namespace pulson::audit
