#include "implicit_step.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>
#include <Eigen/QR>

namespace pulson {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Of a linear iteration: a turn costs one product and the direct way a factorisation.
constexpr double kLinearContraction = 0.9;
constexpr int kMaxTurns = 400;
// A linear system of so few unknowns is factored, a larger one is first tried with so large a Krylov space.
constexpr Eigen::Index kSmallSystem = 100;
constexpr int kKrylov = 100;
// Of continuation, as a part of the step: a branch that cannot be followed so far ends there for all practical
// purposes.
constexpr double kSmallestStep = 1e-7;

// Sizes of changes of x, the largest over its blocks, each beside that of the block.
class Measure {
 public:
  explicit Measure(Eigen::VectorXd rounding) : rounding_(std::move(rounding)) {}

  /// Beside x.
  double of(const Points& change, const Points& x) const { return ratio(change, x, false); }
  /// Beside x and the terms that are added up in it.
  double of_terms(const Points& change, const Points& x) const { return ratio(change, x, true); }

 private:
  double ratio(const Points& change, const Points& x, bool with_terms) const {
    if (x.size() == 0) return 0;
    const Eigen::Index width = x.cols() / rounding_.size();
    double largest = 0;
    for (Eigen::Index b = 0; b < rounding_.size(); ++b) {
      double scale = x.middleCols(b * width, width).cwiseAbs().maxCoeff();
      if (with_terms) scale = std::max(scale, rounding_[b]);
      const double size = change.middleCols(b * width, width).cwiseAbs().maxCoeff();
      const double part = size / std::max(scale, std::numeric_limits<double>::min());
      if (!(part <= largest)) largest = part;  // a NaN stays
    }
    return largest;
  }

  Eigen::VectorXd rounding_;
};

struct Iterated {
  Points x;
  bool converged = false;
  double contraction = 0;
};

// x ← map(x) from `start` until the correction is round-off: of x itself, or of the terms that the map adds up, where
// ratios of corrections say nothing any more.
template <class Map>
Iterated iterate(const Points& start, const Measure& measure, double contraction, const Map& map) {
  Iterated result{start, false, 0};
  double previous = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    Points next = map(result.x);
    const Points change = next - result.x;
    const double correction = measure.of(change, next);
    const double beside_terms = measure.of_terms(change, next);
    result.x = std::move(next);
    if (!std::isfinite(correction)) return result;
    if (correction <= kEpsilon) {
      result.converged = true;
      return result;
    }
    const bool at_round_off = beside_terms <= 64 * kEpsilon;
    if (at_round_off && correction >= previous) {
      result.converged = true;
      return result;
    }
    if (turn > 0 && !at_round_off) {
      result.contraction = std::max(result.contraction, correction / previous);
      if (result.contraction > contraction) return result;
    }
    previous = correction;
  }
  return result;
}

Points solve(const Eigen::PartialPivLU<Eigen::MatrixXd>& lu, const Points& b) {
  return lu.solve(Eigen::VectorXd(b.reshaped())).reshaped(b.rows(), b.cols());
}

// GMRES for (I − J)x = b (Saad and Schultz 1986), the Krylov space kept orthonormal by Gram and Schmidt, twice. None
// where round-off is not reached.
std::optional<Points> solve_by_gmres(const std::function<Points(const Points&)>& apply, const Points& b) {
  const double size = b.norm();
  if (size == 0) return b;
  Eigen::MatrixXd space(b.size(), kKrylov + 1);
  Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(kKrylov + 1, kKrylov);
  space.col(0) = b.reshaped() / size;
  for (int k = 0; k < kKrylov; ++k) {
    const Points v = space.col(k).reshaped(b.rows(), b.cols());
    Eigen::VectorXd w = (v - apply(v)).reshaped();
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd part = space.leftCols(k + 1).transpose() * w;
      w.noalias() -= space.leftCols(k + 1) * part;
      hessenberg.col(k).head(k + 1) += part;
    }
    hessenberg(k + 1, k) = w.norm();
    const auto h = hessenberg.topLeftCorner(k + 2, k + 1);
    const Eigen::VectorXd y = h.householderQr().solve(size * Eigen::VectorXd::Unit(k + 2, 0));
    if ((size * Eigen::VectorXd::Unit(k + 2, 0) - h * y).norm() <= 8 * kEpsilon * size)
      return Points((space.leftCols(k + 1) * y).reshaped(b.rows(), b.cols()));
    space.col(k + 1) = w / hessenberg(k + 1, k);
  }
  return std::nullopt;
}

// Newton's iteration for x = c + sF(x) with its LU factors, as continuation in s needs them.
class NewtonBranch {
 public:
  NewtonBranch(const ImplicitMap& map, const Points& c, const Measure& measure)
      : map_(map), c_(c), x_(c), measure_(measure) {}

  const Points& x() const { return x_; }

  // Moves the root from s to `s_next`; false, leaving it, if it cannot be followed that far in one step.
  bool advance(double s, double s_next) {
    Eigen::PartialPivLU<Eigen::MatrixXd> lu = factor(x_, s);
    const Points predicted = (s_next - s) * solve(lu, map_.value(x_));
    Points x = x_ + predicted;
    double total = 0;
    double previous = std::numeric_limits<double>::infinity();
    for (int turn = 0; turn < 20; ++turn) {
      lu = factor(x, s_next);
      if (!(lu.determinant() > 0)) return false;
      const Points correction = solve(lu, c_ + s_next * map_.value(x) - x);
      x += correction;
      const double size = measure_.of_terms(correction, x);
      total += size;
      // The corrector must stay close to the predictor, or it may have jumped to another root.
      if (!std::isfinite(size) || total > 0.5 * measure_.of_terms(predicted, x))
        return total <= 4 * kEpsilon && accept(x);
      if (size <= 4 * kEpsilon || (size <= 1e-12 && size >= 0.5 * previous)) return accept(x);
      previous = size;
    }
    return false;
  }

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> factor(const Points& x, double s) const {
    Eigen::MatrixXd matrix = -s * map_.jacobian(x);
    matrix.diagonal().array() += 1;
    return Eigen::PartialPivLU<Eigen::MatrixXd>(matrix);
  }
  bool accept(const Points& x) {
    if (!map_.on_same_branch(x_, x)) return false;
    x_ = x;
    return true;
  }

  const ImplicitMap& map_;
  const Points& c_;
  Points x_;
  const Measure& measure_;
};

}  // namespace

ImplicitRoot solve_implicit(const ImplicitMap& map, const Points& c, RootSearch search) {
  const Measure measure(map.rounding_scale());
  const Iterated fixed =
      iterate(c, measure, map.contraction(), [&](const Points& x) -> Points { return c + map.value(x); });
  if (fixed.converged && map.on_same_branch(c, fixed.x)) return {fixed.x, true, false, fixed.contraction};
  if (search == RootSearch::kContracting) return {fixed.x, false, false, fixed.contraction};

  NewtonBranch branch(map, c, measure);
  double s = 0;
  double step = 0.25;
  while (s < 1 && step >= kSmallestStep) {
    const double next = std::min(1.0, s + step);
    if (branch.advance(s, next)) {
      s = next;
      step *= 2;
    } else {
      step /= 2;
    }
  }
  return {branch.x(), s == 1, true, fixed.contraction};
}

Points solve_linear(const std::function<Points(const Points&)>& apply, const std::function<Eigen::MatrixXd()>& matrix,
                    const Points& b, int blocks) {
  const Iterated fixed = iterate(b, Measure(Eigen::VectorXd::Zero(blocks)), kLinearContraction,
                                 [&](const Points& x) -> Points { return b + apply(x); });
  if (fixed.converged) return fixed.x;
  if (blocks == 1 && b.size() > kSmallSystem)
    if (std::optional<Points> x = solve_by_gmres(apply, b)) return std::move(*x);
  Eigen::MatrixXd whole = -matrix();
  whole.diagonal().array() += 1;
  return solve(Eigen::PartialPivLU<Eigen::MatrixXd>(whole), b);
}

Eigen::MatrixXd matrix_of(const std::function<Points(const Points&)>& apply, Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXd matrix(rows * cols, rows * cols);
  Points unit = Points::Zero(rows, cols);
  for (Eigen::Index i = 0; i < unit.size(); ++i) {
    unit.reshaped()[i] = 1;
    matrix.col(i) = apply(unit).reshaped();
    unit.reshaped()[i] = 0;
  }
  return matrix;
}

namespace {

PhaseState zero(const PhaseState& z) {
  return {Points::Zero(z.q.rows(), z.q.cols()), Points::Zero(z.q.rows(), z.q.cols())};
}

}  // namespace

PhaseState operator+(const PhaseState& a, const PhaseState& b) { return {a.q + b.q, a.p + b.p}; }
PhaseState operator*(double factor, const PhaseState& a) { return {factor * a.q, factor * a.p}; }

PhaseState StepField::value(const PhaseState& z) const {
  PhaseState f = zero(z);
  if (dt_ != 0 && (z.p.array() != 0).any()) {
    const Flow flow = system_.kernel.flow(z.q, z.p);
    f = {dt_ * flow.velocity, -dt_ * flow.force - dt_ * system_.noise->friction() * flow.velocity};
  }
  if (!has_noise()) return f;
  const PhaseState h = system_.noise->gradient(z, w_);
  return {f.q + h.p, f.p - h.q};
}

PhaseState StepField::tangent(const PhaseState& z, const PhaseState& delta) const {
  PhaseState f = zero(z);
  if (dt_ != 0) {
    const Flow change = system_.kernel.flow_tangent(z.q, z.p, delta.q, delta.p);
    f = {dt_ * change.velocity, -dt_ * change.force - dt_ * system_.noise->friction() * change.velocity};
  }
  if (!has_noise()) return f;
  const PhaseState h = system_.noise->hessian(z, w_, delta);
  return {f.q + h.p, f.p - h.q};
}

// The second derivatives of H are symmetric: the tangent along (−μ_p, μ_q), its parts exchanged.
PhaseState StepField::transposed(const PhaseState& z, const PhaseState& mu) const {
  PhaseState f = zero(z);
  if (dt_ != 0) {
    const Flow change = system_.kernel.flow_tangent(z.q, z.p, -mu.p, mu.q - system_.noise->friction() * mu.p);
    f = {dt_ * change.force, dt_ * change.velocity};
  }
  if (!has_noise()) return f;
  return f + system_.noise->hessian(z, w_, {-mu.p, mu.q});
}

PhaseState StepField::forced(const PhaseState& z, const Eigen::VectorXd& w_change,
                             const Eigen::VectorXd& parameters) const {
  const NoiseModel& noise = *system_.noise;
  if (!has_noise()) return zero(z);
  PhaseState h = noise.gradient(z, w_change);
  if (parameters.size() == 0) return {h.p, -h.q};
  h = h + noise.gradient_by_parameters(z, w_, parameters);
  const double friction = dt_ * noise.friction_by_parameters(parameters);
  if (friction != 0) h.q += friction * hamiltonian_p(system_.kernel, z.q, z.p);
  return {h.p, -h.q};
}

void StepField::add_forced_transposed(const PhaseState& z, const PhaseState& mu, Eigen::VectorXd& w_bar,
                                      Eigen::VectorXd& parameters_bar) const {
  if (!has_noise()) return;
  w_bar += system_.noise->contract(z, {-mu.p, mu.q});
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(w_.size());
  for (Eigen::Index i = 0; i < parameters_bar.size(); ++i) {
    const PhaseState f = forced(z, none, Eigen::VectorXd::Unit(parameters_bar.size(), i));
    parameters_bar[i] += inner_product(mu.q, f.q) + inner_product(mu.p, f.p);
  }
}

}  // namespace pulson
