#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>

#include <fmt/core.h>

#include "confirmation.hpp"
#include "core/undefined.hpp"
#include "evidence.hpp"
#include "finer_steps.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/posterior.hpp"
#include "tempering.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const NameTable<MoveKind>& sampler_table() {
  static const NameTable<MoveKind> kTable(
      "sampler", {{"hmc",
                   {},
                   "Hamiltonian Monte Carlo: a quarter turn in steps whose size is adapted",
                   {.uses_gradient = true, .target_acceptance = 0.8}},
                  {"nuts",
                   {},
                   "Hamiltonian Monte Carlo whose trajectories end where they turn back: the no-U-turn sampler",
                   {.uses_gradient = true, .target_acceptance = 0.8, .until_it_turns = true}},
                  {"pcn",
                   {},
                   "preconditioned Crank-Nicolson: rotations of an adapted angle, without gradients",
                   {.uses_gradient = false, .target_acceptance = 0.35}},
                  {"rto",
                   {},
                   "randomise then optimise: Hamiltonian Monte Carlo whose draws are fitted to their perturbed data",
                   {.uses_gradient = true, .target_acceptance = 0.8, .fits_data = true}}});
  return kTable;
}

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void check(const SamplerOptions& options) {
  if (options.chains < 1) throw InputError(fmt::format("there are {} chains; at least 1 is needed", options.chains));
  if (options.draws < 4)
    throw InputError(fmt::format("there are {} draws of a chain; at least 4 are needed", options.draws));
  if (options.warmup < 0)
    throw InputError(fmt::format("the warm-up has {} iterations; it must not be negative", options.warmup));
  if (options.searches < 0)
    throw InputError(fmt::format("there are {} searches; the number must not be negative", options.searches));
  if (options.temperatures < 1)
    throw InputError(fmt::format("there are {} temperatures; at least 1 is needed", options.temperatures));
}

// What all chains have drawn, draw·chains + chain.
class Recorder {
 public:
  Recorder(const ChainSetting& setting, const SamplerOptions& options)
      : space_(setting.space), options_(options), components_(setting.reference.components.front()) {
    const ParameterSpace& space = setting.space;
    const std::vector<Specimen>& specimens = setting.specimens;
    const Index all = static_cast<Index>(options.draws) * options.chains;
    out.chains = options.chains;
    out.draws = options.draws;
    for (const ParameterPrior& prior : space.priors()) out.names.push_back(prior.name);
    out.parameters.resize(space.count(), all);
    out.log_likelihood.resize(all);
    out.log_weight.resize(all);
    out.mode.resize(all);
    if (options.temperatures > 1) out.tempered_log_likelihood.resize(options.temperatures, all);
    const Index kept = std::min<Index>(options.paths_kept, all);
    for (Index i = 0; i < kept; ++i) out.kept.push_back(static_cast<int>(i * all / kept));
    for (const Specimen& specimen : specimens) {
      const Index size = specimen.problem().source.size();
      if (specimen.momentum_unknowns() > 0) out.momenta.emplace_back(size, all);
      for (std::size_t b = 0; b < specimen.branches().size(); ++b) {
        for (auto* rows : {&out.ends, &out.middles}) rows->emplace_back(size, all);
        out.paths.emplace_back(out.kept.size());
      }
    }
  }

  void record(int draw, int chain, const Replicas& group) {
    const Index column = static_cast<Index>(draw) * options_.chains + chain;
    const Chain& state = group.posterior();
    for (Index l = 0; l < out.tempered_log_likelihood.rows(); ++l)
      out.tempered_log_likelihood(l, column) = group.chains()[static_cast<std::size_t>(l)].log_likelihood();
    if (space_.count() > 0) out.parameters.col(column) = space_.values(state.theta().phi);
    out.log_likelihood[column] = state.log_likelihood();
    out.log_weight[column] = state.log_weight();
    out.mode[column] = static_cast<int>(components_[state.points().front().component].mode);
    const auto kept = std::lower_bound(out.kept.begin(), out.kept.end(), static_cast<int>(column));
    const bool keeps = kept != out.kept.end() && *kept == column;
    std::size_t path = 0;
    for (const ChainPoint& point : state.points())
      for (const Trajectory& trajectory : point.shot.paths) {
        const std::vector<PhaseState>& states = trajectory.states;
        if (path < out.momenta.size()) out.momenta[path].col(column) = states.front().p.reshaped();
        out.ends[path].col(column) = states.back().q.reshaped();
        out.middles[path].col(column) = states[states.size() / 2].q.reshaped();
        if (keeps)
          for (const PhaseState& phase : states)
            out.paths[path][static_cast<std::size_t>(kept - out.kept.begin())].push_back(phase.q);
        ++path;
      }
  }

  // What is recorded, in an order that writing and reading share.
  template <typename State>
  void pass(State& state) {
    state(out.parameters, out.log_likelihood, out.log_weight, out.mode, out.tempered_log_likelihood);
    state(out.momenta, out.ends, out.middles, out.paths);
  }

  PosteriorDraws out;

 private:
  const ParameterSpace& space_;
  const SamplerOptions& options_;
  const std::vector<Component>& components_;  // of the first specimen
};

// Factor on σ in the reference of moves with kicks: where the path is far from linear a wider reference has weights
// that vary less, and chains do not stick in the tails. Without kicks it would cost acceptance, e^{−O(n)}, and draws
// that fit their data have flat weights without it.
constexpr double kInflation = 1.5;
double inflation(const MoveKind& move) { return move.uses_gradient && !move.fits_data ? kInflation : 1; }

// The first component is the one whose draws may be fitted to their data.
void put_best_first(Reference& reference) {
  for (std::size_t s = 0; s < reference.minima.size(); ++s) {
    Index best = 0;
    reference.log_weights[s].maxCoeff(&best);
    std::swap(reference.minima[s].front(), reference.minima[s][static_cast<std::size_t>(best)]);
    std::swap(reference.log_weights[s][0], reference.log_weights[s][best]);
  }
}

// Where iterations of all chains end, as powers are retuned or draws begin: of the warm-up an eighth, a quarter, a half
// and all.
std::vector<int> phases(const SamplerOptions& options) {
  std::vector<int> ends;
  if (options.temperatures > 2)
    for (const int part : {8, 4, 2})
      if (options.warmup / part > (ends.empty() ? 0 : ends.back())) ends.push_back(options.warmup / part);
  if (options.warmup > 0) ends.push_back(options.warmup);
  ends.push_back(options.warmup + options.draws);
  return ends;
}

std::vector<double> mean_rejected(const std::vector<Replicas>& groups) {
  std::vector<double> mean(groups.front().chains().size() - 1, 0);
  for (const Replicas& group : groups) {
    const std::vector<double> of_group = group.rejected();
    for (std::size_t l = 0; l < mean.size(); ++l) mean[l] += of_group[l] / static_cast<double>(groups.size());
  }
  return mean;
}

// All iterations of all chains.
class Run {
 public:
  Run(const ChainSetting& setting, const SamplerOptions& options, Recorder& recorder)
      : options_(options), recorder_(recorder), powers_(first_powers(options.temperatures)) {
    std::vector<std::optional<Replicas>> begun(static_cast<std::size_t>(options.chains));
    parallel_for(options.chains, [&](int c) { begun[static_cast<std::size_t>(c)].emplace(setting, c, powers_); });
    for (std::optional<Replicas>& group : begun) groups_.push_back(std::move(*group));
    if (!options.state.empty()) read();
  }

  /// @return whether it was not ended before
  bool finish(std::chrono::steady_clock::time_point start) {
    for (const int end : phases(options_)) {
      while (done_ < end) {
        const auto before = std::chrono::steady_clock::now();
        const int some = std::min(at_once_, end - done_);
        iterate(some);
        done_ += some;
        const double taken = seconds_since(before);
        if (taken < kSeconds / 2) at_once_ = std::min(2 * at_once_, kMostAtOnce);
        if (taken > kSeconds) at_once_ = std::max(1, at_once_ / 2);
        if (done_ == end) between_phases(start);
        if (options_.on_state && !options_.on_state([&] { return state(start); }) && done_ < iterations()) return false;
      }
    }
    return true;
  }

  const std::vector<Replicas>& groups() const { return groups_; }
  const std::vector<double>& powers() const { return powers_; }
  std::string state(std::chrono::steady_clock::time_point start) {
    StateWriter to;
    to(done_, warm_, before_ + seconds_since(start), powers_);
    for (const Replicas& group : groups_) group.write(to);
    recorder_.pass(to);
    return to.take();
  }
  double warmup_seconds() const { return warm_; }
  double seconds_before() const { return before_; }

 private:
  static constexpr double kSeconds = 1;  // between states
  static constexpr int kMostAtOnce = 1024;

  int iterations() const { return options_.warmup + options_.draws; }

  void iterate(int count) {
    parallel_for(options_.chains, [&](int c) {
      Replicas& group = groups_[static_cast<std::size_t>(c)];
      for (int i = done_; i < done_ + count; ++i) {
        group.advance(options_.warmup);
        if (i >= options_.warmup) recorder_.record(i - options_.warmup, c, group);
        if (options_.on_progress) options_.on_progress(done_part(1));
      }
    });
  }

  double done_part(int more) {
    const int now = counted_ += more;
    return static_cast<double>(now) / (static_cast<double>(options_.chains) * iterations());
  }

  void between_phases(std::chrono::steady_clock::time_point start) {
    if (done_ > options_.warmup) return;
    if (options_.temperatures > 2) powers_ = retuned(powers_, mean_rejected(groups_));
    for (Replicas& group : groups_) group.set_powers(powers_);
    if (done_ == options_.warmup) warm_ = before_ + seconds_since(start);
  }

  void read() {
    StateReader from(options_.state);
    from(done_, warm_, before_, powers_);
    for (Replicas& group : groups_) group.read(from);
    recorder_.pass(from);
    from.require_end();
    counted_ = done_ * options_.chains;
  }

  const SamplerOptions& options_;
  Recorder& recorder_;
  std::vector<Replicas> groups_;
  std::vector<double> powers_;
  int done_ = 0;  // iterations of each chain
  int at_once_ = 1;
  std::atomic<int> counted_ = 0;  // of all chains
  double warm_ = 0, before_ = 0;  // seconds
};

}  // namespace

MatrixXd PosteriorDraws::by_chain(const Eigen::Ref<const Eigen::RowVectorXd>& row) const {
  return row.reshaped(chains, draws).transpose();
}

namespace {

constexpr int kCheckTemperatures = 8;
constexpr double kCheckAccuracy = 0.01;  // of the log evidence, or half of the chains' error
constexpr int kFewestCheckDraws = 200;
constexpr int kPathsForSteps = 3, kFewestForSteps = 1000;  // of weighted draws, each of which takes three paths
constexpr std::uint64_t kCheckSeed = 0x9e3779b97f4a7c15ULL;

struct ChainsRun {
  PosteriorDraws draws;
  std::string state;  // at its end, where states are asked for
};

// All chains of one setting, and the evidence of them. @param reference without components
ChainsRun run_chains(const std::vector<Specimen>& specimens, const ParameterSpace& space, Reference reference,
                     const SamplerOptions& options, std::chrono::steady_clock::time_point start) {
  const MoveKind move = sampler_table().find(options.method).make;
  defend(reference, specimens, space, inflation(move));
  const ChainSetting setting{specimens, space, reference, move, options.seed};
  Recorder recorder(setting, options);
  Run run(setting, options, recorder);
  PosteriorDraws& out = recorder.out;
  if (!run.finish(start)) {
    out.partial = true;
    return {std::move(out), {}};
  }
  const std::vector<Replicas>& groups = run.groups();
  std::int64_t lost = 0;
  for (const Replicas& group : groups) {
    const Chain& chain = group.posterior();
    out.acceptance += chain.acceptance() / options.chains;
    out.parameter_acceptance += chain.parameter_acceptance() / options.chains;
    out.step_angle += chain.angle() / options.chains;
    for (const Chain& of_power : group.chains()) out.path_evaluations += of_power.evaluations();
    lost += group.chains().front().lost_draws();
  }
  if (options.temperatures > 1) {
    out.powers = run.powers();
    for (const double rejected : mean_rejected(groups)) out.exchanged.push_back(1 - rejected);
    out.lost_fraction =
        static_cast<double>(lost) / (static_cast<double>(options.chains) * (options.warmup + options.draws));
  }
  for (const auto& minima : reference.minima) out.modes = std::max(out.modes, static_cast<int>(minima.size()));
  out.laplace_log_evidence = reference.laplace_log_evidence;
  out.pareto_k = out.chain_pareto_k = out.of_finer_steps.value = kUndefined;
  if (options.evidence && options.temperatures > 1) {
    out.log_evidence = tempered_log_evidence(out);
  } else if (options.evidence) {
    const BridgedEvidence bridged = bridge_log_evidence(setting, out);
    out.log_evidence = bridged.log_evidence;
    out.pareto_k = bridged.pareto_k;
    out.chain_pareto_k = bridged.chain_pareto_k;
  }
  // Draws that do not change, or are too few to tell, determine nothing.
  if (std::isnan(effective_sample_size(out.by_chain(out.log_likelihood.transpose()))))
    out.log_evidence = {kUndefined, kUndefined};
  out.warmup_seconds = run.warmup_seconds();
  out.seconds = run.seconds_before() + seconds_since(start);
  return {std::move(out), options.on_state ? run.state(start) : std::string()};
}

// Paths as many as the chains took, which cost less without derivatives: first weighted draws, then, where these
// determine nothing, tempered chains. @return none where it was ended
std::optional<Confirmation> confirm(const ChainSetting& setting, const Reference& reference,
                                    const SamplerOptions& options, const ChainsRun& run) {
  const PosteriorDraws& draws = run.draws;
  const std::vector<Specimen>& specimens = setting.specimens;
  const ParameterSpace& space = setting.space;
  const MoveKind move = sampler_table().find(options.method).make;
  // An adjoint costs about as much as a path, and a fitted draw as several, and one with its derivatives.
  const std::int64_t of_cost = move.fits_data ? 8 : move.uses_gradient ? 2 : 1;
  const ImportanceEstimate weighted = importance_estimate(
      setting, of_cost * draws.path_evaluations, std::max(kCheckAccuracy, 0.5 * draws.log_evidence.standard_error));
  if (is_of_use(weighted)) return confirmed_by(weighted, setting, draws);
  if (options.temperatures > 1) return Confirmation{};
  SamplerOptions tempered = options;
  tempered.method = "pcn";
  tempered.temperatures = kCheckTemperatures;
  tempered.seed = options.seed ^ kCheckSeed;
  tempered.paths_kept = 0;
  tempered.state.clear();
  if (options.on_state)
    tempered.on_state = [&](const std::function<std::string()>&) {
      return options.on_state([&] { return run.state; });
    };
  std::int64_t of_iteration = 0;
  const ThetaPoint centre = make_theta(setting, reference.centre, 1);
  for (std::size_t s = 0; s < specimens.size(); ++s)
    of_iteration +=
        1 + posterior::ShotBatch(specimens[s], centre.models[s]).at_once() + (space.count() > 0 ? kThetaMoves : 0);
  const auto iterations =
      static_cast<int>(of_cost * draws.path_evaluations / (of_iteration * kCheckTemperatures * options.chains));
  tempered.warmup = iterations / 3;
  tempered.draws = iterations - tempered.warmup;
  if (tempered.draws < kFewestCheckDraws) return Confirmation{};
  const PosteriorDraws other =
      run_chains(specimens, space, reference, tempered, std::chrono::steady_clock::now()).draws;
  if (other.partial) return std::nullopt;
  return is_of_use(other) ? confirmed_by(other, draws) : Confirmation{};
}

}  // namespace

PosteriorDraws sample_posterior(const PosteriorProblem& problem, const SamplerOptions& options) {
  const SerialBlas serial;
  check(options);
  const auto start = std::chrono::steady_clock::now();
  if (sampler_table().find(options.method).make.fits_data && options.temperatures > 1)
    throw InputError(fmt::format("the method '{}' has no tempered posteriors; with several temperatures take another",
                                 options.method));
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens = specimens_of(problem);
  Reference reference = make_reference(specimens, space, options.searches, options.seed);
  put_best_first(reference);
  ChainsRun run = run_chains(specimens, space, reference, options, start);
  PosteriorDraws& draws = run.draws;
  if (draws.partial || !options.evidence || std::isnan(draws.log_evidence.value)) return std::move(draws);
  const auto end_of_chains = std::chrono::steady_clock::now();
  Reference defended = reference;
  defend(defended, specimens, space, 1);
  const ChainSetting setting{specimens, space, defended, {}, options.seed ^ kCheckSeed};
  const std::optional<Confirmation> confirmation = confirm(setting, reference, options, run);
  draws.partial = !confirmation;
  if (draws.partial) return std::move(draws);
  draws.confirmation = *confirmation;
  if (draws.confirmation.by != Confirmation::By::kNothing)
    draws.log_evidence.standard_error = std::hypot(draws.log_evidence.standard_error, draws.confirmation.difference);
  const std::vector<Specimen> finer = specimens_of(with_finer_steps(problem));
  draws.of_finer_steps = evidence_of_finer_steps(
      setting, finer, std::max<std::int64_t>(draws.path_evaluations / kPathsForSteps, kFewestForSteps));
  draws.seconds += seconds_since(end_of_chains);
  return std::move(draws);
}

}  // namespace pulson::inference
