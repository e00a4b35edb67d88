#include "geodesics.hpp"

#include <utility>

#include <fmt/format.h>

#include "anderson.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::cohort {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostShots = 100;
constexpr int kShotWindow = 12;
constexpr int kStalled = 12;           // shots without progress: round-off, or no match
constexpr double kLeastRidge = 1e-13;  // of the largest element, where Cholesky's factors need one
constexpr double kMoreRidge = 100;

// Factors of A + τ, with a ridge where it is singular in working precision: they only guide the search.
Eigen::LLT<MatrixXd> factorised(MatrixXd matrix) {
  Eigen::LLT<MatrixXd> factors(matrix);
  const double largest = matrix.size() > 0 ? matrix.cwiseAbs().maxCoeff() : 1;
  for (double ridge = kLeastRidge * largest; factors.info() != Eigen::Success && ridge < largest; ridge *= kMoreRidge) {
    matrix.diagonal().array() += ridge;
    factors.compute(matrix);
  }
  return factors;
}

std::vector<Index> others(Index count, const std::vector<Index>& chosen) {
  std::vector<Index> rest;
  auto next = chosen.begin();
  for (Index a = 0; a < count; ++a)
    if (next != chosen.end() && *next == a)
      ++next;
    else
      rest.push_back(a);
  return rest;
}

}  // namespace

TemplateMetric::TemplateMetric(const KernelOperator& kernel, double nugget, double tau, Points q0)
    : q0_(std::move(q0)), gram_(kernel.gram(q0_, q0_)), tau_(tau) {
  gram_.diagonal().array() += nugget;
}

MatchModel::MatchModel(const TemplateMetric& metric, std::vector<Index> observed, const VectorXd& precisions)
    : metric_(&metric),
      observed_(std::move(observed)),
      missing_(others(metric.gram().cols(), observed_)),
      scale_(metric.gram().cwiseAbs().maxCoeff()),
      taus_(VectorXd::Constant(metric.gram().cols(), metric.tau())) {
  if (precisions.size() > 0) taus_ = metric.tau() * precisions.cwiseInverse();
  MatrixXd matrix = metric.gram()(observed_, observed_);
  matrix.diagonal() += taus_(observed_);
  factors_ = factorised(std::move(matrix));
}

Points MatchModel::unknowns(const Points& p) const {
  Points x = metric_->velocity(p) + p * taus_.asDiagonal();
  x(Eigen::all, missing_) = scale_ * p(Eigen::all, missing_);
  return x;
}

Points MatchModel::momenta(const Points& x) const {
  Points p(x.rows(), x.cols());
  p(Eigen::all, missing_) = x(Eigen::all, missing_) / scale_;
  const Points rest = x(Eigen::all, observed_) - p(Eigen::all, missing_) * metric_->gram()(missing_, observed_);
  p(Eigen::all, observed_) = factors_.solve(rest.transpose()).transpose();
  return p;
}

Points MatchModel::defect(const PhaseState& end, const Points& target) const {
  Points f = end.q + end.p * taus_.asDiagonal() - target;
  f(Eigen::all, missing_) = scale_ * end.p(Eigen::all, missing_);
  return f;
}

Geodesics::Geodesics(const KernelOperator& kernel, int steps, double lambda, double beta)
    : hamiltonian_({kernel, make_noise(beta > 0 ? fmt::format("ch-sd:beta={}", beta) : std::string("none"))}, lambda),
      grid_{1, steps} {}

PhaseState Geodesics::step(const PhaseState& state, int k) const {
  const double dt = grid_.dt();
  const auto rates = [&](const PhaseState& at) {
    const Flow flow = hamiltonian_.flow(at);
    return PhaseState{flow.velocity, -flow.force};
  };
  const auto moved = [&](const PhaseState& rate, double time) {
    return PhaseState{state.q + time * rate.q, state.p + time * rate.p};
  };
  const PhaseState first = rates(state), second = rates(moved(first, dt / 2)), third = rates(moved(second, dt / 2)),
                   last = rates(moved(third, dt));
  PhaseState end{state.q + dt / 6 * (first.q + 2 * (second.q + third.q) + last.q),
                 state.p + dt / 6 * (first.p + 2 * (second.p + third.p) + last.p)};
  if (!end.q.allFinite() || !end.p.allFinite()) throw StepError(k, grid_, "the numbers leave their range");
  return end;
}

Trajectory Geodesics::path(const Points& q0, const Points& p0) const {
  Trajectory path;
  path.integrator = "rk4";
  path.grid = grid_;
  path.increments.resize(0, grid_.steps);
  path.states.push_back({q0, p0});
  for (int k = 0; k < grid_.steps; ++k) path.states.push_back(step(path.states.back(), k));
  return path;
}

PhaseState Geodesics::shoot(const Points& q0, const Points& p0) const {
  PhaseState state{q0, p0};
  for (int k = 0; k < grid_.steps; ++k) state = step(state, k);
  return state;
}

GeodesicMatch Geodesics::match(const TemplateMetric& metric, const MatchModel& model, const Points& target,
                               const Points& start, double tolerance) const {
  Anderson search(kShotWindow);
  GeodesicMatch best{start, {}, 0};
  VectorXd x = model.unknowns(start).reshaped();
  const Index d = start.rows(), n = start.cols();
  for (int shot = 0; shot < kMostShots && !search.is_lost() && search.since_best() < kStalled; ++shot) {
    const Points p = model.momenta(x.reshaped(d, n));
    VectorXd f = VectorXd::Constant(x.size(), std::nan(""));
    PhaseState end;
    try {
      end = shoot(metric.shape(), p);
      f = model.defect(end, target).reshaped();
    } catch (const StepError&) {  // f is not finite
      if (shot == 0) throw;
    }
    best.shots = shot + 1;
    x = search.next(x, f);
    if (search.since_best() > 0) continue;
    best.momenta = p;
    best.end = std::move(end);
    best.defect = search.best_size();
    if (best.defect <= tolerance) break;
  }
  best.converged = best.defect <= tolerance;
  return best;
}

}  // namespace pulson::cohort
