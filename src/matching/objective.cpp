#include "pulson/matching/objective.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "cometric.hpp"
#include "core/text.hpp"
#include "dynamics/effective_hamiltonian.hpp"
#include "matching/momentum_basis.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// See MatchingObjective; but nothing above the second, in parts of the trace of K, is left out.
constexpr double kUsefulPart = 1e-3;
constexpr double kMostLeftOut = 1e-6;
// So few landmarks all have momenta.
constexpr Index kAllLandmarks = 250;
// See MatchingObjective::active_unknowns().
constexpr double kSeen = 1e-3;
constexpr double kShareOfMomentum = 0.1;
constexpr double kHighFrequencyPart = 1e-2;

}  // namespace

void check(const MatchingProblem& problem) {
  require_positive("sigma", problem.sigma);
  require_positive("lambda", problem.lambda);
  require_positive("time", problem.grid.time);
  if (problem.grid.steps < 1) throw InputError(fmt::format("steps is {}; at least 1 is needed", problem.grid.steps));
  if (!problem.source.allFinite()) throw InputError("a source coordinate is not a finite number");
  if (const LandmarkTerm* data = problem.data->landmarks())
    if (const Points target = data->target();
        problem.source.rows() != target.rows() || problem.source.cols() != target.cols())
      throw InputError(fmt::format("the source has {} landmarks in {}D, the target {} in {}D", problem.source.cols(),
                                   problem.source.rows(), target.cols(), target.rows()));
  const auto d = static_cast<int>(problem.source.rows()), n = static_cast<int>(problem.source.cols());
  problem.system.noise->check(d, n);
  for (const MatrixXd& realisation : problem.realisations)
    require_size("a realisation of the noise", realisation, problem.system.noise->channels(d, n), problem.grid.steps);
}

void require_distinct(const Points& source) {
  if (const auto pair = find_coincident(source))
    throw InputError(
        fmt::format("source landmarks {} and {} are at the same position", pair->first + 1, pair->second + 1));
}

bool pays_for_controls(const MatchingProblem& problem) {
  return problem.along_path && problem.system.noise->traits().moves_positions();
}

namespace {

MatchingProblem checked(MatchingProblem problem) {
  check(problem);
  require_distinct(problem.source);
  return problem;
}

// λ Σ_i h_i,p h_i,pᵀ, N×N; none where nothing is paid for controls along the path.
MatrixXd metric_of_controls(const MatchingProblem& problem) {
  if (!pays_for_controls(problem)) return {};
  const NoiseCometric noise = noise_cometric(*problem.system.noise, problem.source);
  if (!noise.isotropic)
    throw InputError(
        fmt::format("shooting in mode metamorphosis needs noise that moves landmarks alike along each "
                    "axis; for '{}' there are solver paths and mode map",
                    problem.system.noise->spec()));
  return problem.lambda * MatrixXd(noise.matrix);
}

MomentumBasis make_basis(const MatchingProblem& problem) {
  const KernelOperator& kernel = problem.system.kernel;
  const double observable = kUsefulPart * problem.lambda * std::pow(problem.sigma / problem.grid.time, 2);
  const double trace = kernel.at_zero() * static_cast<double>(problem.source.cols());
  const double tolerance = problem.source.cols() <= kAllLandmarks ? 0 : std::min(observable, kMostLeftOut * trace);
  const double faint = problem.faint * std::pow(problem.lambda * problem.sigma / problem.grid.time, 2);
  const double weight = problem.lambda * (problem.along_path ? problem.grid.time : 1);
  return {kernel, problem.source, weight, tolerance, faint, metric_of_controls(problem)};
}

StochasticSystem flow_of(const MatchingProblem& problem) {
  if (!pays_for_controls(problem)) return problem.system;
  return {problem.system.kernel, control_energy(problem.system.noise, problem.lambda)};
}

}  // namespace

MatchingProblem subsampled(const MatchingProblem& problem, const std::vector<Index>& landmarks) {
  const double weight = static_cast<double>(problem.source.cols()) / static_cast<double>(landmarks.size());
  MatchingProblem few = problem;
  few.source = problem.source(Eigen::all, landmarks);
  few.data = std::make_shared<LandmarkTerm>(problem.data->landmarks()->part(landmarks, weight));
  few.sigma = problem.sigma / std::sqrt(weight);
  return few;
}

MatchingObjective::MatchingObjective(MatchingProblem problem)
    : problem_(checked(std::move(problem))),
      flow_(flow_of(problem_)),
      channels_(
          flow_.noise->channels(static_cast<int>(problem_.source.rows()), static_cast<int>(problem_.source.cols()))),
      basis_(std::make_shared<const MomentumBasis>(make_basis(problem_))) {}

Index MatchingObjective::unknowns() const { return basis_->unknowns() + controls(); }

Index MatchingObjective::controls() const {
  return problem_.realisations.empty() ? static_cast<Index>(channels_) * problem_.grid.steps : 0;
}

VectorXd MatchingObjective::frequency() const {
  VectorXd frequency(unknowns());
  frequency << basis_->frequency(), VectorXd::Ones(controls());
  return frequency;
}

VectorXd MatchingObjective::white(const Points& p, const MatrixXd& dw) const {
  if (controls() > 0) require_size("the increments of the noise", dw, channels_, problem_.grid.steps);
  VectorXd z(unknowns());
  z.head(basis_->unknowns()) = basis_->white(p);
  if (controls() > 0) z.tail(controls()) = dw.reshaped() / std::sqrt(problem_.grid.dt());
  return z;
}

Points MatchingObjective::momenta(const VectorXd& z) const {
  require_size("the unknowns", z, unknowns(), 1);
  return basis_->momenta(z.head(basis_->unknowns()));
}

MatrixXd MatchingObjective::increments(const VectorXd& z) const {
  require_size("the unknowns", z, unknowns(), 1);
  const Index channels = controls() > 0 ? channels_ : 0;
  return std::sqrt(problem_.grid.dt()) * z.tail(controls()).reshaped(channels, problem_.grid.steps);
}

std::optional<MatchingObjective::Evaluation> MatchingObjective::evaluate(const VectorXd& z) const {
  const SerialBlas serial;
  const PhaseState start{problem_.source, momenta(z)};
  const std::vector<MatrixXd> fitted =
      problem_.realisations.empty() ? std::vector<MatrixXd>{increments(z)} : std::vector<MatrixXd>{};
  const std::vector<MatrixXd>& noises = fitted.empty() ? problem_.realisations : fitted;
  // Of several realisations some step of some path hardly ever contracts.
  const RootSearch search = noises.size() > 1 ? RootSearch::kThorough : RootSearch::kContracting;
  Evaluation at{z, std::vector<Trajectory>(noises.size()), {}};
  try {
    parallel_for(static_cast<int>(noises.size()), [&](int i) {
      const auto s = static_cast<std::size_t>(i);
      at.paths[s] = problem_.integrator->integrate(flow_, start, problem_.grid, noises[s], search);
    });
  } catch (const StepError&) {
    return std::nullopt;
  }
  at.cost.energy = 0.5 * z.head(basis_->unknowns()).squaredNorm();
  at.cost.action = 0.5 * z.tail(controls()).squaredNorm();
  for (const Trajectory& path : at.paths) at.cost.data += problem_.data->value(path.final().q);
  at.cost.data /= static_cast<double>(at.paths.size());
  if (!std::isfinite(at.cost.total())) return std::nullopt;
  return at;
}

VectorXd MatchingObjective::data_gradient(const Evaluation& at) const {
  const SerialBlas serial;
  std::vector<PathGradient> bars(at.paths.size());
  const Points zero = Points::Zero(problem_.source.rows(), problem_.source.cols());
  parallel_for(static_cast<int>(bars.size()), [&](int i) {
    const Trajectory& path = at.paths[static_cast<std::size_t>(i)];
    bars[static_cast<std::size_t>(i)] =
        problem_.integrator->adjoint(flow_, path, {problem_.data->gradient(path.final().q), zero}, false);
  });
  Points p_bar = zero;
  for (const PathGradient& bar : bars) p_bar += bar.p0_bar;
  VectorXd gradient(unknowns());
  gradient.head(basis_->unknowns()) = basis_->pull_back(p_bar) / static_cast<double>(bars.size());
  if (controls() > 0)
    gradient.tail(controls()) = std::sqrt(problem_.grid.dt()) * bars.front().increments_bar.reshaped();
  return gradient;
}

VectorXd MatchingObjective::active_unknowns() const {
  VectorXd active_unknowns = VectorXd::Ones(unknowns());
  const auto pivots = static_cast<double>(basis_->rank());
  const double least = kSeen * std::pow(problem_.lambda * problem_.sigma / problem_.grid.time, 2) * pivots /
                       static_cast<double>(problem_.source.cols());
  const VectorXd eigenvalues = basis_->eigenvalues();
  const VectorXd frequency = basis_->frequency();
  const NoiseModel& noise = *flow_.noise;
  const bool controlled = controls() > 0 && noise.traits().moves_positions();
  const Points rest = Points::Zero(problem_.source.rows(), problem_.source.cols());
  for (Index i = 0; i < basis_->unknowns(); ++i) {
    if (eigenvalues[i] < least) active_unknowns[i] = 0;
    if (!controlled || active_unknowns[i] == 0 || frequency[i] * kHighFrequencyPart < 1) continue;
    const Points momenta = basis_->momenta(VectorXd::Unit(basis_->unknowns(), i));
    const Points velocity = problem_.system.kernel.apply(problem_.source, problem_.source, momenta);
    const double variance =
        noise.contract({problem_.source, rest}, {rest, velocity}).squaredNorm() / velocity.squaredNorm();
    if (problem_.grid.time * velocity.squaredNorm() < kShareOfMomentum * variance) active_unknowns[i] = 0;
  }
  return active_unknowns;
}

MatrixXd MatchingObjective::endpoint_changes(const Trajectory& path) const {
  const MatrixXd basis = basis_->changes();
  if (controls() == 0) return problem_.integrator->endpoint_changes(flow_, path, basis);
  const EndpointJacobian end = problem_.integrator->endpoint_jacobian(flow_, path);
  MatrixXd changes(end.momenta.rows(), unknowns());
  changes.leftCols(basis.cols()).noalias() = end.momenta * basis;
  changes.rightCols(controls()) = std::sqrt(problem_.grid.dt()) * end.increments;
  return changes;
}

MatchingObjective::Linearisation MatchingObjective::linearise(const Evaluation& at) const {
  const SerialBlas serial;
  const double part = 1 / std::sqrt(static_cast<double>(at.paths.size()));
  std::vector<DataTerm::Linearisation> ends;
  Index rows = 0;
  for (const Trajectory& path : at.paths) {
    ends.push_back(problem_.data->linearise(path.final().q, endpoint_changes(path)));
    rows += ends.back().residual.size();
  }
  if (ends.size() == 1) return {std::move(ends.front().residual), std::move(ends.front().changes)};
  Linearisation all{VectorXd(rows), MatrixXd(rows, unknowns())};
  rows = 0;
  for (const DataTerm::Linearisation& end : ends) {
    all.residual.segment(rows, end.residual.size()) = part * end.residual;
    all.jacobian.middleRows(rows, end.residual.size()) = part * end.changes;
    rows += end.residual.size();
  }
  return all;
}

VectorXd MatchingObjective::residual(const Evaluation& at) const {
  std::vector<VectorXd> ends;
  Index rows = 0;
  for (const Trajectory& path : at.paths) {
    ends.push_back(problem_.data->residual(path.final().q));
    rows += ends.back().size();
  }
  VectorXd all(rows);
  rows = 0;
  for (const VectorXd& end : ends) {
    all.segment(rows, end.size()) = end / std::sqrt(static_cast<double>(ends.size()));
    rows += end.size();
  }
  return all;
}

}  // namespace pulson::matching
