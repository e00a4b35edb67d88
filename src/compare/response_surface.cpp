#include "response_surface.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// μ, of distances in deviations: from nearly none to where P alone is left.
constexpr double kLeastErrors = 1e-3, kMostErrors = 1e4, kStepOfErrors = 10;

}  // namespace

ResponseSurface::ResponseSurface(const MatrixXd& places, const MatrixXd& metric)
    : root_(MatrixXd(metric.llt().matrixU())), origin_(places.col(0)) {
  centres_ = root_ * (places.colwise() - origin_);
  weights_ = VectorXd::Zero(places.cols());
}

MatrixXd ResponseSurface::choose_polynomials(const VectorXd& weights) {
  MatrixXd tail;
  for (degree_ = 2; degree_ >= 0; --degree_) {
    tail.resize(centres_.cols(), polynomials(VectorXd::Zero(centres_.rows())).size());
    for (Index k = 0; k < tail.rows(); ++k) tail.row(k) = polynomials(centres_.col(k)).transpose();
    Eigen::ColPivHouseholderQR<MatrixXd> qr(weights.asDiagonal() * tail);
    qr.setThreshold(1e-3);
    if (degree_ == 0 || qr.rank() == tail.cols()) break;
  }
  return tail;
}

ResponseSurface::ResponseSurface(const MatrixXd& places, const VectorXd& values, const MatrixXd& metric)
    : ResponseSurface(places, metric) {
  const MatrixXd tail = choose_polynomials(VectorXd::Ones(places.cols()));
  take(MatrixXd(system(tail).colPivHouseholderQr().solve(right_side(values, tail.cols()))));
}

ResponseSurface::ResponseSurface(const MatrixXd& places, const VectorXd& values, const MatrixXd& metric,
                                 const VectorXd& weights)
    : ResponseSurface(places, metric) {
  const Index m = places.cols();
  const MatrixXd tail = choose_polynomials(weights.cwiseSqrt());
  const MatrixXd through = system(tail);
  const VectorXd right = right_side(values, tail.cols());
  double least = std::numeric_limits<double>::infinity();
  bool is_first = true;  // with no more places than polynomials nothing is left out, and all μ are alike
  for (double mu = kLeastErrors; mu <= kMostErrors; mu *= kStepOfErrors) {
    MatrixXd near = through;
    near.diagonal().head(m) += mu * weights.cwiseInverse();
    const MatrixXd inverse = near.inverse();
    const VectorXd solution = inverse * right;
    const VectorXd left_out = solution.head(m).cwiseQuotient(inverse.diagonal().head(m));
    const double misfit = left_out.cwiseAbs2().dot(weights);
    if (!is_first && !(misfit < least)) continue;
    is_first = false;
    least = std::isfinite(misfit) ? misfit : least;
    take(solution);
  }
}

// Of (w, c), the inverse of a symmetric matrix times the values, the product with |y − y_k|³ and Q(y).
VectorXd ResponseSurface::weights_at(const VectorXd& x, const MatrixXd& places, const MatrixXd& metric) {
  ResponseSurface surface(places, metric);
  const MatrixXd tail = surface.choose_polynomials(VectorXd::Ones(places.cols()));
  const VectorXd y = surface.root_ * (x - surface.origin_);
  VectorXd right(places.cols() + tail.cols());
  right << surface.distances_cubed(y), surface.polynomials(y);
  return VectorXd(surface.system(tail).colPivHouseholderQr().solve(right)).head(places.cols());
}

// Φ and Q, of which the solution is (w, c).
MatrixXd ResponseSurface::system(const MatrixXd& tail) const {
  const Index m = centres_.cols(), q = tail.cols();
  MatrixXd system = MatrixXd::Zero(m + q, m + q);
  for (Index k = 0; k < m; ++k) system.col(k).head(m) = distances_cubed(centres_.col(k));
  system.topRightCorner(m, q) = tail;
  system.bottomLeftCorner(q, m) = tail.transpose();
  return system;
}

VectorXd ResponseSurface::right_side(const VectorXd& values, Index polynomials) {
  VectorXd right = VectorXd::Zero(values.size() + polynomials);
  right.head(values.size()) = values;
  return right;
}

void ResponseSurface::take(const VectorXd& solution) {
  weights_ = solution.head(centres_.cols());
  coefficients_ = solution.tail(solution.size() - centres_.cols());
}

// 1, y, then products y_i y_j for j ≤ i.
VectorXd ResponseSurface::polynomials(const VectorXd& y) const {
  const Index n = y.size();
  VectorXd values(degree_ == 0 ? 1 : degree_ == 1 ? 1 + n : 1 + n + n * (n + 1) / 2);
  values[0] = 1;
  if (degree_ > 0) values.segment(1, n) = y;
  Index next = 1 + n;
  if (degree_ > 1)
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j <= i; ++j) values[next++] = y[i] * y[j];
  return values;
}

VectorXd ResponseSurface::distances_cubed(const VectorXd& y) const {
  return (centres_.colwise() - y).colwise().norm().array().cube().matrix().transpose();
}

double ResponseSurface::operator()(const VectorXd& x) const {
  const VectorXd y = root_ * (x - origin_);
  return weights_.dot(distances_cubed(y)) + coefficients_.dot(polynomials(y));
}

SecondOrder ResponseSurface::second_order(const VectorXd& x) const {
  const Index n = x.size();
  const VectorXd y = root_ * (x - origin_);
  VectorXd gradient = VectorXd::Zero(n);
  MatrixXd hessian = MatrixXd::Zero(n, n);
  for (Index k = 0; k < weights_.size(); ++k) {
    const VectorXd off = y - centres_.col(k);
    const double r = off.norm();
    gradient += 3 * weights_[k] * r * off;
    hessian.diagonal().array() += 3 * weights_[k] * r;
    if (r > 0) hessian += 3 * weights_[k] / r * off * off.transpose();
  }
  if (degree_ > 0) gradient += coefficients_.segment(1, n);
  Index next = 1 + n;
  if (degree_ > 1)
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j <= i; ++j) {
        const double c = coefficients_[next++];
        gradient[i] += c * y[j];
        gradient[j] += c * y[i];
        hessian(i, j) += c;
        hessian(j, i) += c;
      }
  return {root_.transpose() * gradient, -root_.transpose() * hessian * root_};
}

}  // namespace pulson::compare
