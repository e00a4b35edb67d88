#include "pulson/warp/material_flow.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pulson {
namespace {

constexpr double kRankTolerance = 1e-10;
constexpr int kMaxNewton = 50;

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
  for (int k = 0; k < path_.grid.steps; ++k)
    noise_coefficients_.emplace_back(
        system_.noise->position_noise(path_.states[static_cast<std::size_t>(k)], w.col(k)) * inverse);
}

// Newton per point for X = c + Δt u(X), u the field of the landmarks' own implicit step, all points at once.
Points MaterialFlow::step(int k, const Points& x, const Points& labels) const {
  const auto i = static_cast<std::size_t>(k);
  const double dt = path_.grid.dt();
  const Points& q = path_.states[i + 1].q;
  const Points& p = path_.states[i].p;
  const Eigen::Index d = x.rows();
  Points c = x;
  if (!noise_coefficients_.empty()) c += system_.kernel.apply(labels, path_.initial().q, noise_coefficients_[i]);
  const double scale = std::max(c.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff());
  Points moved = c;
  Eigen::MatrixXd jacobian;
  for (int turn = 0; turn < kMaxNewton; ++turn) {
    const Points velocity = system_.kernel.apply_with_jacobian(moved, q, p, jacobian);
    double largest = 0;
    for (Eigen::Index m = 0; m < moved.cols(); ++m) {
      const Eigen::MatrixXd slope =
          Eigen::MatrixXd::Identity(d, d) - dt * Eigen::MatrixXd(jacobian.col(m).reshaped(d, d));
      const Eigen::VectorXd correction = slope.partialPivLu().solve(c.col(m) + dt * velocity.col(m) - moved.col(m));
      moved.col(m) += correction;
      largest = std::max(largest, correction.cwiseAbs().maxCoeff());
    }
    if (largest <= 1e-14 * scale) return moved;
    if (!std::isfinite(largest)) break;
  }
  throw StepError(k, path_.grid, "the map of the plane has no unique value at some point");
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
