#include "fitter.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/text.hpp"
#include "lane_shots.hpp"
#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnit = 6;              // of units_, in variances whose effect is σ²
constexpr double kLeastGain = 0.01;      // nats that a further round would still gain by the linear model
constexpr double kTrial = 1e-3;          // amplitudes at which scales are found, of the shapes' differences
constexpr double kUnobservable = 1e-12;  // fraction of the variance of a noise that survives the alignment
constexpr int kMostBackoffs = 30;
constexpr int kMostImproved = 2;  // searches for numbers again, from better matches
constexpr double kWorse = 1;      // nats that a match may cost more with other numbers, to begin at

// Root mean square of what is observed beyond the source, length units.
double difference(const std::vector<Observation>& observations, const Points& source, double sigma) {
  double sum = 0;
  Index count = 0;
  for (const Observation& observation : observations) {
    sum += observation.residual(source).squaredNorm();
    count += observation.count();
  }
  return sigma * std::sqrt(std::max(sum / static_cast<double>(count), 1.0));
}

// The columns of a group, −1 for those fixed: momenta come first, then channels within steps.
MatrixXd columns(const MatrixXd& jacobian, Index momenta, const std::vector<int>& group_of_channel, int group) {
  const Index channels = std::ssize(group_of_channel);
  std::vector<Index> chosen;
  for (Index i = momenta; i < jacobian.cols(); ++i)
    if (group_of_channel[at((i - momenta) % channels)] == group) chosen.push_back(i);
  return jacobian(Eigen::all, chosen);
}

}  // namespace

MatrixXd squared(const MatrixXd& factor) {
  MatrixXd square = MatrixXd::Zero(factor.rows(), factor.rows());
  if (factor.cols() > 0) square.selfadjointView<Eigen::Lower>().rankUpdate(factor);  // of none Eigen divides by 0
  return square.selfadjointView<Eigen::Lower>();
}

double Fitter::State::log_evidence() const {
  double sum = 0;
  for (const Linearised& match : matches) sum += match.log_evidence;
  return sum;
}

bool Fitter::State::all_matched() const {
  return std::all_of(matches.begin(), matches.end(), [](const Linearised& match) { return match.converged; });
}

Fitter::Fitter(const Cohort& cohort, OpenNoise noise, const CohortSettings& settings)
    : cohort_(cohort),
      settings_(settings),
      sigma_(settings.sigma.in(diameter(cohort.source.points))),
      kernel_(settings.kernel.make(cohort.source.points)),
      integrator_(make_integrator(settings.integrator)),
      noise_(std::move(noise)),
      lambda_open_(!settings.lambda) {
  require_positive("sigma", sigma_);
  if (cohort.targets.empty()) throw InputError("there is no shape to fit a model to");
  const Points& source = cohort.source.points;
  noise_.model->check(static_cast<int>(source.rows()), static_cast<int>(source.cols()));
  const std::vector<int> amplitudes = channel_amplitudes(*noise_.model, source);
  group_of_channel_.assign(amplitudes.size(), -1);
  for (const Index open : noise_.open) {
    bool is_amplitude = false;
    for (std::size_t c = 0; c < amplitudes.size(); ++c)
      if (amplitudes[c] == open) {
        is_amplitude = true;
        group_of_channel_[c] = static_cast<int>(amplitudes_.size());
      }
    (is_amplitude ? amplitudes_ : others_).push_back(open);
  }
  for (int s = 0; s < static_cast<int>(cohort.targets.size()); ++s) observations_.push_back(observe(cohort, s, sigma_));
}

KernelOperator Fitter::kernel(const State& state) const {
  std::vector<KernelTerm> terms = kernel_.terms();
  for (KernelTerm& term : terms) term.alpha *= state.width;
  return KernelOperator(terms);
}

matching::MatchingProblem Fitter::problem(const State& state, int target) const {
  return {{kernel(state),
           noise_.model->parameters().size() == 0 ? noise_.model : noise_.model->with_parameters(state.parameters)},
          integrator_,
          settings_.grid,
          cohort_.source.points,
          std::make_shared<matching::LandmarkTerm>(
              matching::LandmarkObservations{cohort_.targets[at(target)].points, sigma_, {}, {}}),
          sigma_,
          state.lambda,
          {},
          kFaint};
}

matching::MatchingObjective Fitter::objective(const State& state) const {
  return matching::MatchingObjective(problem(state, 0));
}

// How the ends move where the noise grows as its effect stays the same: by what compensates for its roughness.
VectorXd Fitter::drift(const matching::MatchingObjective& objective, const Observation& observation,
                       const Linearised& match, Index group) const {
  const StochasticSystem& system = objective.problem().system;
  const auto shot = match.at.paths.empty() ? objective.evaluate(match.at.z) : match.at;
  if (!shot) return VectorXd::Zero(observation.count());
  const Trajectory& path = shot->path();
  PathChange change{{Points::Zero(path.initial().q.rows(), path.initial().q.cols()),
                     Points::Zero(path.initial().q.rows(), path.initial().q.cols())},
                    MatrixXd::Zero(path.increments.rows(), path.increments.cols()),
                    VectorXd::Zero(system.noise->parameters().size())};
  const Index parameter = amplitudes_[at(group)];
  change.parameters[parameter] = system.noise->parameters()[parameter] / 2;
  for (Index c = 0; c < path.increments.rows(); ++c)
    if (group_of_channel_[at(c)] == group) change.increments.row(c) = -path.increments.row(c) / 2;
  return observation.projection * integrator_->tangent(system, path, change).q.reshaped();
}

VarianceData Fitter::variance_data(const matching::MatchingObjective& objective, int target,
                                   const Linearised& match) const {
  const Index n = match.innovation.size();
  const Index momenta = match.jacobian.cols() - std::ssize(group_of_channel_) * settings_.grid.steps;
  VarianceData data{match.innovation, MatrixXd::Identity(n, n), {}, {}};
  const MatrixXd of_momenta = squared(match.jacobian.leftCols(momenta));
  if (lambda_open_)
    data.groups.push_back(of_momenta);
  else
    data.fixed += of_momenta;
  data.drifts.assign(data.groups.size(), VectorXd::Zero(n));
  if (group_of_channel_.empty()) return data;
  for (Index g = 0; g < std::ssize(amplitudes_); ++g)
    data.groups.push_back(squared(columns(match.jacobian, momenta, group_of_channel_, static_cast<int>(g))));
  data.fixed += squared(columns(match.jacobian, momenta, group_of_channel_, -1));
  data.drifts.assign(data.groups.size(), VectorXd::Zero(n));
  if (noise_.model->traits().compensated)
    for (Index g = 0; g < std::ssize(amplitudes_); ++g)
      data.drifts[data.drifts.size() - amplitudes_.size() + at(g)] =
          drift(objective, observations_[at(target)], match, g);
  return data;
}

// Amplitudes such that momenta and every open channel explain equal shares of the observed variance, linearised at
// rest.
Fitter::State Fitter::start(double width) const {
  State state;
  state.width = width;
  state.parameters = noise_.model->parameters();
  const double size = difference(observations_, cohort_.source.points, sigma_);
  for (const Index i : amplitudes_) state.parameters[i] = kTrial * size;
  for (const Index i : others_) state.parameters[i] = std::pow(kernel_.terms().front().alpha, 2);
  const double largest = std::max(size, diameter(cohort_.source.points));
  state.lambda = settings_.lambda.value_or(1 / (largest * largest));
  const matching::MatchingObjective at_rest = objective(state);
  for (const Observation& observation : observations_)
    state.matches.push_back(linearised_at(at_rest, observation, VectorXd::Zero(at_rest.unknowns())));
  check_observable(at_rest, state);
  double excess = 0;
  VectorXd traces = VectorXd::Zero(groups());
  for (std::size_t s = 0; s < state.matches.size(); ++s) {
    const Linearised& match = state.matches[s];
    const VarianceData data = variance_data(at_rest, static_cast<int>(s), match);
    excess += std::max(match.innovation.squaredNorm(), 2.0 * static_cast<double>(match.innovation.size())) -
              static_cast<double>(match.innovation.size());
    for (Index g = 0; g < groups(); ++g) traces[g] += data.groups[at(g)].trace();
  }
  scale(state, (excess / static_cast<double>(groups()) / traces.array()).log());
  return state;
}

// The amplitude of noise whose displacements the alignment removes is not determined.
void Fitter::check_observable(const matching::MatchingObjective& objective, const State& at_rest) const {
  const Linearised& match = at_rest.matches.front();
  const MatrixXd whole = objective.endpoint_changes(match.at.path()) / sigma_;
  const Index momenta = objective.basis().unknowns();
  for (Index g = 0; g < std::ssize(amplitudes_); ++g) {
    const double left = columns(match.jacobian, momenta, group_of_channel_, static_cast<int>(g)).squaredNorm();
    if (left > kUnobservable * columns(whole, momenta, group_of_channel_, static_cast<int>(g)).squaredNorm()) continue;
    throw InputError(fmt::format("noise '{}' moves the shapes only as their alignment ({}) does, which removes it",
                                 noise_.model->spec(), alignment_name(cohort_.alignment)));
  }
}

// Numbers whose variances are e^u times those now.
void Fitter::scale(State& state, const VectorXd& u) const {
  const Index first = lambda_open_ ? 1 : 0;
  if (lambda_open_) state.lambda *= std::exp(-u[0]);
  for (Index g = 0; g < std::ssize(amplitudes_); ++g)
    state.parameters[amplitudes_[at(g)]] *= std::exp(u[first + g] / 2);
}

// The same, and where the matches then are by the linear model. Of the matches themselves momenta stay.
std::vector<VectorXd> Fitter::rescale(State& state, const VectorXd& u) const {
  const matching::MatchingObjective before = objective(state);
  scale(state, u);
  const matching::MatchingObjective after = objective(state);
  const Index momenta = before.basis().unknowns();
  const Index channels = std::ssize(group_of_channel_);
  const double of_momenta = lambda_open_ ? std::exp(u[0] / 2) : 1;
  VectorXd factors = VectorXd::Constant(before.unknowns(), of_momenta);
  for (Index i = momenta; i < factors.size(); ++i) {
    const int group = group_of_channel_[at((i - momenta) % channels)];
    factors[i] = group >= 0 ? std::exp(u[(lambda_open_ ? 1 : 0) + group] / 2) : 1;
  }
  std::vector<VectorXd> from;
  for (Linearised& match : state.matches) {
    const MatrixXd scaled = match.jacobian * factors.asDiagonal();
    const MatrixXd covariance = squared(scaled) + MatrixXd::Identity(scaled.rows(), scaled.rows());
    const VectorXd z = scaled.transpose() * covariance.llt().solve(match.innovation);
    from.emplace_back(after.white(of_momenta * before.momenta(z), before.increments(z)));
    match.at.z = after.white(before.momenta(match.at.z), before.increments(match.at.z));
  }
  return from;
}

void Fitter::match(State& state, const std::vector<VectorXd>& from, bool with_other_starts,
                   const std::vector<VectorXd>& foretold) const {
  const matching::MatchingObjective objective = this->objective(state);
  state.matches.resize(observations_.size());
  const auto shapes = static_cast<int>(observations_.size());
  // Where what is foretold is far off, the linear model's prediction and the match before are at hand.
  const auto starts_of = [&](int s) {
    std::vector<VectorXd> starts;
    if (!foretold.empty()) starts.push_back(foretold[at(s)]);
    starts.push_back(from[at(s)]);
    if (const VectorXd& before = state.matches[at(s)].at.z; before.size() == from[at(s)].size())
      starts.push_back(before);
    return starts;
  };
  const auto good_of = [&](int s) { return state.matches[at(s)].cost + kWorse; };
  std::optional<LaneShots> shots;
  if (LaneShots::knows(objective)) shots.emplace(objective);
  const int at_once = shots ? LaneShots::lanes() : 1;
  const auto found_in_lanes = [&](int first) {
    std::vector<const Observation*> observations;
    std::vector<std::vector<VectorXd>> starts;
    std::vector<double> good;
    for (int s = first; s < std::min(first + at_once, shapes); ++s) {
      observations.push_back(&observations_[at(s)]);
      starts.push_back(starts_of(s));
      good.push_back(good_of(s));
    }
    return find_matches(*shots, objective, observations, starts, good);
  };
  parallel_for((shapes + at_once - 1) / at_once, [&](int group) {
    std::vector<Linearised> of_group;
    const int first = group * at_once;
    if (shots)
      of_group = found_in_lanes(first);
    else
      of_group.push_back(find_match(objective, observations_[at(first)], starts_of(first), good_of(first)));
    for (int s = first; s < first + std::ssize(of_group); ++s) {
      Linearised& found = of_group[at(s - first)];
      const Observation& observation = observations_[at(s)];
      const double data = found.cost - 0.5 * found.at.z.squaredNorm();
      if (with_other_starts && (!found.converged || data > static_cast<double>(observation.count()))) {
        const matching::MinimiseSummary other = minimise(matching::MatchingObjective(problem(state, s)), {});
        Linearised again = find_match(objective, observation, {other.solution.z});
        if (again.cost < found.cost) found = std::move(again);
      }
      state.matches[at(s)] = std::move(found);
      if (settings_.on_match) settings_.on_match();
    }
  });
}

void Fitter::find_variances(State& state) const {
  const matching::MatchingObjective objective = this->objective(state);
  std::vector<VarianceData> data(state.matches.size());
  parallel_for(static_cast<int>(data.size()),
               [&](int s) { data[at(s)] = variance_data(objective, s, state.matches[at(s)]); });
  state.variances = fit_variances(data, groups());
}

// Alternates between matches and amplitudes until they converge.
Fitter::State Fitter::alternate(State state, int most_rounds) const {
  const Index unknowns = objective(state).unknowns();
  std::vector<VectorXd> from;
  for (const Linearised& match : state.matches)
    from.push_back(match.at.z.size() == unknowns ? match.at.z : VectorXd::Zero(unknowns));
  State best;
  VectorXd u = VectorXd::Zero(groups());  // from the state before
  for (state.rounds = 1; state.rounds <= most_rounds; ++state.rounds) {
    from = match_with_backoff(state, std::move(from), u);
    find_variances(state);
    if (state.rounds == 1 || state.log_evidence() > best.log_evidence()) best = state;
    best.rounds = state.rounds;
    double now = 0;
    for (const Linearised& match : state.matches) now += match.log_evidence;
    double constant = 0;
    for (const Observation& observation : observations_) constant += observation.log_volume;
    const double gain = state.variances.log_likelihood - constant - now;
    if (gain < kLeastGain) {
      best.converged = best.all_matched();
      break;
    }
    u = state.variances.u;
    from = rescale(state, u);
  }
  return best;
}

// Where noise is too strong for the time step: halves the step in the amplitudes, or reduces all of them at the start.
std::vector<VectorXd> Fitter::match_with_backoff(State& state, std::vector<VectorXd> from, VectorXd u) const {
  const bool is_first = u.isZero(0);
  if (is_first) u = VectorXd::Ones(groups());
  for (int count = 0;; ++count) try {
      match(state, from, state.rounds <= 2);
      return from;
    } catch (const Error&) {
      if (count == kMostBackoffs) throw;
      if (!is_first) u /= 2;
      scale(state, -u);
      from.assign(from.size(), VectorXd::Zero(objective(state).unknowns()));
    }
}

void Fitter::find_units(const State& first) {
  units_.resize(groups());
  for (Index g = 0; g < groups(); ++g)
    units_[g] = kUnit * variance(first, g) * std::exp(first.variances.least[g]) / kNegligible;
}

CohortFit Fitter::run_again(const CohortFit& before, const std::vector<int>& which) {
  State state;
  state.lambda = before.lambda;
  state.parameters = noise_.model->parameters();
  if (!before.fitted.empty() && state.parameters.size() > 0)
    state.parameters = (before.own_noise ? before.own_noise : make_noise(before.noise, cohort_.source))->parameters();
  const matching::MatchingObjective objective = this->objective(state);
  std::vector<VectorXd> from;
  for (const int s : which)
    from.push_back(objective.white(before.shapes[at(s)].momenta, before.shapes[at(s)].increments));
  match(state, from, false);
  find_variances(state);
  find_units(state);
  NewtonOptions options;
  if (is_large()) options.most_steps = 1;
  if (numbers_open() > 0) state = climb(state, everywhere(state), options);
  find_variances(state);
  return record_without_intervals(state);
}

CohortFit Fitter::run_by_part() {
  if (!is_large()) return run();
  const Cohort few = part();
  Fitter of_few(few, noise_, settings_);
  const State of_part = of_few.maximum().state;
  State state = with_numbers_of(of_part);
  units_ = of_few.units_;
  state.converged = of_part.converged && state.all_matched();
  find_variances(state);
  return record_without_intervals(state);
}

Fitter::Maximum Fitter::maximum() {
  std::vector<State> first = candidates();
  if (numbers_open() == 0) return {std::move(first.front()), {}, {}, {}};
  Maximum best = search(first);
  for (int count = 0; improve(best.state) && count < kMostImproved; ++count) {
    known_ = {};
    best = search({climb(best.state, everywhere(best.state))});
  }
  return best;
}

CohortFit Fitter::run() {
  Maximum best = maximum();
  find_variances(best.state);
  return record(best);
}

}  // namespace pulson::compare
