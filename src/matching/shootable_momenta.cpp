#include "shootable_momenta.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "settling.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

constexpr int kFewestSubsteps = 2;
// A shot takes at most a fifth of the time of the search: four sums of the kernel a step, where an iteration takes as
// long as ten or more for each step of the path (measured: 12 for 500 landmarks, 40 for 20 and 100). Or, in each step
// of the path, a million terms of such sums, a millisecond, where each sum counts for a thousand at least.
constexpr int kSumsOfIteration = 10;
constexpr Index kFewTerms = 1'000'000, kTermsOfSum = 1000;
// σ, rms, by which halved steps may move the end. A fifteenth of it is left, which costs 500 landmarks 1e-5 nats.
constexpr double kShotTolerance = 3e-3;
constexpr double kEndTolerance = 0.1;  // σ, rms

PhaseState advanced(const PhaseState& state, const Flow& rate, double dt) {
  return {state.q + dt * rate.velocity, state.p - dt * rate.force};
}

class MomentaSearch {
 public:
  MomentaSearch(const MatchingProblem& problem, MinimiseOptions options, const PathSolution& found)
      : found_(found), options_(std::move(options)), shot_(problem, found), data_(*problem.data), problem_(problem) {
    problem_.grid = found.path.grid;
    options_.max_iterations = std::min(options_.max_iterations, kMostRoundIterations);
  }

  ShootableMomenta run() {
    const std::optional<Points> end = accurate_end(found_.momenta);
    if (!end) return {found_.momenta, std::nullopt};
    if (found_.converged && !is_settled(*end))
      if (std::optional<ShootableMomenta> corrected = correct(*end)) return std::move(*corrected);
    return {found_.momenta, shot_.error(found_.momenta, *end)};
  }

 private:
  Index most_substeps() const {
    const Index terms = kTermsOfSum + problem_.source.cols() * problem_.source.cols();
    return std::max<Index>(
        {2 * kFewestSubsteps, found_.iterations * kSumsOfIteration / (5 * 4), kFewTerms / (4 * terms)});
  }

  // Fixes the number of substeps, too.
  std::optional<Points> accurate_end(const Points& p) {
    const Index most = most_substeps();
    std::optional<Points> end = shot_.end(p, kFewestSubsteps);
    for (substeps_ = 2 * kFewestSubsteps; end && substeps_ <= most; substeps_ *= 2) {
      std::optional<Points> finer = shot_.end(p, substeps_);
      if (finer && rms_distance(*finer, *end) <= kShotTolerance * problem_.sigma) return finer;
      end = std::move(finer);
    }
    return std::nullopt;
  }

  bool is_settled(const Points& end) const {
    return rms_distance(end, found_.path.end()) <= kEndTolerance * problem_.sigma &&
           std::abs(data_.value(end) - found_.cost.data) <= kSettled * found_.cost.total();
  }

  // The path is a minimum where landmarks are observed at q(T) + λσ²p(T), whatever its data are.
  Points observed() const {
    const double variance = problem_.sigma * problem_.sigma;
    return found_.path.end() + problem_.lambda * variance * found_.states.back().p;
  }

  std::optional<ShootableMomenta> correct(Points end) {
    Points target = observed();
    DiscretePath path = found_.path;
    Settling settling;
    while (settling.continues_at(rms_distance(end, found_.path.end()))) {
      target += found_.path.end() - end;
      problem_.data = std::make_shared<LandmarkTerm>(LandmarkObservations{target, problem_.sigma});
      PathSolution next = continue_path(problem_, options_, std::move(path));
      if (!next.converged) break;
      path = std::move(next.path);
      std::optional<Points> moved = shot_.end(next.momenta, substeps_);
      if (!moved) break;
      end = std::move(*moved);
      if (is_settled(end)) return ShootableMomenta{next.momenta, shot_.error(next.momenta, end)};
    }
    return std::nullopt;
  }

  const PathSolution& found_;
  MinimiseOptions options_;
  EffectiveShot shot_;
  const DataTerm& data_;
  MatchingProblem problem_;  ///< of a round
  int substeps_ = 0;
};

}  // namespace

EffectiveShot::EffectiveShot(const MatchingProblem& problem, const PathSolution& path)
    : problem_(problem),
      path_(path),
      system_(problem.system, problem.lambda),
      furthest_(kLost * std::max(diameter(problem.source), problem.sigma)) {}

std::optional<Points> EffectiveShot::end(const Points& momenta, int substeps) const {
  const SerialBlas serial;
  const double dt = path_.path.grid.dt() / substeps;
  PhaseState state{problem_.source, momenta};
  for (std::size_t k = 0; k < path_.path.middles.size(); ++k) {
    for (int i = 0; i < substeps; ++i) {
      const Flow a = system_.flow(state), b = system_.flow(advanced(state, a, dt / 2)),
                 c = system_.flow(advanced(state, b, dt / 2)), e = system_.flow(advanced(state, c, dt));
      state.q += dt / 6 * (a.velocity + 2 * (b.velocity + c.velocity) + e.velocity);
      state.p -= dt / 6 * (a.force + 2 * (b.force + c.force) + e.force);
    }
    if (!(rms_distance(state.q, path_.path.nodes[k + 1]) <= furthest_)) return std::nullopt;
  }
  return state.q;
}

DiscretisationError EffectiveShot::error(const Points& momenta, const Points& end) const {
  const double energy = problem_.lambda * path_.path.grid.time * system_.value({problem_.source, momenta});
  return {rms_distance(end, path_.path.end()), energy + problem_.data->value(end) - path_.cost.total()};
}

ShootableMomenta shootable_momenta(const MatchingProblem& problem, const MinimiseOptions& options,
                                   const PathSolution& found) {
  return MomentaSearch(problem, options, found).run();
}

}  // namespace pulson::matching
