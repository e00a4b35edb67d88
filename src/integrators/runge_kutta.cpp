#include "implicit_step.hpp"
#include "integrators/schemes.hpp"
#include "pulson/core/parallel.hpp"
#include "variational_parts.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The points z + Σ_{j<i} a_ij k_j at which the stages are evaluated, and the k_i; of (q, p), or of q alone at rest.
template <class State>
struct Stages {
  std::vector<State> at;
  std::vector<State> slope;
};

// z + Σ_{j<i} a_ij k_j for the stages known so far.
template <class State>
State stage_point(const ExplicitTableau& tableau, const State& z, const std::vector<State>& slope) {
  State at = z;
  const auto i = static_cast<Eigen::Index>(slope.size());
  for (Eigen::Index j = 0; j < i; ++j)
    if (tableau.a(i, j) != 0) at = at + tableau.a(i, j) * slope[static_cast<std::size_t>(j)];
  return at;
}

template <class State>
State combined(const ExplicitTableau& tableau, State z, const std::vector<State>& slope) {
  for (std::size_t i = 0; i < slope.size(); ++i) z = z + tableau.b[static_cast<Eigen::Index>(i)] * slope[i];
  return z;
}

template <class State, class Field>
Stages<State> run_stages(const ExplicitTableau& tableau, const State& start, const Field& field) {
  Stages<State> stages;
  for (Eigen::Index i = 0; i < tableau.b.size(); ++i) {
    stages.at.push_back(stage_point(tableau, start, stages.slope));
    stages.slope.push_back(field(stages.at.back()));
  }
  return stages;
}

Stages<PhaseState> run_stages(const ExplicitTableau& tableau, const StepField& field, const PhaseState& start) {
  return run_stages(tableau, start, [&](const PhaseState& at) { return field.value(at); });
}

// Without momenta.
Stages<Points> run_rest_stages(const ExplicitTableau& tableau, const NoiseModel& noise, const VectorXd& w,
                               const Points& start) {
  return run_stages(tableau, start, [&](const Points& at) { return noise.rest_velocity(at, w); });
}

}  // namespace

ExplicitTableau heun_tableau() {
  return {"heun", (Eigen::Matrix2d() << 0, 0, 1, 0).finished(), Eigen::Vector2d(0.5, 0.5), 2, true};
}

ExplicitTableau rk4_tableau() {
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
  a(1, 0) = a(2, 1) = 0.5;
  a(3, 2) = 1;
  return {"rk4", a, Eigen::Vector4d(1, 2, 2, 1) / 6, 4, false};
}

namespace {

// Without noise landmarks cannot pass each other, so a step in which two turn about each other by more than a right
// angle, or part to more than three times their distance, is longer than the flow's gradient allows: an implicit step
// would not contract. Of 10 shapes whose landmarks on a line had changed places, geodesics by such steps had the same
// order.
bool keeps_landmarks_apart(const Points& before, const Points& after) {
  constexpr double kMostGrowth = 9;  // of squares; e² = 7.4 where Δt times the gradient is 1
  for (Eigen::Index b = 1; b < before.cols(); ++b) {
    const Points from = before.leftCols(b).colwise() - before.col(b), to = after.leftCols(b).colwise() - after.col(b);
    const auto turned = (from.array() * to.array()).colwise().sum() < 0;
    const auto parted = to.array().square().colwise().sum() > kMostGrowth * from.array().square().colwise().sum();
    if (turned.any() || parted.any()) return false;
  }
  return true;
}

}  // namespace

Integrator::StepOutcome RungeKuttaIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                      double dt, const VectorXd& w, RootSearch search) const {
  if (is_at_rest(system, start))
    return {.end = {combined(tableau_, start.q, run_rest_stages(tableau_, *system.noise, w, start.q).slope), start.p},
            .stage_momenta = {}};
  PhaseState end = combined(tableau_, start, run_stages(tableau_, StepField(system, dt, w), start).slope);
  const bool is_short =
      search == RootSearch::kThorough || !tableau_.noise || w.size() > 0 || keeps_landmarks_apart(start.q, end.q);
  return {.end = std::move(end), .stage_momenta = {}, .found = is_short};
}

PhaseState RungeKuttaIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                            const VectorXd& parameters_change) const {
  const StepField field(step.system, step.dt, step.w);
  const Stages<PhaseState> stages = run_stages(tableau_, field, step.start);
  std::vector<PhaseState> slope_change;
  for (const PhaseState& at : stages.at)
    slope_change.push_back(field.tangent(at, stage_point(tableau_, start_change, slope_change)) +
                           field.forced(at, w_change, parameters_change));
  return combined(tableau_, start_change, slope_change);
}

Integrator::StepBar RungeKuttaIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const StepField field(step.system, step.dt, step.w);
  const Stages<PhaseState> stages = run_stages(tableau_, field, step.start);
  StepBar bar{end_bar, VectorXd::Zero(step.w.size()), VectorXd::Zero(step.parameters)};
  std::vector<PhaseState> at_bar(stages.at.size());
  for (std::size_t i = stages.at.size(); i-- > 0;) {
    PhaseState slope_bar = tableau_.b[static_cast<Eigen::Index>(i)] * end_bar;
    for (std::size_t later = i + 1; later < stages.at.size(); ++later) {
      const double a = tableau_.a(static_cast<Eigen::Index>(later), static_cast<Eigen::Index>(i));
      if (a != 0) slope_bar = slope_bar + a * at_bar[later];
    }
    field.add_forced_transposed(stages.at[i], slope_bar, bar.w, bar.parameters);
    at_bar[i] = field.transposed(stages.at[i], slope_bar);
    bar.start = bar.start + at_bar[i];
  }
  return bar;
}

EndpointJacobian RungeKuttaIntegrator::endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const {
  const Points& q0 = path.initial().q;
  const Eigen::Index channels = path.increments.rows();
  EndpointJacobian jacobian{{}, MatrixXd(q0.size(), path.increments.size())};
  RowSweep sweep(system, path.grid.dt(), false, q0.rows(), q0.cols());
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const VectorXd w = path.increments.col(k);
    const StepField field(system, path.grid.dt(), w);
    sweep.through_stages(tableau_, run_stages(tableau_, field, path.states[static_cast<std::size_t>(k)]).at, w,
                         jacobian.increments.middleCols(k * channels, channels));
  }
  jacobian.momenta = sweep.p_bar().transpose();
  return jacobian;
}

// As do_adjoint(), for all rows at once.
PathRows RungeKuttaIntegrator::adjoint_rows(const StochasticSystem& system, const Trajectory& path,
                                            const MatrixXd& by_end) const {
  if (!is_at_rest(system, path.initial())) return Integrator::adjoint_rows(system, path, by_end);
  const SerialBlas serial;
  const Eigen::Index channels = path.increments.rows(), count = tableau_.b.size();
  PathRows rows{by_end, MatrixXd(by_end.rows(), path.increments.size())};
  std::vector<RestFields> fields(static_cast<std::size_t>(count));
  std::vector<MatrixXd> at_bar(static_cast<std::size_t>(count));
  MatrixXd slope_bar;
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const VectorXd w = path.increments.col(k);
    std::vector<Points> slope;
    for (RestFields& stage : fields) {
      const Points at = stage_point(tableau_, path.states[static_cast<std::size_t>(k)].q, slope);
      system.noise->rest_fields(at, w, stage);
      slope.push_back(stage.velocity(at.rows(), w));
    }
    auto by_w = rows.increments.middleCols(k * channels, channels);
    by_w.setZero();
    for (Eigen::Index i = count; i-- > 0;) {
      const auto stage = static_cast<std::size_t>(i);
      slope_bar = tableau_.b[i] * rows.start;
      for (Eigen::Index later = i + 1; later < count; ++later)
        if (const double a = tableau_.a(later, i); a != 0) slope_bar += a * at_bar[static_cast<std::size_t>(later)];
      fields[stage].add_rows(slope_bar, by_w);
      at_bar[stage].noalias() = slope_bar * fields[stage].slope;
    }
    for (const MatrixXd& bar : at_bar) rows.start += bar;
  }
  return rows;
}

SpaceStep RungeKuttaIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = run_stages(tableau_, StepField(step.system, step.dt, step.w), step.start).at;
  space.noise.resize(tableau_.a.rows() + 1, tableau_.a.cols());
  space.noise << tableau_.a, tableau_.b.transpose();
  space.drift = step.dt * space.noise;
  return space;
}

}  // namespace pulson
