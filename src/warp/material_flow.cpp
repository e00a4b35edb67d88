#include "pulson/warp/material_flow.hpp"

#include <algorithm>
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

MaterialFlow::MaterialFlow(StochasticSystem system, Trajectory path)
    : system_(std::move(system)), path_(std::move(path)), w_(acting_increments(path_.increments)) {
  const NoiseModel& noise = *system_.noise;
  if (path_.integrator != "variational" && path_.integrator != "variational-paper")
    throw InputError("the map of the plane is for the variational integrators; the path is of '" + path_.integrator +
                     "'");
  compensates_ = path_.integrator == "variational" && noise.traits().compensated;
  if (!noise.traits().moves_positions) return;
  const auto count = static_cast<int>(path_.initial().q.cols());
  double largest = 0;
  for (int k = 0; k < path_.grid.steps; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Points& q = path_.states[i].q;
    const Points& q_next = path_.states[i + 1].q;
    const Points& p = path_.step_momenta(k);
    Points delta = noise.gradient({q, p}, w_.col(k)).p - noise.spatial_noise(q, w_.col(k), count);
    if (compensates_)
      delta += path_.grid.dt() * (noise.compensation_gradient({q_next, p}).p - noise.spatial_compensation(q_next));
    largest = std::max(largest, delta.cwiseAbs().maxCoeff());
    landmark_noise_.push_back(std::move(delta));
  }
  if (largest == 0) {
    landmark_noise_.clear();
    return;
  }
  const Eigen::MatrixXd inverse = pseudo_inverse(system_.kernel.gram(path_.initial().q, path_.initial().q));
  for (const Points& delta : landmark_noise_) noise_coefficients_.emplace_back(delta * inverse);
}

// Σ_b K(x − q_b) p_b + η(x)
Points MaterialFlow::field(const Points& x, const Points& q, const Points& p) const {
  Points velocity = system_.kernel.apply(x, q, p);
  if (compensates_) velocity += system_.noise->spatial_compensation(x);
  return velocity;
}

// X = c + Δt u(X) with the field of the landmarks' own implicit step: all points at once by the fixed-point iteration,
// which contracts wherever the map is certain to exist, then by Newton. The landmarks go along as points and must land
// on themselves; where they do not, the step is too long for the map.
Points MaterialFlow::step(int k, const Points& x, const Points& labels) const {
  const auto i = static_cast<std::size_t>(k);
  const Points& q = path_.states[i + 1].q;
  Points c(x.rows(), x.cols() + q.cols());
  c << x, path_.states[i].q;
  if (w_.rows() > 0) c += system_.noise->spatial_noise(c, w_.col(k), static_cast<int>(q.cols()));
  if (!noise_coefficients_.empty()) {
    c.leftCols(x.cols()) += system_.kernel.apply(labels, path_.initial().q, noise_coefficients_[i]);
    c.rightCols(q.cols()) += landmark_noise_[i];
  }
  const std::optional<Points> moved = solve_points(c, q, path_.step_momenta(k));
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
    const Points next = c + dt * field(x, q, p);
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
    // Without the slope of η: where it matters the iteration converges all the same, if not quadratically.
    Points velocity = system_.kernel.apply_with_jacobian(x, q, p, jacobian);
    if (compensates_) velocity += system_.noise->spatial_compensation(x);
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
