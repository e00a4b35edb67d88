#include "space_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/factorisations.hpp"

namespace pulson::warp {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kMaxNewton = 50;
constexpr int kMaxTurns = 400;
constexpr double kContraction = 0.95;
constexpr double kRoundOff = 1e-14;  // of the size of the coordinates
// Newton's method squares a correction: after one below this, of the size of the coordinates, comes round-off. The
// gradient is that before the correction, and as near.
constexpr double kLastCorrection = 1e-11;

double round_off(const Points& x) { return kRoundOff * std::max(x.cwiseAbs().maxCoeff(), 1e-300); }

MatrixXd square(const MatrixXd& columns, Index m, Index d) { return columns.col(m).reshaped(d, d); }

// Column by column the product of d×d matrices, in place: millions of points have one each.
MatrixXd products(const MatrixXd& a, const MatrixXd& b, Index d) {
  MatrixXd product(a.rows(), a.cols());
  for (Index m = 0; m < a.cols(); ++m) {
    const Eigen::Map<const MatrixXd> left(a.col(m).data(), d, d), right(b.col(m).data(), d, d);
    Eigen::Map<MatrixXd>(product.col(m).data(), d, d) = left.lazyProduct(right);
  }
  return product;
}

// (I − G)⁻¹ of each column; false where a determinant is not positive: the root has passed its end.
bool solve_columns(const MatrixXd& g, const MatrixXd& right, Index d, MatrixXd& solution) {
  const Index columns = right.rows() / d;
  solution.resize(right.rows(), right.cols());
  for (Index m = 0; m < right.cols(); ++m) {
    const MatrixXd matrix = MatrixXd::Identity(d, d) - square(g, m, d);
    if (!(matrix.determinant() > 0)) return false;
    solution.col(m) = matrix.partialPivLu().solve(right.col(m).reshaped(d, columns)).reshaped();
  }
  return true;
}

// The step back in time, its stages in reverse: the inverse of a method that is symmetric, and near it for others.
SpaceStep reversed(const SpaceStep& step) {
  SpaceStep back = step;
  std::reverse(back.stages.begin(), back.stages.end());
  back.drift = -step.drift;
  back.noise = -step.noise;
  return back;
}

}  // namespace

SpatialStep::Field SpatialStep::field(Index stage, double drift, double noise, const Points& x,
                                      bool with_gradients) const {
  const PhaseState& at = step_.stages[static_cast<std::size_t>(stage)];
  const Index d = x.rows();
  Field field{Points::Zero(d, x.cols()), MatrixXd::Zero(with_gradients ? d * d : 0, with_gradients ? x.cols() : 0)};
  const bool fields_of_noise = noise != 0 && has_fields_;
  const bool fields_of_compensation = drift != 0 && step_.compensated && has_fields_;
  if (drift != 0) {
    MatrixXd slopes;
    field.value = drift * (with_gradients ? system_.kernel.apply_with_jacobian(x, at.q, at.p, slopes)
                                          : system_.kernel.apply(x, at.q, at.p));
    if (with_gradients) field.gradients = drift * slopes;
  }
  if (fields_of_compensation) field.value += drift * system_.noise->spatial_compensation(x, at);
  if (fields_of_noise) field.value += noise * system_.noise->spatial_noise(x, at, step_.w);
  for (Index axis = 0; with_gradients && axis < d; ++axis) {
    const Points unit = Eigen::VectorXd::Unit(d, axis).replicate(1, x.cols());
    if (fields_of_compensation)
      field.gradients.middleRows(axis * d, d) += drift * system_.noise->spatial_compensation_change(x, at, unit);
    if (fields_of_noise)
      field.gradients.middleRows(axis * d, d) += noise * system_.noise->spatial_noise_change(x, at, step_.w, unit);
  }
  return field;
}

// Y = c + drift u(Y) + noise η(Y): all points at once by the fixed-point iteration, which contracts wherever the map is
// certain to exist, then by Newton's method.
bool SpatialStep::solve(Index stage, const Points& c, Points& y) const {
  const double drift = step_.drift(stage, stage);
  const double noise = step_.noise(stage, stage);
  const double enough = round_off(c);
  y = c;
  double previous = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    const Points next = c + field(stage, drift, noise, y, false).value;
    const double correction = (next - y).cwiseAbs().maxCoeff();
    y = next;
    if (!std::isfinite(correction)) return false;
    if (correction <= enough) return true;
    if (correction > kContraction * previous) break;
    previous = correction;
  }
  for (int turn = 0; turn < kMaxNewton; ++turn) {
    const Field at = field(stage, drift, noise, y, true);
    MatrixXd correction;
    if (!solve_columns(at.gradients, c + at.value - y, c.rows(), correction)) return false;
    y += correction;
    if (correction.cwiseAbs().maxCoeff() <= enough) return true;
  }
  return false;
}

bool SpatialStep::forward(Tracers& points, const LabelDisplacements& own) const {
  const Index d = points.x.rows();
  const Index stages = step_.drift.cols();
  const bool with_gradients = points.with_gradients();
  std::vector<Points> at;           // Y_j
  std::vector<MatrixXd> gradients;  // ∂Y_j/∂x
  for (Index i = 0; i <= stages; ++i) {
    const auto row = static_cast<std::size_t>(i);
    Points c = points.x;
    MatrixXd g = points.gradients;
    for (Index j = 0; j < std::min(i, stages); ++j) {
      const double drift = step_.drift(i, j);
      const double noise = step_.noise(i, j);
      if (drift == 0 && noise == 0) continue;
      const auto stage = static_cast<std::size_t>(j);
      const Field moved = field(j, drift, noise, at[stage], with_gradients);
      c += moved.value;
      if (with_gradients) g += products(moved.gradients, gradients[stage], d);
    }
    if (row < own.places.size() && own.places[row].size() > 0) {
      c += own.places[row];
      if (with_gradients) g += own.gradients[row];
    }
    if (i < stages && (step_.drift(i, i) != 0 || step_.noise(i, i) != 0)) {
      Points y;
      if (!solve(i, c, y)) return false;
      if (with_gradients) {
        const MatrixXd slopes = field(i, step_.drift(i, i), step_.noise(i, i), y, true).gradients;
        MatrixXd solved;
        if (!solve_columns(slopes, g, d, solved)) return false;
        g = std::move(solved);
      }
      c = std::move(y);
    }
    at.push_back(std::move(c));
    gradients.push_back(std::move(g));
  }
  points = {std::move(at.back()), std::move(gradients.back())};
  return points.x.allFinite();
}

// Whether X⁺ = X + noise·η_1(X) + drift·u_2(X⁺), as of the variational integrators.
bool SpatialStep::ends_in_last_stage() const {
  return step_.drift.cols() == 2 && step_.drift.row(2) == step_.drift.row(1) &&
         step_.noise.row(2) == step_.noise.row(1) && step_.drift.row(0).isZero(0) && step_.noise.row(0).isZero(0) &&
         step_.drift(1, 0) == 0 && step_.noise(1, 1) == 0;
}

bool SpatialStep::backward(Tracers& points) const {
  return ends_in_last_stage() ? backward_from_last_stage(points) : backward_by_newton(points);
}

// The flow is explicit; the noise is solved for where it is a field over space.
bool SpatialStep::backward_from_last_stage(Tracers& points) const {
  const Index d = points.x.rows();
  const MatrixXd identity = MatrixXd::Identity(d, d).reshaped().replicate(1, points.x.cols());
  const Field flow = field(1, step_.drift(1, 1), 0, points.x, points.with_gradients());
  const Points c = points.x - flow.value;
  if (points.with_gradients()) points.gradients = products(identity - flow.gradients, points.gradients, d);
  points.x = c;
  if (field(0, 0, step_.noise(1, 0), c, false).value.isZero(0)) return c.allFinite();
  const double enough = round_off(c);
  for (int turn = 0; turn < kMaxNewton; ++turn) {
    const Field noise = field(0, 0, step_.noise(1, 0), points.x, true);
    MatrixXd correction;
    if (!solve_columns(-noise.gradients, c - noise.value - points.x, d, correction)) return false;
    points.x += correction;
    if (correction.cwiseAbs().maxCoeff() > enough) continue;
    if (points.with_gradients()) {
      MatrixXd before;
      if (!solve_columns(-noise.gradients, points.gradients, d, before)) return false;
      points.gradients = std::move(before);
    }
    return points.x.allFinite();
  }
  return false;
}

bool SpatialStep::backward_by_newton(Tracers& points) const {
  const Index d = points.x.rows();
  const Points goal = points.x;
  const double enough = kLastCorrection * std::max(goal.cwiseAbs().maxCoeff(), 1e-300);
  const MatrixXd identity = MatrixXd::Identity(d, d).reshaped().replicate(1, goal.cols());
  const SpaceStep back = reversed(step_);
  Tracers near{goal, {}};
  Points x = goal;
  if (SpatialStep(system_, back).forward(near, {})) x = std::move(near.x);
  for (int turn = 0; turn < kMaxNewton; ++turn) {
    Tracers moved{x, identity};
    if (!forward(moved, {})) return false;
    // (I − (I − G))⁻¹
    MatrixXd correction;
    if (!solve_columns(identity - moved.gradients, goal - moved.x, d, correction)) return false;
    x += correction;
    if (!(correction.cwiseAbs().maxCoeff() > enough)) {
      if (points.with_gradients()) {
        MatrixXd inverse;
        if (!solve_columns(identity - moved.gradients, points.gradients, d, inverse)) return false;
        points.gradients = std::move(inverse);
      }
      points.x = std::move(x);
      return points.x.allFinite();
    }
  }
  return false;
}

}  // namespace pulson::warp
