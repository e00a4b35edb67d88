#include "cometric.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Of noise that does not declare it: the landmark that channel i alone moves; none where it moves several.
std::optional<Index> only_landmark(const NoiseModel& noise, const PhaseState& state, Index i, Index channels) {
  const PhaseState moved = noise.gradient(state, VectorXd::Unit(channels, i));
  std::optional<Index> only;
  for (Index a = 0; a < state.q.cols(); ++a) {
    if (moved.q.col(a).isZero(0) && moved.p.col(a).isZero(0)) continue;
    if (only) return std::nullopt;
    only = a;
  }
  return only;
}

VectorXd action_by_landmark(const Registration& registration) {
  const Index channels = registration.increments.rows();
  const bool fitted = registration.mode == MatchingMode::kMap || registration.mode == MatchingMode::kMetamorphosis;
  if (!fitted || channels == 0) return {};
  const PhaseState start{registration.source.points, registration.momenta};
  const std::shared_ptr<const NoiseModel> noise = registration_noise(registration);
  const std::vector<Index> alone = landmarks_of_channels(*noise, start.q);
  VectorXd action = VectorXd::Zero(start.q.cols());
  for (Index i = 0; i < channels; ++i) {
    const std::optional<Index> landmark =
        alone.empty() ? only_landmark(*noise, start, i, channels) : alone[static_cast<std::size_t>(i)];
    if (!landmark) return {};
    action[*landmark] += 0.5 * registration.increments.row(i).squaredNorm() / registration.grid.dt();
  }
  return action;
}

VectorXd energy_of(const StochasticSystem& system, double lambda, const PhaseState& at) {
  return 0.5 * lambda * at.p.cwiseProduct(system.kernel.apply(at.q, at.q, at.p)).colwise().sum().transpose();
}

// At t = 0; in mode metamorphosis along the path.
VectorXd energy_by_landmark(const Registration& registration, const StochasticSystem& system) {
  if (registration.mode != MatchingMode::kMetamorphosis)
    return energy_of(system, registration.lambda, {registration.source.points, registration.momenta});
  const Trajectory path = replay(registration);
  VectorXd energy = VectorXd::Zero(registration.source.count());
  for (std::size_t k = 0; k + 1 < path.states.size(); ++k) {
    const PhaseState &from = path.states[k], &to = path.states[k + 1];
    energy +=
        registration.grid.dt() * energy_of(system, registration.lambda, {0.5 * (from.q + to.q), 0.5 * (from.p + to.p)});
  }
  // Of a shot H_tot at its start counts for all of its steps; of a path whose gradient does not vanish the momenta of
  // two steps differ at the node between them.
  if (energy.sum() > 0) energy *= registration.cost.energy / energy.sum();
  return energy;
}

// Where the momenta alone take the landmarks. Of a path with states p0 is that of an accurate shot: in steps of which
// half as many end nearly there, or nowhere where strong momenta have the landmarks leave every path.
constexpr double kSettled = 0.01;  // of the displacement
constexpr int kMostDoublings = 4;
std::optional<Points> flow_end(const Registration& registration, const StochasticSystem& system) {
  const bool is_path = !registration.states.empty();
  const std::unique_ptr<const Integrator> integrator = make_integrator(is_path ? "rk4" : registration.integrator);
  const PhaseState start{registration.source.points, registration.momenta};
  const StochasticSystem flow{system.kernel, make_noise("none")};
  std::optional<Points> coarse;
  for (int doublings = 0; doublings <= kMostDoublings; ++doublings) try {
      TimeGrid grid = registration.grid;
      grid.steps <<= doublings;
      Points end = integrator->integrate(flow, start, grid, Eigen::MatrixXd(0, grid.steps)).final().q;
      if (!is_path || (coarse && (end - *coarse).norm() <= kSettled * (end - start.q).norm())) return end;
      coarse = std::move(end);
    } catch (const StepError&) {  // no flow without the noise to keep the landmarks apart
      if (!is_path) break;
      coarse.reset();
    }
  return std::nullopt;
}

VectorXd data_by_landmark(const Registration& registration) {
  if (registration.data.kind != DataKind::kLandmarks) return {};
  const VectorXd parts = registration.residuals_over_sigma();
  return parts.array().isNaN().select(0, 0.5 * parts.array().square());
}

}  // namespace

LandmarkShares landmark_shares(const Registration& registration) {
  const StochasticSystem system = registration_system(registration);
  const Points& q0 = registration.source.points;
  LandmarkShares shares;
  shares.energy = energy_by_landmark(registration, system);
  shares.action = action_by_landmark(registration);
  shares.data = data_by_landmark(registration);
  if (registration.increments.rows() == 0) {
    shares.flow = registration.result - q0;
    shares.noise = Points::Zero(q0.rows(), q0.cols());
    return shares;
  }
  if (const std::optional<Points> end = flow_end(registration, system)) {
    shares.flow = *end - q0;
    shares.noise = registration.result - *end;
  }
  return shares;
}

std::optional<double> noise_fraction(const Registration& registration, const LandmarkShares& shares) {
  const Points displacement = registration.result - registration.source.points;
  if (shares.noise.size() == 0 || displacement.isZero(0)) return std::nullopt;
  return shares.noise.cwiseProduct(displacement).sum() / displacement.squaredNorm();
}

}  // namespace pulson::matching
