#include <algorithm>
#include <cmath>
#include <limits>

#include "own_kernels.hpp"
#include "pair_lanes.hpp"
#include "path_sampler.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::ensemble {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kMostTurns = 2000;
constexpr int kSamples = 256;  // of the branch, to see whether it turns

RadialJet jet_of(const KernelTerm& kernel, double gap) { return KernelOperator({kernel}).jet(gap * gap); }

// K(0) − K(g), exact for small gaps of the kernels that have no better form than exp.
double drop(const KernelTerm& kernel, double g) {
  const double r = std::abs(g) / kernel.alpha;
  if (kernel.profile == KernelProfile::kGaussian) return -kernel.weight * std::expm1(-r * r);
  if (kernel.profile == KernelProfile::kPeakon) return -kernel.weight * std::expm1(-r);
  return kernel.weight - jet_of(kernel, g).value;
}

// g + |a| drop(g) = c for c > 0, whose left side increases: one root, between 0 and c.
double closing_root(const KernelTerm& kernel, double c, double strength) {
  double low = 0;
  double high = c;
  double g = c;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const double f = g + strength * drop(kernel, g) - c;
    (f > 0 ? high : low) = g;
    const double newton = g - f / (1 + strength * std::abs(jet_of(kernel, g).first * g));
    const double next = newton > low && newton < high ? newton : low + (high - low) / 2;
    if (std::abs(next - g) <= kEpsilon * next || high - low <= kEpsilon * high) return next;
    g = next;
  }
  return g;
}

// The smallest root g ≥ c > 0 of g = c + a drop(g), a > 0: the fixed-point iteration from c rises to it. The branch
// from a = 0 has come so far if (g − c)/drop(g), the a that belongs to g, rises throughout.
bool opening_root(const KernelTerm& kernel, double c, double a, double& root) {
  double g = c;
  for (int turn = 0;; ++turn) {
    const double next = c + a * drop(kernel, g);
    if (!(next - g > 4 * kEpsilon * next)) break;
    if (turn == kMostTurns) return false;
    g = next;
  }
  root = g;
  double before = 0;
  for (int i = 1; i <= kSamples; ++i) {
    const double x = c * std::pow(g / c, static_cast<double>(i) / kSamples);  // folds are as wide as they are far
    if (x <= c) continue;
    const double strength = (x - c) / drop(kernel, x);
    if (!(strength >= before * (1 - 1e-12))) return false;
    before = strength;
  }
  return true;
}

}  // namespace

PairModel::PairModel(const KernelTerm& term) : kernel(term), lipschitz(KernelOperator({term}).lipschitz()) {
  const KernelOperator k({term});
  for (reach = term.alpha; k.jet(reach * reach).value > 1e-18 * term.weight;) reach *= 1.01;
}

void pair_kernel(const KernelTerm& kernel, double gap, double& value, double& slope) {
  const RadialJet jet = jet_of(kernel, gap);
  value = jet.value;
  slope = jet.first * gap;
}

bool solve_gap(const KernelTerm& kernel, double c, double a, double& gap) {
  if (!std::isfinite(c) || !std::isfinite(a)) return false;
  // K is even: a gap below 0 is the mirror image with −a.
  const double sign = c < 0 ? -1 : 1;
  const double strength = sign * a;
  double g = 0;
  if (c != 0) {
    if (strength <= 0)
      g = closing_root(kernel, std::abs(c), -strength);
    else if (!opening_root(kernel, std::abs(c), strength, g))
      return false;
  }
  gap = sign * g;
  return true;
}

PairBatch pair_batch(const PairModel& model, std::uint64_t first_path, double q1, double gap, double p1, double p2) {
  PairBatch batch{};
  batch.first_path = first_path;
  batch.side = gap < 0 ? -1 : 1;
  batch.q1.fill(q1);
  batch.gap.fill(gap);
  batch.p1.fill(p1);
  batch.p2.fill(p2);
  batch.value.fill(jet_of(model.kernel, gap).value);
  batch.largest_momentum.fill(std::max(std::abs(p1), std::abs(p2)));
  batch.smallest_side.fill(std::abs(gap));
  return batch;
}

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

  LaneEnds sample(std::uint64_t first_path, std::size_t /*lanes*/, const Sink& sink) const override {
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
  if (has_own(system.kernel.terms())) return nullptr;
  if (!compensates && integrator != "variational-paper") return nullptr;
  PairModel model(system.kernel.terms().front());
  model.dt = plan.grid.dt();
  model.seed = plan.seed;
  model.antithetic = plan.antithetic;
  model.momentum_bound = plan.momentum_bound;
  if (!set_noise(*system.noise, compensates, model)) return nullptr;
  return std::make_unique<PairSampler>(model, start, plan);
}

}  // namespace pulson::ensemble
