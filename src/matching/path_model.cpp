#include "path_model.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "pulson/core/parallel.hpp"
#include "pulson/matching/landmark_term.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

Block block(const MatrixXd& blocks, Index a, Index d) { return blocks.col(a).reshaped(d, d); }

MatrixXd symmetric_root(const MatrixXd& m) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(m);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

// (I + ½Δt G)v of each landmark, or of the transposed blocks.
Points half_step(const MatrixXd& gradients, double dt, const Points& v, bool transposed) {
  const Index d = v.rows();
  Points moved(d, v.cols());
  for (Index a = 0; a < v.cols(); ++a) {
    const Block g = block(gradients, a, d);
    if (transposed)
      moved.col(a) = v.col(a) + 0.5 * dt * (g.transpose() * v.col(a));
    else
      moved.col(a) = v.col(a) + 0.5 * dt * (g * v.col(a));
  }
  return moved;
}

Points by_blocks(const MatrixXd& blocks, const Points& v, bool transposed) {
  const Index d = v.rows();
  Points moved(d, v.cols());
  for (Index a = 0; a < v.cols(); ++a) {
    if (transposed)
      moved.col(a) = block(blocks, a, d).transpose() * v.col(a);
    else
      moved.col(a) = block(blocks, a, d) * v.col(a);
  }
  return moved;
}

}  // namespace

void PathDirection::add(double factor, const PathDirection& other) {
  for (std::size_t j = 0; j < nodes.size(); ++j) nodes[j] += factor * other.nodes[j];
  for (std::size_t k = 0; k < momenta.size(); ++k) momenta[k] += factor * other.momenta[k];
}

void PathDirection::scale(double factor) {
  for (Points& q : nodes) q *= factor;
  for (Points& p : momenta) p *= factor;
}

double pairing(const NodeCovector& covector, const PathDirection& direction) {
  double sum = 0;
  for (std::size_t j = 1; j < covector.size(); ++j) sum += covector[j].cwiseProduct(direction.nodes[j]).sum();
  return sum;
}

PathModel::PathModel(const EffectiveHamiltonian& system, const DataTerm& data, const DiscretePath& path, double weight)
    : system_(system), data_(data), path_(path), weight_(weight) {
  const Index d = path.end().rows(), n = path.end().cols();
  const double dt = path.grid.dt();
  const auto steps = path.middles.size();
  inverses_.resize(steps);
  parallel_for(path.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    inverses_[k].resize(d * d, n);
    for (Index a = 0; a < n; ++a) {
      const Block slope = Block::Identity(d, d) - 0.5 * dt * block(path_.gradients[k], a, d);
      inverses_[k].col(a) = Block(slope.inverse()).reshaped();
    }
  });
  if (const LandmarkTerm* landmarks = data.landmarks()) {
    for (Index a = 0; a < n; ++a) roots_.push_back(symmetric_root(weight * landmarks->precision(a)));
  } else if (data.root_of_each_axis() != nullptr) {
    axis_root_ = std::sqrt(weight) * *data.root_of_each_axis();
  } else {
    root_ = std::sqrt(weight) * data.linearise(path.end(), MatrixXd::Identity(d * n, d * n)).changes;
  }
  propagate();
  factors_ = factors_from(0);
}

void PathModel::propagate() {
  const Index d = path_.end().rows(), n = path_.end().cols();
  const double dt = path_.grid.dt();
  const auto steps = path_.middles.size();
  from_steps_.assign(steps, MatrixXd(d * d, n));
  from_nodes_ = from_steps_;
  for (Index a = 0; a < n; ++a) {
    Block suffix = roots_.empty() ? Block(Block::Identity(d, d)) : Block(roots_[static_cast<std::size_t>(a)]);
    for (std::size_t k = steps; k-- > 0;) {
      const Block psi = suffix * block(inverses_[k], a, d);
      suffix = psi + 0.5 * dt * psi * block(path_.gradients[k], a, d);
      from_steps_[k].col(a) = psi.reshaped();
      from_nodes_[k].col(a) = suffix.reshaped();
    }
  }
}

PathModel::Factors PathModel::factors_from(std::size_t k) const {
  const Index d = path_.end().rows(), n = path_.end().cols();
  MatrixXd sum = MatrixXd::Zero(d * n, d * n);
  parallel_for(static_cast<int>(n), [&](int b) {
    for (std::size_t j = k; j < from_steps_.size(); ++j)
      path_.cometrics[j].add_transformed(from_steps_[j], path_.grid.dt(), b, sum);
  });
  if (axis_root_.size() > 0) {
    const auto root = axis_root_.triangularView<Eigen::Upper>();
    sum.triangularView<Eigen::StrictlyLower>() = sum.transpose();
    parallel_for(static_cast<int>(d * d), [&](int pair) {
      const Index i = pair % d, j = pair / d;
      if (i > j) return;
      const MatrixXd half = root * sum.block(i * n, j * n, n, n);
      sum.block(i * n, j * n, n, n) = (root * half.transpose()).transpose();
    });
  } else if (roots_.empty()) {
    // From axis-major to landmark-major, as R has it.
    MatrixXd by_axis(root_.rows(), d * n);
    for (Index axis = 0; axis < d; ++axis) by_axis.middleCols(axis * n, n) = root_(Eigen::all, Eigen::seqN(axis, n, d));
    sum = by_axis * (sum.selfadjointView<Eigen::Upper>() * by_axis.transpose()).eval();
  }
  sum.diagonal().array() += 1;
  return Factors(sum.selfadjointView<Eigen::Upper>());
}

VectorXd PathModel::rooted(const Points& end_change) const {
  if (axis_root_.size() > 0) return (axis_root_.triangularView<Eigen::Upper>() * end_change.transpose()).reshaped();
  return root_ * end_change.reshaped();
}

VectorXd PathModel::whitened(const Points& end_change) const {
  if (roots_.empty()) return rooted(end_change);
  Points r(end_change.rows(), end_change.cols());
  for (Index a = 0; a < r.cols(); ++a) r.col(a) = roots_[static_cast<std::size_t>(a)] * end_change.col(a);
  return r.transpose().reshaped();
}

VectorXd PathModel::whitened_from(std::size_t k, const Points& deviation) const {
  const Points at_end = by_blocks(from_nodes_[k], deviation, false);
  return roots_.empty() ? rooted(at_end) : VectorXd(at_end.transpose().reshaped());
}

Points PathModel::whitened_transposed(const VectorXd& r) const {
  const Index d = path_.end().rows(), n = path_.end().cols();
  if (axis_root_.size() > 0) return r.reshaped(n, d).transpose() * axis_root_;
  if (roots_.empty()) return (root_.transpose() * r).reshaped(d, n);
  Points q = r.reshaped(n, d).transpose();
  for (Index a = 0; a < n; ++a) q.col(a) = (roots_[static_cast<std::size_t>(a)] * q.col(a)).eval();
  return q;
}

NodeCovector PathModel::gradient() const {
  const auto steps = path_.middles.size();
  const double half = 0.5 * path_.grid.dt();
  std::vector<Points> forces(steps);
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    forces[k] = system_.force(path_.middles[k]);
  });
  NodeCovector gradient(steps + 1, Points::Zero(path_.end().rows(), path_.end().cols()));
  for (std::size_t k = 0; k < steps; ++k) {
    gradient[k + 1] += path_.middles[k].p - half * forces[k];
    if (k > 0) gradient[k] -= path_.middles[k].p + half * forces[k];
  }
  gradient.back() += weight_ * data_.gradient(path_.end());
  return gradient;
}

NodeCovector PathModel::hessian(const PathDirection& direction) const {
  const auto steps = path_.middles.size();
  const double half = 0.5 * path_.grid.dt();
  std::vector<Points> momenta(steps), forces(steps);
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    const PhaseState& at = path_.middles[k];
    const Points dq = 0.5 * (direction.nodes[k] + direction.nodes[k + 1]);
    // What the fields gain where their centres move, or, for noise, where other landmarks do: not in the model.
    const Points moved = system_.velocity_change(at, dq) - by_blocks(path_.gradients[k], dq, false);
    momenta[k] = direction.momenta[k] - path_.cometrics[k].solve(moved);
    forces[k] = system_.force_change(at, {dq, momenta[k]});
  });
  NodeCovector product(steps + 1, Points::Zero(path_.end().rows(), path_.end().cols()));
  for (std::size_t k = 0; k < steps; ++k) {
    product[k + 1] += momenta[k] - half * forces[k];
    if (k > 0) product[k] -= momenta[k] + half * forces[k];
  }
  product.back() += whitened_transposed(whitened(direction.nodes.back()));
  return product;
}

PathDirection PathModel::swept(const NodeCovector& covector, const Points& at_end, std::size_t first,
                               const Points& deviation) const {
  const auto steps = path_.middles.size();
  const double dt = path_.grid.dt();
  const Points none = Points::Zero(at_end.rows(), at_end.cols());
  PathDirection direction{std::vector<Points>(steps + 1, none), std::vector<Points>(steps, none)};
  Points costate = covector.back() + at_end;
  for (std::size_t k = steps; k-- > first;) {
    direction.momenta[k] = by_blocks(inverses_[k], costate, true);
    costate = half_step(path_.gradients[k], dt, direction.momenta[k], true) + covector[k];
  }
  std::vector<Points> velocities(steps);
  parallel_for(path_.grid.steps - static_cast<int>(first), [&](int step) {
    const std::size_t k = first + static_cast<std::size_t>(step);
    velocities[k] = path_.cometrics[k].apply(direction.momenta[k]);
  });
  direction.nodes[first] = deviation;
  for (std::size_t k = first; k < steps; ++k)
    direction.nodes[k + 1] = by_blocks(
        inverses_[k], half_step(path_.gradients[k], dt, direction.nodes[k], false) + dt * velocities[k], false);
  return direction;
}

PathDirection PathModel::solve(const NodeCovector& covector) const {
  const Points none = Points::Zero(path_.end().rows(), path_.end().cols());
  const PathDirection free = swept(covector, none, 0, none);
  return swept(covector, -whitened_transposed(factors_.solve(whitened(free.nodes.back()))), 0, none);
}

double PathModel::misfit(std::size_t k, const Points& deviation) const {
  return 0.5 * whitened_from(k, deviation).squaredNorm();
}

PathDirection PathModel::feedback(std::size_t k, const Points& deviation) const {
  const NodeCovector none(path_.middles.size() + 1, Points::Zero(deviation.rows(), deviation.cols()));
  const VectorXd excess = whitened_from(k, deviation);
  return swept(none, -whitened_transposed(factors_from(k).solve(excess)), k, deviation);
}

}  // namespace pulson
