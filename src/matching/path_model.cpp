#include "path_model.hpp"

#include "kernels/symmetric_matrix.hpp"
#include "landmark_blocks.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Block = LandmarkBlock;

// Of a feedback by conjugate gradients.
constexpr int kMostFeedbackProducts = 200;

}  // namespace

void PathDirection::add(double factor, const PathDirection& other) {
  for (std::size_t j = 0; j < nodes.size(); ++j) nodes[j] += factor * other.nodes[j];
  for (std::size_t k = 0; k < momenta.size(); ++k) momenta[k] += factor * other.momenta[k];
}

void PathDirection::scale(double factor) {
  for (Points& q : nodes) q *= factor;
  for (Points& p : momenta) p *= factor;
}

NodeCovector node_rows(const std::vector<Points>& momenta, const std::vector<Points>& forces, double dt) {
  const double half = 0.5 * dt;
  NodeCovector rows(momenta.size() + 1, Points::Zero(momenta.front().rows(), momenta.front().cols()));
  for (std::size_t k = 0; k < momenta.size(); ++k) {
    rows[k + 1] += momenta[k] - half * forces[k];
    if (k > 0) rows[k] -= momenta[k] + half * forces[k];
  }
  return rows;
}

double pairing(const NodeCovector& covector, const PathDirection& direction) {
  double sum = 0;
  for (std::size_t j = 1; j < covector.size(); ++j) sum += covector[j].cwiseProduct(direction.nodes[j]).sum();
  return sum;
}

PathModel::PathModel(const EffectiveHamiltonian& system, const DataTerm& data, const DiscretePath& path, double weight)
    : system_(system),
      data_(data),
      path_(path),
      weight_(weight),
      noise_varies_(!system.system().noise->traits().additive),
      form_(data.form_of_each_axis()) {
  const Index d = path.end().rows(), n = path.end().cols();
  const double dt = path.grid.dt();
  const auto steps = path.middles.size();
  inverses_.resize(steps);
  parallel_for(path.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    inverses_[k] = half_step_inverses(path_.gradients[k], dt, d);
  });
  if (const LandmarkTerm* landmarks = data.landmarks()) {
    roots_.resize(d * d, n);
    for (Index a = 0; a < n; ++a) roots_.col(a) = symmetric_root(weight * landmarks->precision(a)).reshaped();
  } else if (form_ == nullptr) {
    root_ = std::sqrt(weight) * data.linearise(path.end(), MatrixXd::Identity(d * n, d * n)).changes;
  }
  if (path.cometrics.front().is_on_line()) keep_sums_on_line();
  propagate();
  factorise();
}

void PathModel::propagate() {
  const Index d = path_.end().rows(), n = path_.end().cols();
  const double dt = path_.grid.dt();
  const auto steps = path_.middles.size();
  from_steps_.assign(steps, MatrixXd(d * d, n));
  from_nodes_ = from_steps_;
  for (Index a = 0; a < n; ++a) {
    Block suffix = has_roots() ? Block(block(roots_, a, d)) : Block(Block::Identity(d, d));
    for (std::size_t k = steps; k-- > 0;) {
      const Block psi = suffix * block(inverses_[k], a, d);
      suffix = psi + 0.5 * dt * psi * block(path_.gradients[k], a, d);
      from_steps_[k].col(a) = psi.reshaped();
      from_nodes_[k].col(a) = suffix.reshaped();
    }
  }
}

MatrixXd PathModel::end_covariance() const {
  const Index d = path_.end().rows(), n = path_.end().cols();
  std::vector<MatrixXd> by_landmark;
  for (const MatrixXd& blocks : from_steps_) by_landmark.emplace_back(blocks.transpose());
  MatrixXd sum(d * n, d * n);
  parallel_for(static_cast<int>(n), [&](int b) {
    MatrixXd blocks = MatrixXd::Zero(b + 1, d * d);
    for (std::size_t k = 0; k < by_landmark.size(); ++k)
      path_.cometrics[k].add_transformed(by_landmark[k], path_.grid.dt(), b, blocks);
    // (i, a; j, b) with a ≤ b: above the diagonal of the whole where i ≤ j; else its mirror image is.
    for (Index j = 0; j < d; ++j)
      for (Index i = 0; i < d; ++i) {
        const auto part = blocks.col(i + j * d);
        if (i <= j)
          sum.col(j * n + b).segment(i * n, b + 1) = part;
        else
          sum.row(j * n + b).segment(i * n, b) = part.head(b).transpose();
      }
  });
  return sum;
}

// On a line N = I, and C is of landmarks: S = I + Σ Δt ψ_k A_k ψ_k with numbers ψ.
void PathModel::factorise_line() {
  const Index n = path_.end().cols();
  const auto steps = static_cast<Index>(path_.middles.size());
  MatrixXd places(n, steps), weights(n, steps);
  VectorXd noise = VectorXd::Ones(n);
  for (Index k = 0; k < steps; ++k) {
    const auto step = static_cast<std::size_t>(k);
    places.col(k) = path_.middles[step].q.transpose();
    weights.col(k) = std::sqrt(path_.grid.dt()) * from_steps_[step].transpose();
    noise += weights.col(k).cwiseAbs2().cwiseProduct(path_.cometrics[step].own());
  }
  line_.emplace(system_.system().kernel.terms().front(), places, weights, noise);
}

void PathModel::factorise() {
  if (path_.cometrics.front().is_on_line() && has_roots()) return factorise_line();
  const Index d = path_.end().rows(), n = path_.end().cols();
  MatrixXd system = end_covariance();
  if (form_ != nullptr) {
    for (Index axis = 0; axis < d; ++axis)
      system.block(axis * n, axis * n, n, n).triangularView<Eigen::Upper>() += form_->inverse / weight_;
  } else {
    if (!has_roots()) {
      // From axis-major to landmark-major, as C has it.
      MatrixXd by_axis(root_.rows(), d * n);
      for (Index axis = 0; axis < d; ++axis)
        by_axis.middleCols(axis * n, n) = root_(Eigen::all, Eigen::seqN(axis, n, d));
      system = by_axis * (system.selfadjointView<Eigen::Upper>() * by_axis.transpose()).eval();
    }
    system.diagonal().array() += 1;
  }
  factor_ = system.selfadjointView<Eigen::Upper>();
  factorise_in_place(factor_);
}

VectorXd PathModel::observed(const Points& end_change) const {
  if (form_ != nullptr) return end_change.transpose().reshaped();
  if (!has_roots()) return root_ * end_change.reshaped();
  return by_blocks(roots_, end_change, false).transpose().reshaped();
}

Points PathModel::observed_transposed(const VectorXd& r) const {
  const Index d = path_.end().rows(), n = path_.end().cols();
  if (form_ == nullptr && !has_roots()) return (root_.transpose() * r).reshaped(d, n);
  const Points q = r.reshaped(n, d).transpose();
  return form_ != nullptr ? q : by_blocks(roots_, q, true);
}

VectorXd PathModel::observed_from(std::size_t k, const Points& deviation) const {
  const Points at_end = by_blocks(from_nodes_[k], deviation, false);
  return has_roots() ? VectorXd(at_end.transpose().reshaped()) : observed(at_end);
}

VectorXd PathModel::weighed(const VectorXd& r) const {
  if (form_ == nullptr) return r;
  const Index d = path_.end().rows(), n = path_.end().cols();
  const auto root = form_->root.triangularView<Eigen::Upper>();
  const MatrixXd half = root * r.reshaped(n, d);
  return weight_ * MatrixXd(root.transpose() * half).reshaped();
}

VectorXd PathModel::system_solve(const VectorXd& r) const {
  if (line_) {
    VectorXd solved = r;
    line_->solve_in_place(solved);
    return solved;
  }
  MatrixXd solved = r;
  solve_factorised(factor_, solved);
  return solved;
}

// S_k⁻¹r by conjugate gradients, preconditioned by S, to an accuracy relative in the norm of S⁻¹.
VectorXd PathModel::solved_iteratively(std::size_t k, const VectorXd& r, double accuracy) const {
  VectorXd residual = r;
  VectorXd answer = VectorXd::Zero(residual.size());
  VectorXd along = system_solve(residual);
  double squared = residual.dot(along);
  const double enough = accuracy * accuracy * squared;
  for (int i = 0; squared > enough && i < kMostFeedbackProducts; ++i) {
    const VectorXd product = system_product(k, along);
    const double length = squared / along.dot(product);
    answer += length * along;
    residual -= length * product;
    const VectorXd solved = system_solve(residual);
    const double before = squared;
    squared = residual.dot(solved);
    along = solved + (squared / before) * along;
  }
  return answer;
}

VectorXd PathModel::system_product(std::size_t k, const VectorXd& r) const {
  const Index d = path_.end().rows(), n = path_.end().cols();
  const Points none = Points::Zero(d, n);
  const NodeCovector still(path_.middles.size() + 1, none);
  const VectorXd moved = observed(swept(still, observed_transposed(r), k, none).nodes.back());
  if (form_ == nullptr) return moved + r;
  return moved + MatrixXd(form_->inverse * r.reshaped(n, d)).reshaped() / weight_;
}

NodeCovector PathModel::gradient() const {
  const auto steps = path_.middles.size();
  std::vector<Points> momenta(steps), forces(steps);
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    momenta[k] = path_.middles[k].p;
    forces[k] = system_.force(path_.middles[k]);
  });
  NodeCovector gradient = node_rows(momenta, forces, path_.grid.dt());
  gradient.back() += weight_ * data_.gradient(path_.end());
  return gradient;
}

NodeCovector PathModel::hessian(const PathDirection& direction) const {
  const auto steps = path_.middles.size();
  std::vector<Points> dq(steps);
  for (std::size_t k = 0; k < steps; ++k) dq[k] = 0.5 * (direction.nodes[k] + direction.nodes[k + 1]);
  const SlopesOnLine moved = slopes_on_line(dq);
  std::vector<Points> momenta = cometric_solutions(field_changes(dq, moved));
  for (std::size_t k = 0; k < steps; ++k) momenta[k] = direction.momenta[k] - momenta[k];
  NodeCovector product = node_rows(momenta, force_changes(dq, momenta, moved), path_.grid.dt());
  product.back() += observed_transposed(weighed(observed(direction.nodes.back())));
  return product;
}

// On a line, with K' and K'' of each pair, v_a = Σ_b K p_b and f_a = p_a Σ_b K' p_b. Sums of p do not change.
void PathModel::keep_sums_on_line() {
  std::vector<const LineCovariance*> steps;
  std::vector<Points> momenta;
  for (std::size_t k = 0; k < path_.middles.size(); ++k) {
    steps.push_back(&path_.cometrics[k].line());
    momenta.push_back(path_.middles[k].p);
  }
  on_line_.emplace(system_.system().kernel.terms().front(), steps);
  of_momenta_ = on_line_->slope_and_second(momenta);
}

// Of the weights δq_b p_b.
PathModel::SlopesOnLine PathModel::slopes_on_line(const std::vector<Points>& dq) const {
  if (!on_line_) return {};
  std::vector<Points> weights(dq.size());
  for (std::size_t k = 0; k < dq.size(); ++k) weights[k] = dq[k].cwiseProduct(path_.middles[k].p);
  return on_line_->slope_and_second(weights);
}

// What the fields gain where their centres move, or, for noise, where other landmarks do: not in the model.
std::vector<Points> PathModel::field_changes(const std::vector<Points>& dq, const SlopesOnLine& moved) const {
  std::vector<Points> changes(dq.size());
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    if (!on_line_) {
      changes[k] = system_.velocity_change(path_.middles[k], dq[k]);
    } else {
      changes[k] = dq[k].cwiseProduct(of_momenta_.first[k]) - moved.first[k];
      if (noise_varies_) changes[k] += system_.noise_change(path_.middles[k], {dq[k], 0 * dq[k]}).p;
    }
    changes[k] -= by_blocks(path_.gradients[k], dq[k], false);
  });
  return changes;
}

std::vector<Points> PathModel::force_changes(const std::vector<Points>& dq, const std::vector<Points>& dp,
                                             const SlopesOnLine& moved) const {
  std::vector<Points> changes(dq.size()), slopes;
  if (on_line_) slopes = on_line_->slope(dp);
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    const PhaseState& at = path_.middles[k];
    if (!on_line_) {
      changes[k] = system_.force_change(at, {dq[k], dp[k]});
      return;
    }
    changes[k] = dp[k].cwiseProduct(of_momenta_.first[k]) +
                 at.p.cwiseProduct(slopes[k] + dq[k].cwiseProduct(of_momenta_.second[k]) - moved.second[k]);
    if (noise_varies_) changes[k] += system_.noise_change(at, {dq[k], dp[k]}).q;
  });
  return changes;
}

std::vector<Points> PathModel::cometric_solutions(const std::vector<Points>& v) const {
  if (on_line_) return on_line_->solve(v);
  std::vector<Points> solved(v.size());
  parallel_for(path_.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    solved[k] = path_.cometrics[k].solve(v[k]);
  });
  return solved;
}

// From step `first` on.
std::vector<Points> PathModel::velocities(const std::vector<Points>& p, std::size_t first) const {
  std::vector<Points> velocities(p.size());
  if (on_line_) velocities = on_line_->value(p);
  parallel_for(path_.grid.steps - static_cast<int>(first), [&](int step) {
    const std::size_t k = first + static_cast<std::size_t>(step);
    if (on_line_)
      velocities[k] += p[k] * path_.cometrics[k].own().asDiagonal();
    else
      velocities[k] = path_.cometrics[k].apply(p[k]);
  });
  return velocities;
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
  const std::vector<Points> driven = velocities(direction.momenta, first);
  direction.nodes[first] = deviation;
  for (std::size_t k = first; k < steps; ++k)
    direction.nodes[k + 1] =
        by_blocks(inverses_[k], half_step(path_.gradients[k], dt, direction.nodes[k], false) + dt * driven[k], false);
  return direction;
}

PathDirection PathModel::solve(const NodeCovector& covector) const {
  const Points none = Points::Zero(path_.end().rows(), path_.end().cols());
  const PathDirection free = swept(covector, none, 0, none);
  return swept(covector, -observed_transposed(system_solve(observed(free.nodes.back()))), 0, none);
}

double PathModel::misfit(std::size_t k, const Points& deviation) const {
  const VectorXd r = observed_from(k, deviation);
  return 0.5 * r.dot(weighed(r));
}

PathDirection PathModel::feedback(std::size_t k, const Points& deviation, double accuracy) const {
  const VectorXd answer = solved_iteratively(k, observed_from(k, deviation), accuracy);
  const NodeCovector none(path_.middles.size() + 1, Points::Zero(deviation.rows(), deviation.cols()));
  return swept(none, -observed_transposed(answer), k, deviation);
}

}  // namespace pulson::matching
