#include <algorithm>
#include <cmath>

#include "pair_lanes.hpp"
#include "path_sampler.hpp"
#include "pulson/core/name_table.hpp"
#include "sample_lanes.hpp"

namespace pulson {
namespace {

// The noise as lanes know it, in `model`. @return false where they do not
bool set_constant_noise(const NoiseModel& noise, PairModel& model) {
  model.channels = noise.channels(1, 2);
  if (model.channels > kMostPairChannels) return false;
  const PhaseState origin{Points::Zero(1, 2), Points::Zero(1, 2)};
  for (int i = 0; i < model.channels; ++i) {
    const PhaseState load = noise.gradient(origin, Eigen::VectorXd::Unit(model.channels, i));
    for (int a = 0; a < 2; ++a) {
      model.position.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(a)) = load.p(a);
      model.momentum.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(a)) = load.q(a);
    }
  }
  return true;
}

bool set_noise(const NoiseModel& noise, bool compensates, PairModel& model) {
  const NoiseTraits traits = noise.traits();
  if (!traits.hamiltonian) return false;
  if (traits.additive) return set_constant_noise(noise, model);
  const std::vector<Spec> terms = parse_spec_sum(noise.spec(), "noise");
  if (terms.size() != 1) return false;
  const bool screened = terms.front().name == "ch-sd-screened" && !compensates;
  if (!screened && terms.front().name != "potential") return false;
  model.noise = screened ? PairNoise::kScreened : PairNoise::kPotential;
  model.beta = noise.parameters()[0];
  model.gamma = noise.parameters()[1];
  model.channels = noise.channels(1, 2);
  if (!screened) return true;
  // On top of each other both landmarks have s = 1, so h_i,p = β on those that channel i moves.
  if (!set_constant_noise(noise, model)) return false;
  for (auto& row : model.position)
    for (double& moves : row) moves = moves != 0 ? 1 : 0;
  return true;
}

class PairSampler final : public PathSampler {
 public:
  PairSampler(const PairModel& model, PhaseState start, PathPlan plan)
      : model_(model), start_(std::move(start)), plan_(std::move(plan)) {}

  std::string name() const override { return "pair lanes"; }

  LaneEnds sample(std::uint64_t first_path, const Sink& sink) const override {
    return sample_lanes(
        pair_batch(model_, first_path, start_.q(0), start_.q(1) - start_.q(0), start_.p(0), start_.p(1)), plan_, 4,
        sink,
        [&](PairBatch& batch, std::uint32_t first, std::uint32_t last) { advance_pair(model_, batch, first, last); },
        copy_states);
  }

 private:
  static void copy_states(const PairBatch& batch, LaneStates& states) {
    for (std::size_t lane = 0; lane < kPathBatch; ++lane) {
      const auto row = static_cast<Eigen::Index>(lane);
      states.values(row, 0) = batch.q1[lane];
      states.values(row, 1) = batch.q1[lane] + batch.gap[lane];
      states.values(row, 2) = batch.p1[lane];
      states.values(row, 3) = batch.p2[lane];
      states.smallest_gap[lane] = batch.side * batch.gap[lane];
    }
  }

  PairModel model_;
  PhaseState start_;
  PathPlan plan_;
};

}  // namespace

std::unique_ptr<const PathSampler> make_pair_sampler(const StochasticSystem& system, const std::string& integrator,
                                                     const PhaseState& start, const PathPlan& plan) {
  const bool compensates = integrator == "variational";
  if (start.q.rows() != 1 || start.q.cols() != 2 || system.kernel.terms().size() != 1) return nullptr;
  if (!compensates && integrator != "variational-paper") return nullptr;
  PairModel model(system.kernel.terms().front());
  model.dt = plan.grid.dt();
  model.seed = plan.seed;
  model.antithetic = plan.antithetic;
  model.momentum_bound = plan.momentum_bound;
  if (!set_noise(*system.noise, compensates, model)) return nullptr;
  return std::make_unique<PairSampler>(model, start, plan);
}

}  // namespace pulson
