#include "implicit_step.hpp"
#include "integrators/schemes.hpp"

namespace pulson {
namespace {

using Eigen::VectorXd;

// The points z + Σ_{j<i} a_ij k_j at which the stages are evaluated, and the k_i.
struct Stages {
  std::vector<PhaseState> at;
  std::vector<PhaseState> slope;
};

// z + Σ_{j<i} a_ij k_j for the stages known so far.
PhaseState stage_point(const ExplicitTableau& tableau, const PhaseState& z, const std::vector<PhaseState>& slope) {
  PhaseState at = z;
  const auto i = static_cast<Eigen::Index>(slope.size());
  for (Eigen::Index j = 0; j < i; ++j)
    if (tableau.a(i, j) != 0) at = at + tableau.a(i, j) * slope[static_cast<std::size_t>(j)];
  return at;
}

PhaseState combined(const ExplicitTableau& tableau, PhaseState z, const std::vector<PhaseState>& slope) {
  for (std::size_t i = 0; i < slope.size(); ++i) z = z + tableau.b[static_cast<Eigen::Index>(i)] * slope[i];
  return z;
}

Stages run_stages(const ExplicitTableau& tableau, const StepField& field, const PhaseState& start) {
  Stages stages;
  for (Eigen::Index i = 0; i < tableau.b.size(); ++i) {
    stages.at.push_back(stage_point(tableau, start, stages.slope));
    stages.slope.push_back(field.value(stages.at.back()));
  }
  return stages;
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

Integrator::StepOutcome RungeKuttaIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                      double dt, const VectorXd& w, RootSearch /*search*/) const {
  return {.end = combined(tableau_, start, run_stages(tableau_, StepField(system, dt, w), start).slope),
          .stage_momenta = {}};
}

PhaseState RungeKuttaIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                            const VectorXd& parameters_change) const {
  const StepField field(step.system, step.dt, step.w);
  const Stages stages = run_stages(tableau_, field, step.start);
  std::vector<PhaseState> slope_change;
  for (const PhaseState& at : stages.at)
    slope_change.push_back(field.tangent(at, stage_point(tableau_, start_change, slope_change)) +
                           field.forced(at, w_change, parameters_change));
  return combined(tableau_, start_change, slope_change);
}

Integrator::StepBar RungeKuttaIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const StepField field(step.system, step.dt, step.w);
  const Stages stages = run_stages(tableau_, field, step.start);
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

SpaceStep RungeKuttaIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = run_stages(tableau_, StepField(step.system, step.dt, step.w), step.start).at;
  space.noise.resize(tableau_.a.rows() + 1, tableau_.a.cols());
  space.noise << tableau_.a, tableau_.b.transpose();
  space.drift = step.dt * space.noise;
  return space;
}

}  // namespace pulson
