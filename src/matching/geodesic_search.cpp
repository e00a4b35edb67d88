// A path in midpoint steps is next to a geodesic, and where few landmarks carry the others (Carriers) so is theirs to
// that of all. Each round shoots the momenta of the path accurately, all landmarks being carried along; the data of the
// next are held against the ends of the shot rather than of the path; until both cost the same (defect correction).
// Where that amplifies errors too much, nothing is shot: the others move in the fields of the carriers' path.

#include "geodesic_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "accurate_paths.hpp"
#include "carriers.hpp"
#include "core/secants.hpp"
#include "global_search.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/matching/data_term.hpp"
#include "representatives.hpp"
#include "settling.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

// Differences of rounds that Anderson's acceleration goes by.
constexpr std::size_t kSecants = 2;

class GeodesicSearch {
 public:
  GeodesicSearch(const MatchingProblem& problem, const MinimiseOptions& options, bool more_steps,
                 const std::vector<Points>& near)
      : problem_(problem),
        options_(options),
        more_steps_(more_steps),
        near_(near),
        grid_(problem.grid),
        carriers_(find_carriers(problem)),
        furthest_(kLost * std::max(diameter(problem.source), problem.sigma)),
        first_shift_(Points::Zero(problem.source.rows(), problem.source.cols())) {
    rounds_.max_iterations = std::min(options.max_iterations, kMostRoundIterations);
  }

  GeodesicSolution run() {
    const PathSolution first = first_path();
    if (const auto converged = alternate(first, "rk4")) return solution(*converged, "rk4");
    grid_ = problem_.grid;
    if (!carriers_) return solution(path_alone(first), "midpoint");
    if (const auto converged = alternate(first, "midpoint")) return solution(*converged, "midpoint");
    PathSolution unsettled = first;
    unsettled.converged = false;
    if (first.converged) unsettled.reason = "landmarks between those searched for are not carried to their targets";
    return solution(unsettled, "midpoint");
  }

 private:
  PathSolution counted(PathSolution found) {
    iterations_ += found.iterations;
    evaluations_ += found.evaluations;
    return found;
  }

  PathSolution search(const MatchingProblem& problem, const StepFields& start, Finish finish = Finish::kNoSaddle) {
    return counted(search_paths(problem, options_, &start, finish));
  }

  // From rest, or near the path that is given.
  PathSolution search_first(const MatchingProblem& problem, const std::vector<Points>& near) {
    PathSolution found = counted(near.empty() ? search_globally(problem, options_, Finish::kNoSaddle)
                                              : search_near(problem, options_, near, Finish::kShootable));
    minima_ = found.minima;
    if (!carriers_) others_ = found.others;
    return found;
  }

  PathSolution path_alone(const PathSolution& first) {
    if (!more_steps_) return search(problem_, first.fields, Finish::kRoundOff);
    PathSolution found = counted(search_accurate_paths(problem_, options_, &first.fields));
    grid_ = found.path.grid;
    return found;
  }

  PathSolution first_path() {
    if (!carriers_) return search_first(problem_, near_);
    const std::vector<Index> few = representatives(problem_, kFewLandmarks);
    std::vector<Points> near_few;
    for (const Points& nodes : near_) near_few.emplace_back(nodes(Eigen::all, few));
    PathSolution path = search_first(subsampled(problem_, few), near_few);
    path.fields.own.clear();  // of those few
    const Points end = end_of(path, "midpoint").value_or(problem_.source);
    first_shift_ = end - carriers_->carried(carriers_->of(end));
    return search(carriers_->problem(carriers_->of(end), end), path.fields);
  }

  // By `rk4`.
  std::optional<Points> shot(const Points& p, const TimeGrid& grid) const {
    const Eigen::MatrixXd none(0, grid.steps);
    try {
      const PhaseState start{problem_.source, p};
      return make_integrator("rk4")->integrate(problem_.system, start, grid, none).final().q;
    } catch (const StepError&) {
      return std::nullopt;
    }
  }

  // Nodes of all landmarks in the fields of a path of few: unlike a shot they amplify nothing.
  std::optional<std::vector<Points>> carried_along(const PathSolution& path) const {
    StepFields fields = path.fields;
    fields.own.clear();  // of those few
    const std::vector<Points> rest(path.path.nodes.size(), problem_.source);
    return carried(problem_.system, path.path.grid, problem_.source, fields, rest);
  }

  // Where all landmarks end by the momenta of a path; empty where they leave it.
  std::optional<Points> end_of(const PathSolution& path, const std::string& name) const {
    if (name == "midpoint") {
      const auto nodes = carried_along(path);
      return nodes ? std::optional(nodes->back()) : std::nullopt;
    }
    std::optional<Points> end = shot(momenta(path), grid_);
    if (end && !(rms_distance(carriers_ ? carriers_->of(*end) : *end, path.path.end()) <= furthest_)) end.reset();
    return end;
  }

  // Where all landmarks end, to first order, where those of the path end at `ends`: W·ends + s, s the shift.
  Points carried_to(const Points& ends) const { return carriers_ ? carriers_->carried(ends) : ends; }

  // The data, held against W·q + s where the path leads to q.
  MatchingProblem corrected(const Points& ends) const {
    if (carriers_) return carriers_->problem(ends, carried_to(ends) + shift_);
    MatchingProblem moved = problem_;
    moved.data = std::make_shared<LandmarkTerm>(problem_.data->landmarks()->moved(-shift_));
    return moved;
  }

  // s of the next round: what the shot of a path that was found with s makes it, but for Anderson's acceleration.
  void correct(Secants& secants, const Points& ends, const Points& all) {
    const Points found = all - carried_to(ends);
    const Eigen::VectorXd next = secants.next(shift_.reshaped(), (shift_ - found).reshaped());
    shift_ = next.reshaped(all.rows(), all.cols());
  }

  // Empty where the shot amplifies errors so much that rounds do not come closer.
  std::optional<PathSolution> alternate(PathSolution path, const std::string& name) {
    Settling settling;
    Secants secants(kSecants);
    shift_ = first_shift_;
    while (path.converged) {
      std::optional<Points> end = end_of(path, name);
      if (!end) break;
      const double cost = path.cost.total();
      if (std::abs(problem_.data->value(*end) - path.cost.data) <= kSettled * cost) {
        const std::optional<Points> better = more_accurate(path, name, *end);
        if (!better) return path;
        end = better;
        grid_.steps *= 2;
        settling.restart();
        secants.forget();
      }
      if (!settling.continues_at(std::abs(problem_.data->value(*end) - path.cost.data))) break;
      correct(secants, path.path.end(), *end);
      const MatchingProblem next = corrected(path.path.end());
      path = counted(continue_path(next, rounds_, std::move(path.path)));
    }
    return std::nullopt;
  }

  // The end of a shot in twice as many steps, where that costs another.
  std::optional<Points> more_accurate(const PathSolution& path, const std::string& name, const Points& end) const {
    if (!more_steps_ || name != "rk4" || grid_.steps >= kMostSteps * problem_.grid.steps) return std::nullopt;
    const std::optional<Points> finer = shot(momenta(path), {grid_.time, 2 * grid_.steps});
    const double change = finer ? std::abs(problem_.data->value(*finer) - problem_.data->value(end)) : 0;
    return change > kAccurate * path.cost.total() ? finer : std::nullopt;
  }

  Points momenta(const PathSolution& path) const { return carriers_ ? carriers_->momenta(path.momenta) : path.momenta; }

  // The others have no momenta, and so feel no force.
  std::vector<PhaseState> states_of_all(const PathSolution& path) const {
    if (!carriers_) return path.states;
    const auto nodes = carried_along(path);
    if (!nodes) throw NumericalError("landmarks leave the flow of others; use more `grid.steps`");
    std::vector<PhaseState> states;
    for (std::size_t k = 0; k < nodes->size(); ++k)
      states.push_back({(*nodes)[k], carriers_->momenta(path.states[k].p)});
    return states;
  }

  GeodesicSolution solution(const PathSolution& path, const std::string& integrator) const {
    return {momenta(path),
            integrator,
            grid_,
            integrator == "midpoint" ? states_of_all(path) : std::vector<PhaseState>(),
            path.converged,
            path.reason,
            iterations_,
            evaluations_,
            path.relative_gradient,
            minima_,
            others_};
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  MinimiseOptions rounds_ = options_;
  bool more_steps_;
  const std::vector<Points>& near_;  ///< nodes of a path to begin near; may be empty
  TimeGrid grid_;                    ///< of shots
  std::optional<Carriers> carriers_;
  double furthest_;             ///< of a shot from its path, rms
  Points shift_, first_shift_;  ///< s, d×N
  std::vector<Minimum> minima_;
  std::vector<std::vector<Points>> others_;
  int iterations_ = 0;
  int evaluations_ = 0;
};

}  // namespace

GeodesicSolution search_geodesic(const MatchingProblem& problem, const MinimiseOptions& options, bool more_steps,
                                 const std::vector<Points>& near) {
  return GeodesicSearch(problem, options, more_steps, near).run();
}

}  // namespace pulson::matching
