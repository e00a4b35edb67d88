#include "pulson/warp/material_flow.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pulson {
namespace {

constexpr double kRankTolerance = 1e-10;
constexpr int kMaxNewton = 50;
constexpr int kMaxTurns = 400;
constexpr double kContraction = 0.95;
constexpr double kSamePlace = 1e-9;  // of the size of the coordinates

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const double floor = kRankTolerance * values[values.size() - 1];
  const Eigen::VectorXd inverse = (values.array() >= floor).select(values.cwiseInverse(), 0);
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

MaterialFlow::MaterialFlow(StochasticSystem system, Trajectory path, const Eigen::MatrixXd& increments)
    : system_(std::move(system)), path_(std::move(path)) {
  if (increments.rows() == 0) return;
  const Eigen::MatrixXd w = acting_increments(increments);
  const Points& q0 = path_.initial().q;
  const Eigen::MatrixXd inverse = pseudo_inverse(system_.kernel.gram(q0, q0));
  for (int k = 0; k < path_.grid.steps; ++k) {
    landmark_noise_.push_back(system_.noise->position_noise(path_.states[static_cast<std::size_t>(k)], w.col(k)));
    noise_coefficients_.emplace_back(landmark_noise_.back() * inverse);
  }
}

// X = c + Δt u(X) with the field of the landmarks' own implicit step: all points at once by the fixed-point iteration,
// which contracts wherever the map is certain to exist, then by Newton. The landmarks go along as points and must land
// on themselves; where they do not, the step is too long for the map.
Points MaterialFlow::step(int k, const Points& x, const Points& labels) const {
  const auto i = static_cast<std::size_t>(k);
  const Points& q = path_.states[i + 1].q;
  Points c(x.rows(), x.cols() + q.cols());
  c << x, path_.states[i].q;
  if (!noise_coefficients_.empty()) {
    c.leftCols(x.cols()) += system_.kernel.apply(labels, path_.initial().q, noise_coefficients_[i]);
    c.rightCols(q.cols()) += landmark_noise_[i];
  }
  const std::optional<Points> moved = solve_points(c, q, path_.states[i].p);
  const double scale = std::max(c.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff());
  if (!moved || !((moved->rightCols(q.cols()) - q).cwiseAbs().maxCoeff() <= kSamePlace * scale))
    throw StepError(k, path_.grid, "the map of the plane has no unique value at some point");
  return moved->leftCols(x.cols());
}

std::optional<Points> MaterialFlow::solve_points(const Points& c, const Points& q, const Points& p) const {
  const double dt = path_.grid.dt();
  const double enough = 1e-14 * std::max(c.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff());
  Points x = c;
  double previous = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    const Points next = c + dt * system_.kernel.apply(x, q, p);
    const double correction = (next - x).cwiseAbs().maxCoeff();
    x = next;
    if (!std::isfinite(correction)) return std::nullopt;
    if (correction <= enough) return x;
    if (correction > kContraction * previous) break;
    previous = correction;
  }
  const Eigen::Index d = c.rows();
  Eigen::MatrixXd jacobian;
  for (int turn = 0; turn < kMaxNewton; ++turn) {
    const Points velocity = system_.kernel.apply_with_jacobian(x, q, p, jacobian);
    double largest = 0;
    for (Eigen::Index m = 0; m < x.cols(); ++m) {
      const Eigen::MatrixXd slope =
          Eigen::MatrixXd::Identity(d, d) - dt * Eigen::MatrixXd(jacobian.col(m).reshaped(d, d));
      if (!(slope.determinant() > 0)) return std::nullopt;
      const Eigen::VectorXd correction = slope.partialPivLu().solve(c.col(m) + dt * velocity.col(m) - x.col(m));
      x.col(m) += correction;
      largest = std::max(largest, correction.cwiseAbs().maxCoeff());
    }
    if (largest <= enough) return x;
  }
  return std::nullopt;
}

std::vector<Points> MaterialFlow::paths(const Points& labels) const {
  std::vector<Points> places{labels};
  for (int k = 0; k < path_.grid.steps; ++k) places.push_back(step(k, places.back(), labels));
  return places;
}

Points MaterialFlow::end(const Points& labels) const {
  Points x = labels;
  for (int k = 0; k < path_.grid.steps; ++k) x = step(k, x, labels);
  return x;
}

}  // namespace pulson
