#include "pulson/integrators/integrator.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "core/step_watch.hpp"
#include "core/text.hpp"
#include "integrators/schemes.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

StepError::StepError(int step, const TimeGrid& grid, const std::string& reason)
    : NumericalError(fmt::format("step {} of {} (dt = {:.4g}): {}; use more steps, as in `grid.steps = {}`", step + 1,
                                 grid.steps, grid.dt(), reason, 2 * grid.steps)),
      step_(step) {}

namespace {

void check_state(std::string_view what, const PhaseState& state, const Points& like) {
  require_size(what, state.q, like.rows(), like.cols());
  require_size(what, state.p, like.rows(), like.cols());
}

}  // namespace

double contraction_bound(const KernelOperator& kernel, const Trajectory& path) {
  double largest = 0;
  for (int k = 0; k < path.grid.steps; ++k) {
    StepWatch::before_step();
    largest = std::max(largest, contraction_bound(kernel, path.step_momenta(k), path.grid.dt()));
  }
  return largest;
}

Trajectory Integrator::integrate(const StochasticSystem& system, const PhaseState& initial, const TimeGrid& grid,
                                 const MatrixXd& increments, RootSearch search) const {
  const SerialBlas serial;
  check_state("the state at the start", initial, initial.q);
  const int channels = system.noise->channels(static_cast<int>(initial.q.rows()), static_cast<int>(initial.q.cols()));
  require_size("the increments of the noise", increments, channels, grid.steps);
  if (increments.rows() > 0 && !traits().noise)
    throw InputError(
        fmt::format("integrator '{}' takes no noise, and the noise is '{}'", name(), system.noise->spec()));
  const MatrixXd w = acting(increments);
  Trajectory path;
  path.integrator = name();
  path.grid = grid;
  path.increments = increments;
  path.states.reserve(static_cast<std::size_t>(grid.steps) + 1);
  path.states.push_back(initial);
  for (int k = 0; k < grid.steps; ++k) {
    StepWatch::before_step();
    StepOutcome outcome = do_step(system, path.states.back(), grid.dt(), w.col(k), search);
    if (!outcome.found) throw StepError(k, grid, "its implicit equation has no unique solution");
    if (!outcome.end.p.allFinite() || !outcome.end.q.allFinite())
      throw StepError(k, grid, "the momenta grow beyond all bounds");
    path.contraction_measured = std::max(path.contraction_measured, outcome.contraction);
    path.continuation_steps += outcome.continued ? 1 : 0;
    path.states.push_back(std::move(outcome.end));
    if (outcome.stage_momenta.size() > 0) path.stage_momenta.push_back(std::move(outcome.stage_momenta));
  }
  return path;
}

Integrator::Step Integrator::step_of(const StochasticSystem& system, const Trajectory& path, int k,
                                     const MatrixXd& acting) {
  const auto i = static_cast<std::size_t>(k);
  return {system, path.grid.dt(), acting.col(k), path.states[i], path.states[i + 1], path.step_momenta(k), 0};
}

PhaseState Integrator::tangent(const StochasticSystem& system, const Trajectory& path, const PathChange& change) const {
  const SerialBlas serial;
  check_state("the change of the start", change.initial, path.initial().q);
  require_size("the change of the increments", change.increments, path.increments.rows(), path.increments.cols());
  const MatrixXd w = acting(path.increments);
  const MatrixXd dw = acting(change.increments);
  PhaseState delta = change.initial;
  for (int k = 0; k < path.grid.steps; ++k)
    delta = do_tangent(step_of(system, path, k, w), delta, dw.col(k), change.parameters);
  return delta;
}

std::vector<SpaceStep> Integrator::space_steps(const StochasticSystem& system, const Trajectory& path) const {
  const SerialBlas serial;
  const MatrixXd w = acting(path.increments);
  std::vector<SpaceStep> steps;
  for (int k = 0; k < path.grid.steps; ++k) {
    steps.push_back(do_space(step_of(system, path, k, w)));
    steps.back().w = w.col(k);
  }
  return steps;
}

PathGradient Integrator::adjoint(const StochasticSystem& system, const Trajectory& path, const PhaseState& final_bar,
                                 bool by_parameters) const {
  const SerialBlas serial;
  check_state("the derivative by the end", final_bar, path.final().q);
  const MatrixXd w = acting(path.increments);
  MatrixXd w_bar(w.rows(), w.cols());
  PathGradient gradient;
  gradient.parameters_bar = VectorXd::Zero(by_parameters ? system.noise->parameters().size() : 0);
  PhaseState bar = final_bar;
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    Step step = step_of(system, path, k, w);
    step.parameters = gradient.parameters_bar.size();
    StepBar before = do_adjoint(step, bar);
    bar = std::move(before.start);
    w_bar.col(k) = before.w;
    gradient.parameters_bar += before.parameters;
  }
  gradient.q0_bar = std::move(bar.q);
  gradient.p0_bar = std::move(bar.p);
  gradient.increments_bar = acting_transposed(w_bar);
  return gradient;
}

EndpointJacobian Integrator::endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const {
  const Points& q = path.final().q;
  EndpointJacobian jacobian{MatrixXd(q.size(), q.size()), MatrixXd(q.size(), path.increments.size())};
  parallel_for(static_cast<int>(q.size()), [&](int row) {
    PhaseState unit{Points::Zero(q.rows(), q.cols()), Points::Zero(q.rows(), q.cols())};
    unit.q.reshaped()[row] = 1;
    const PathGradient gradient = adjoint(system, path, unit, false);
    jacobian.momenta.row(row) = gradient.p0_bar.reshaped().transpose();
    jacobian.increments.row(row) = gradient.increments_bar.reshaped().transpose();
  });
  return jacobian;
}

bool is_at_rest(const StochasticSystem& system, const PhaseState& start) {
  return system.noise->traits().linear && (start.p.array() == 0).all();
}

PathRows Integrator::adjoint_rows(const StochasticSystem& system, const Trajectory& path,
                                  const MatrixXd& by_end) const {
  const Points& q = path.final().q;
  const Index size = q.size();
  const bool at_rest = is_at_rest(system, path.initial());
  PathRows rows{MatrixXd(by_end.rows(), by_end.cols()), MatrixXd(by_end.rows(), path.increments.size())};
  parallel_for(static_cast<int>(by_end.rows()), [&](int row) {
    PhaseState bar{by_end.row(row).head(size).reshaped(q.rows(), q.cols()), Points::Zero(q.rows(), q.cols())};
    if (!at_rest) bar.p = by_end.row(row).tail(size).reshaped(q.rows(), q.cols());
    const PathGradient gradient = adjoint(system, path, bar, false);
    rows.start.row(row).head(size) = gradient.q0_bar.reshaped().transpose();
    if (!at_rest) rows.start.row(row).tail(size) = gradient.p0_bar.reshaped().transpose();
    rows.increments.row(row) = gradient.increments_bar.reshaped().transpose();
  });
  return rows;
}

MatrixXd Integrator::endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                      const MatrixXd& momentum_changes) const {
  const Points& q = path.final().q;
  require_size("the changes of the momenta", momentum_changes, q.size(), momentum_changes.cols());
  MatrixXd changes(q.size(), momentum_changes.cols());
  parallel_for(static_cast<int>(momentum_changes.cols()), [&](int column) {
    const PhaseState start{Points::Zero(q.rows(), q.cols()), momentum_changes.col(column).reshaped(q.rows(), q.cols())};
    const PathChange change{start, MatrixXd::Zero(path.increments.rows(), path.increments.cols()), {}};
    changes.col(column) = tangent(system, path, change).q.reshaped();
  });
  return changes;
}

MatrixXd acting_increments(const MatrixXd& increments) {
  MatrixXd w = 0.5 * increments;
  const Index k = increments.cols();
  if (k > 1) w.rightCols(k - 1) += 0.5 * increments.leftCols(k - 1);
  return w;
}

MatrixXd acting_increments_transposed(const MatrixXd& acting_bar) {
  MatrixXd bar = 0.5 * acting_bar;
  const Index k = acting_bar.cols();
  if (k > 1) bar.leftCols(k - 1) += 0.5 * acting_bar.rightCols(k - 1);
  return bar;
}

namespace {

using Made = std::unique_ptr<const Integrator>;

}  // namespace

const NameTable<MakeIntegrator>& integrator_table() {
  static const NameTable<MakeIntegrator> kTable(
      "integrator",
      {{"variational",
        {},
        "the stochastic variational integrator (20), compensated so that it converges to the Stratonovich equation "
        "(11) "
        "for every noise: symplectic, implicit in the positions",
        []() -> Made { return std::make_unique<VariationalIntegrator>(true); }},
       {"variational-paper",
        {},
        "(20) as printed: solves a different equation where noise moves positions and momenta together "
        "(ch-sd-screened, and p-sd except with constant fields), else the same as variational",
        []() -> Made { return std::make_unique<VariationalIntegrator>(false); }},
       {"variational-2",
        {},
        "half a step of the adjoint of (20), the noise, half a step of (20): symplectic, of order 2 without noise, of "
        "weak order 2 for additive noise; converges to (11) for every noise",
        []() -> Made { return std::make_unique<SymmetricVariationalIntegrator>(true); }},
       {"midpoint",
        {},
        "stochastic implicit midpoint: symplectic, of order 2 without noise",
        []() -> Made { return std::make_unique<MidpointIntegrator>(); }},
       {"heun",
        {},
        "Heun-Stratonovich: explicit, not symplectic",
        []() -> Made { return std::make_unique<RungeKuttaIntegrator>(heun_tableau()); }},
       {"rk4",
        {},
        "classical Runge-Kutta of order 4, without noise only: explicit, not symplectic",
        []() -> Made { return std::make_unique<RungeKuttaIntegrator>(rk4_tableau()); }},
       {"stormer-verlet", {}, "Störmer-Verlet, without noise only: symplectic, reversible, of order 2", []() -> Made {
          return std::make_unique<SymmetricVariationalIntegrator>(false);
        }}});
  return kTable;
}

std::unique_ptr<const Integrator> make_integrator(std::string_view name) {
  return integrator_table().find(name).make();
}

}  // namespace pulson
