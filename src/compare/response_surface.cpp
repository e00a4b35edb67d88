#include "response_surface.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ResponseSurface::ResponseSurface(const MatrixXd& places, const VectorXd& values, const MatrixXd& metric)
    : root_(MatrixXd(metric.llt().matrixU())), origin_(places.col(0)) {
  centres_ = root_ * (places.colwise() - origin_);
  const Index m = places.cols();
  MatrixXd tail;
  for (degree_ = 2; degree_ >= 0; --degree_) {
    tail.resize(m, polynomials(VectorXd::Zero(places.rows())).size());
    for (Index k = 0; k < m; ++k) tail.row(k) = polynomials(centres_.col(k)).transpose();
    Eigen::ColPivHouseholderQR<MatrixXd> qr(tail);
    qr.setThreshold(1e-3);
    if (degree_ == 0 || qr.rank() == tail.cols()) break;
  }
  const Index q = tail.cols();
  MatrixXd system = MatrixXd::Zero(m + q, m + q);
  for (Index k = 0; k < m; ++k)
    system.col(k).head(m) = (centres_.colwise() - centres_.col(k)).colwise().norm().array().cube().matrix().transpose();
  system.topRightCorner(m, q) = tail;
  system.bottomLeftCorner(q, m) = tail.transpose();
  VectorXd right = VectorXd::Zero(m + q);
  right.head(m) = values;
  const VectorXd solution = system.colPivHouseholderQr().solve(right);
  weights_ = solution.head(m);
  coefficients_ = solution.tail(q);
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

double ResponseSurface::operator()(const VectorXd& x) const {
  const VectorXd y = root_ * (x - origin_);
  return weights_.dot((centres_.colwise() - y).colwise().norm().array().cube().matrix()) +
         coefficients_.dot(polynomials(y));
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
