#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void check(const LandmarkObservations& observed) {
  const Index d = observed.target.rows();
  const auto n = static_cast<std::size_t>(observed.target.cols());
  if (observed.covariances.empty()) require_positive("sigma", observed.sigma);
  if (!observed.covariances.empty() && observed.covariances.size() != n)
    throw InputError(fmt::format("there are {} covariances for {} landmarks", observed.covariances.size(), n));
  for (std::size_t a = 0; a < observed.covariances.size(); ++a) {
    const MatrixXd& r = observed.covariances[a];
    if (r.rows() != d || r.cols() != d)
      throw InputError(
          fmt::format("the covariance of landmark {} is {}x{}; {}x{} is needed", a + 1, r.rows(), r.cols(), d, d));
    if (!is_covariance(r))
      throw InputError(fmt::format("the covariance of landmark {} is not symmetric and positive definite", a + 1));
  }
  for (Index a = 0; a < observed.target.cols(); ++a)
    if (observed.target.col(a).array().isInf().any())
      throw InputError(fmt::format("landmark {} of the target has an infinite coordinate", a + 1));
}

std::vector<Index> observed_axes(const Points& target, Index a) {
  std::vector<Index> axes;
  for (Index axis = 0; axis < target.rows(); ++axis)
    if (!std::isnan(target(axis, a))) axes.push_back(axis);
  return axes;
}

// L⁻¹ of the covariance of these axes of landmark a.
MatrixXd inverse_root(const LandmarkObservations& observed, Index a, const std::vector<Index>& axes) {
  const MatrixXd one = MatrixXd::Identity(std::ssize(axes), std::ssize(axes));
  if (observed.covariances.empty()) return one / observed.sigma;
  const MatrixXd marginal = observed.covariances[static_cast<std::size_t>(a)](axes, axes);
  return marginal.llt().matrixL().solve(one);
}

}  // namespace

LandmarkTerm::LandmarkTerm(const LandmarkObservations& observations)
    : observations_(observations),
      dimension_(observations.target.rows()),
      target_(observations.target.array().isNaN().select(0, observations.target).reshaped()) {
  check(observations);
  const VectorXd weights = landmark_weights(observations.weights, observations.target.cols());
  std::vector<Eigen::Triplet<double>> entries;
  Index rows = 0;
  for (Index a = 0; a < weights.size(); ++a) {
    if (weights[a] == 0) continue;
    const std::vector<Index> axes = observed_axes(observations.target, a);
    const MatrixXd block = std::sqrt(weights[a]) * inverse_root(observations, a, axes);
    for (Index i = 0; i < block.rows(); ++i, ++rows)
      for (Index j = 0; j <= i; ++j)
        if (block(i, j) != 0)
          entries.emplace_back(rows, a * observations.target.rows() + axes[static_cast<std::size_t>(j)], block(i, j));
    log_determinant_ -= 2 * block.diagonal().array().log().sum();
  }
  if (rows == 0) throw InputError("nothing is observed: no landmark has a weight above 0 and a coordinate");
  log_determinant_ += static_cast<double>(rows) * std::log(2 * std::numbers::pi);
  whitening_.resize(rows, target_.size());
  whitening_.setFromTriplets(entries.begin(), entries.end());
  const bool is_uniform = observations.covariances.empty() && (weights.array() == weights[0]).all();
  if (is_uniform && rows == target_.size()) scale_ = whitening_.coeff(0, 0);
}

MatrixXd LandmarkTerm::precision(Index a) const {
  const auto column = [&](Index axis) { return whitening_.col(a * dimension_ + axis); };
  MatrixXd precision(dimension_, dimension_);
  for (Index j = 0; j < dimension_; ++j)
    for (Index i = 0; i <= j; ++i) precision(i, j) = precision(j, i) = column(i).dot(column(j));
  return precision;
}

LandmarkTerm LandmarkTerm::part(const std::vector<Index>& landmarks, double weight) const {
  const VectorXd weights = landmark_weights(observations_.weights, observations_.target.cols());
  LandmarkObservations some{observations_.target(Eigen::all, landmarks), observations_.sigma,
                            weight * weights(landmarks)};
  if (!observations_.covariances.empty())
    for (const Index a : landmarks) some.covariances.push_back(observations_.covariances[static_cast<std::size_t>(a)]);
  return LandmarkTerm(some);
}

LandmarkTerm LandmarkTerm::moved(const Points& shift) const {
  require_size("the shift of the target", shift, observations_.target.rows(), observations_.target.cols());
  LandmarkObservations there = observations_;
  there.target += shift;
  return LandmarkTerm(there);
}

LandmarkTerm LandmarkTerm::blurred(double variance) const {
  LandmarkObservations there = observations_;
  const Index d = there.target.rows();
  there.covariances.clear();
  const VectorXd weights = landmark_weights(there.weights, there.target.cols());
  for (Index a = 0; a < weights.size(); ++a) {
    const MatrixXd given = observations_.covariances.empty()
                               ? MatrixXd(observations_.sigma * observations_.sigma * MatrixXd::Identity(d, d))
                               : observations_.covariances[static_cast<std::size_t>(a)];
    const double weight = weights[a] > 0 ? weights[a] : 1;
    there.covariances.emplace_back(given / weight + variance * MatrixXd::Identity(d, d));
  }
  there.weights = (weights.array() > 0).cast<double>();
  return LandmarkTerm(there);
}

VectorXd LandmarkTerm::residual(const Points& q) const {
  require_size("the landmarks that are compared with the target", q, dimension_, target_.size() / dimension_);
  return whitening_ * (q.reshaped() - target_);
}

double LandmarkTerm::value(const Points& q) const { return 0.5 * residual(q).squaredNorm(); }

Points LandmarkTerm::gradient(const Points& q) const {
  const VectorXd gradient = whitening_.transpose() * residual(q);
  return gradient.reshaped(q.rows(), q.cols());
}

DataTerm::Linearisation LandmarkTerm::linearise(const Points& q, const MatrixXd& changes) const {
  require_size("the changes of the landmarks", changes, q.size(), changes.cols());
  if (scale_) return {residual(q), *scale_ * changes};
  return {residual(q), whitening_ * changes};
}

VectorXd distances(const Points& q, const Points& target) {
  require_size("the target", target, q.rows(), q.cols());
  VectorXd distances(q.cols());
  for (Index a = 0; a < q.cols(); ++a) {
    const std::vector<Index> axes = observed_axes(target, a);
    distances[a] = axes.empty() ? std::numeric_limits<double>::quiet_NaN() : (q(axes, a) - target(axes, a)).norm();
  }
  return distances;
}

double rms_distance(const Points& q, const Points& target) {
  const VectorXd all = distances(q, target);
  const auto is_missing = all.array().isNaN();
  return std::sqrt(is_missing.select(0, all).squaredNorm() / static_cast<double>(all.size() - is_missing.count()));
}

}  // namespace pulson::matching
