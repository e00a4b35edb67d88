#include "implicit_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace pulson {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// A turn costs one kernel sum and a Newton step a factorisation, so slow contraction is still cheap.
constexpr double kContraction = 0.9;
constexpr int kMaxTurns = 400;
// Of continuation, as a part of Δt: a branch that cannot be followed so far ends there for all practical purposes.
constexpr double kSmallestStep = 1e-7;

double largest(const Points& x) { return x.size() == 0 ? 0 : x.cwiseAbs().maxCoeff(); }

// What the terms of Δt K(q)p add up to at most: their rounding is that of q.
double terms_size(const KernelOperator& kernel, const Points& p, double dt) {
  return dt * kernel.at_zero() * p.colwise().norm().sum();
}

// Whether no two landmarks turn about each other by more than a right angle from c to q. An iteration that overshoots
// can land on a root where two of them have passed each other; on the branch from Δt = 0 they cannot.
bool keeps_sides(const Points& c, const Points& q) {
  for (Eigen::Index b = 1; b < c.cols(); ++b) {
    const auto before = c.leftCols(b).colwise() - c.col(b);
    const auto after = q.leftCols(b).colwise() - q.col(b);
    if (!((before.array() * after.array()).colwise().sum() >= 0).all()) return false;
  }
  return true;
}

struct Iterated {
  Points x;
  bool converged = false;
  double contraction = 0;
};

// x ← map(x) from x until the correction is round-off: of x itself, or of terms as large as `rounding` that the map
// adds up, where their ratios say nothing any more.
template <class Map>
Iterated iterate(const Points& start, double rounding, const Map& map) {
  Iterated result{start, false, 0};
  double previous = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    Points next = map(result.x);
    const double correction = largest(next - result.x);
    const double scale = std::max(largest(next), std::numeric_limits<double>::min());
    result.x = std::move(next);
    if (!std::isfinite(correction)) return result;
    if (correction <= kEpsilon * scale) {
      result.converged = true;
      return result;
    }
    const bool at_round_off = correction <= 64 * kEpsilon * std::max(scale, rounding);
    if (at_round_off && correction >= previous) {
      result.converged = true;
      return result;
    }
    if (turn > 0 && !at_round_off) {
      result.contraction = std::max(result.contraction, correction / previous);
      if (result.contraction > kContraction) return result;
    }
    previous = correction;
  }
  return result;
}

// Newton's iteration for q = c + τK(q)p with its LU factors, as continuation in τ needs them.
class NewtonBranch {
 public:
  NewtonBranch(const KernelOperator& kernel, const Points& c, const Points& p, double rounding)
      : kernel_(kernel), c_(c), p_(p), q_(c), rounding_(rounding) {}

  const Points& q() const { return q_; }

  // Moves the root from τ to `tau_next`; false, leaving it, if it cannot be followed that far in one step.
  bool advance(double tau, double tau_next) {
    Eigen::PartialPivLU<Eigen::MatrixXd> lu = factor(q_, tau);
    const Points velocity = kernel_.apply(q_, q_, p_);
    const Points predicted = (tau_next - tau) * solve(lu, velocity);
    Points q = q_ + predicted;
    double total = 0;
    double previous = std::numeric_limits<double>::infinity();
    for (int turn = 0; turn < 20; ++turn) {
      lu = factor(q, tau_next);
      if (!(lu.determinant() > 0)) return false;
      const Points correction = solve(lu, c_ + tau_next * kernel_.apply(q, q, p_) - q);
      q += correction;
      const double size = largest(correction);
      total += size;
      // The corrector must stay close to the predictor, or it may have jumped to another root.
      if (!std::isfinite(size) || total > 0.5 * largest(predicted)) return is_round_off(total, q) && accept(q);
      if (is_round_off(size, q) || (size <= 1e-12 * std::max(largest(q), rounding_) && size >= 0.5 * previous))
        return accept(q);
      previous = size;
    }
    return false;
  }

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> factor(const Points& q, double tau) const {
    Eigen::MatrixXd matrix = -tau * kernel_.tangent_matrix(q, p_);
    matrix.diagonal().array() += 1;
    return Eigen::PartialPivLU<Eigen::MatrixXd>(matrix);
  }
  static Points solve(const Eigen::PartialPivLU<Eigen::MatrixXd>& lu, const Points& b) {
    return lu.solve(Eigen::VectorXd(b.reshaped())).reshaped(b.rows(), b.cols());
  }
  bool is_round_off(double size, const Points& q) const {
    return size <= 4 * kEpsilon * std::max(largest(q), rounding_);
  }
  bool accept(const Points& q) {
    if (!keeps_sides(q_, q)) return false;
    q_ = q;
    return true;
  }

  const KernelOperator& kernel_;
  const Points& c_;
  const Points& p_;
  Points q_;
  double rounding_;
};

}  // namespace

ImplicitRoot solve_positions(const KernelOperator& kernel, const Points& c, const Points& p, double dt,
                             RootSearch search) {
  const Iterated fixed =
      iterate(c, terms_size(kernel, p, dt), [&](const Points& q) -> Points { return c + dt * kernel.apply(q, q, p); });
  if (fixed.converged && keeps_sides(c, fixed.x)) return {fixed.x, true, false, fixed.contraction};
  if (search == RootSearch::kContracting) return {fixed.x, false, false, fixed.contraction};

  NewtonBranch branch(kernel, c, p, terms_size(kernel, p, dt));
  double s = 0;
  double step = 0.25;
  while (s < 1 && step >= kSmallestStep) {
    const double next = std::min(1.0, s + step);
    if (branch.advance(s * dt, next * dt)) {
      s = next;
      step *= 2;
    } else {
      step /= 2;
    }
  }
  return {branch.q(), s == 1, true, fixed.contraction};
}

Points solve_tangent(const KernelOperator& kernel, const Points& q, const Points& p, double dt, const Points& b) {
  const Iterated fixed =
      iterate(b, 0, [&](const Points& x) -> Points { return b + dt * kernel.apply_tangent(q, p, x); });
  if (fixed.converged) return fixed.x;
  Eigen::MatrixXd matrix = -dt * kernel.tangent_matrix(q, p);
  matrix.diagonal().array() += 1;
  return matrix.partialPivLu().solve(Eigen::VectorXd(b.reshaped())).reshaped(b.rows(), b.cols());
}

Points solve_tangent_transposed(const KernelOperator& kernel, const Points& q, const Points& p, double dt,
                                const Points& b) {
  const Iterated fixed = iterate(b, 0, [&](const Points& x) -> Points { return b + dt * kernel.gradient(q, x, p); });
  if (fixed.converged) return fixed.x;
  Eigen::MatrixXd matrix = -dt * kernel.tangent_matrix(q, p).transpose();
  matrix.diagonal().array() += 1;
  return matrix.partialPivLu().solve(Eigen::VectorXd(b.reshaped())).reshaped(b.rows(), b.cols());
}

}  // namespace pulson
