#include <algorithm>
#include <utility>

#include "step_lanes.hpp"

namespace pulson::ensemble {
namespace {

struct SchemeRow {
  const char* integrator;
  LaneScheme scheme;
  bool compensates;     // where the noise is compensated
  double part_of_step;  // that a part of it takes
};

constexpr SchemeRow kSchemes[] = {{"heun", LaneScheme::kHeun, false, 1},
                                  {"midpoint", LaneScheme::kMidpoint, false, 1},
                                  {"variational", LaneScheme::kVariational, true, 1},
                                  {"variational-paper", LaneScheme::kVariational, false, 1},
                                  {"variational-2", LaneScheme::kVariational2, false, 0.5}};

const SchemeRow* find_scheme(const std::string& integrator) {
  const auto* const found = std::find_if(std::begin(kSchemes), std::end(kSchemes),
                                         [&](const SchemeRow& row) { return row.integrator == integrator; });
  return found == std::end(kSchemes) ? nullptr : found;
}

NoiseLoads loads_of(const NoiseModel& noise, int dimension, int count) {
  NoiseLoads loads;
  const Points zero = Points::Zero(dimension, count);
  const int channels = noise.channels(dimension, count);
  for (int i = 0; i < channels; ++i) {
    const PhaseState gradient = noise.gradient({zero, zero}, Eigen::VectorXd::Unit(channels, i));
    add_loads(gradient.p, static_cast<std::size_t>(i), loads.position);
    add_loads(gradient.q, static_cast<std::size_t>(i), loads.momentum);
  }
  return loads;
}

bool has_formula(const NoiseModel& noise) {
  if (const auto terms = terms_of_sum(noise); !terms.empty())
    return std::all_of(terms.begin(), terms.end(), [](const auto& term) { return has_formula(*term); });
  return noise.traits().hamiltonian &&
         (noise.traits().additive || screened_pairs(noise) || kunita_pairs(noise) || bump_fields(noise));
}

void add_noises(const NoiseModel& noise, int dimension, int count, std::size_t& channel,
                std::vector<LaneNoise>& noises) {
  if (const auto terms = terms_of_sum(noise); !terms.empty()) {
    for (const auto& term : terms) add_noises(*term, dimension, count, channel, noises);
    return;
  }
  if (const auto screened = screened_pairs(noise)) {
    noises.push_back({channel, *screened});
  } else if (const auto kunita = kunita_pairs(noise)) {
    noises.push_back({channel, *kunita});
  } else if (const auto bumps = bump_fields(noise)) {
    noises.push_back({channel, LaneBumps{bumps->beta, bumps->width, BumpTicks(bumps->centres)}});
  } else {
    noises.push_back({channel, loads_of(noise, dimension, count)});
  }
  channel += static_cast<std::size_t>(noise.channels(dimension, count));
}

}  // namespace

bool StepModel::knows(const StochasticSystem& system, const std::string& integrator, int dimension) {
  return find_scheme(integrator) != nullptr && dimension <= 3 && has_formula(*system.noise);
}

StepModel::StepModel(StochasticSystem its_system, const std::string& its_integrator, int its_dimension, int its_count,
                     double its_dt, std::uint64_t its_seed)
    : system(std::move(its_system)),
      integrator(make_integrator(its_integrator)),
      traits(system.noise->traits()),
      dimension(static_cast<std::size_t>(its_dimension)),
      count(static_cast<std::size_t>(its_count)),
      dt(its_dt),
      seed(its_seed),
      terms(system.kernel.terms()) {
  const NoiseModel& noise = *system.noise;
  noise.check(its_dimension, its_count);
  if (!knows(system, its_integrator, its_dimension))
    throw InputError("lanes do not know noise '" + noise.spec() + "' by integrator '" + its_integrator + "'");
  const SchemeRow& row = *find_scheme(its_integrator);
  scheme = row.scheme;
  compensates = row.compensates && traits.compensated;
  flow_time = row.part_of_step * dt;
  channels = 0;
  add_noises(noise, its_dimension, its_count, channels, noises);
  for (KernelTerm& term : terms) term.weight *= flow_time;
  const KernelOperator in_steps(terms);
  at_zero = in_steps.at_zero();
  lipschitz = in_steps.lipschitz();
}

bool take_hard_step(const StepModel& model, double* q, double* p, const double* w, std::size_t stride) {
  using Lane = Eigen::Map<Eigen::VectorXd, 0, Eigen::InnerStride<>>;
  const auto dimension = static_cast<Eigen::Index>(model.dimension);
  const auto count = static_cast<Eigen::Index>(model.count);
  const Eigen::InnerStride<> apart(static_cast<Eigen::Index>(stride));
  Lane of_q(q, dimension * count, apart), of_p(p, dimension * count, apart);
  PhaseState start{of_q.reshaped(dimension, count), of_p.reshaped(dimension, count)};
  if (!start.q.allFinite() || !start.p.allFinite()) return false;
  // A path of one step: where the mean of two steps' increments acts, that is half of its own.
  const double all = model.scheme == LaneScheme::kVariational ? 2 : 1;
  const Eigen::MatrixXd increments = all * Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>>(
                                               w, static_cast<Eigen::Index>(model.channels), apart);
  try {
    const Trajectory path = model.integrator->integrate(model.system, start, {model.dt, 1}, increments);
    of_q = path.final().q.reshaped();
    of_p = path.final().p.reshaped();
    return true;
  } catch (const StepError&) {
    return false;
  }
}

}  // namespace pulson::ensemble
