// A path in midpoint steps is next to a geodesic, and where few landmarks carry the others (Carriers) so is theirs to
// that of all. Each round shoots the momenta of the path accurately, all landmarks being carried along; the data of the
// next are held against the ends of the shot rather than of the path; until both cost the same (defect correction).

#include "geodesic_search.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "carriers.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/matching/landmark_term.hpp"
#include "representatives.hpp"

namespace pulson {
namespace {

using Eigen::Index;

// Costs of a path and of the geodesic that differ by less than this part.
constexpr double kSettled = 1e-3;
// The first path is that of so many landmarks.
constexpr Index kFirstLandmarks = 150;

class GeodesicSearch {
 public:
  GeodesicSearch(const MatchingProblem& problem, const MinimiseOptions& options)
      : problem_(problem), options_(options), carriers_(find_carriers(problem)) {}

  GeodesicSolution run() {
    const PathSolution first = first_path();
    for (const char* name : {"rk4", "midpoint"})
      if (const std::optional<PathSolution> settled = settle(first, name)) return solution(*settled, name);
    PathSolution unsettled = first;
    unsettled.converged = false;
    if (first.converged) unsettled.reason = "momenta shoot their landmarks elsewhere than the path leads";
    return solution(unsettled, "midpoint");
  }

 private:
  PathSolution search(const MatchingProblem& problem, const StepFields* start, Finish finish = Finish::kMinimum) {
    PathSolution found = search_paths(problem, options_, start, finish);
    iterations_ += found.iterations;
    evaluations_ += found.evaluations;
    return found;
  }

  PathSolution first_path() {
    if (!carriers_) return search(problem_, nullptr);
    const std::vector<Index> few = representatives(problem_, kFirstLandmarks);
    PathSolution path = search(thinned(problem_, few), nullptr);
    path.fields.own.clear();  // of those few
    Points p = Points::Zero(problem_.source.rows(), problem_.source.cols());
    p(Eigen::all, few) = path.momenta;
    const Points end = shot(p, "rk4").value_or(problem_.source);
    return search(carriers_->problem(carriers_->of(end), end), &path.fields);
  }

  std::optional<Points> shot(const Points& p, const std::string& integrator) const {
    const Eigen::MatrixXd none(0, problem_.grid.steps);
    try {
      const PhaseState start{problem_.source, p};
      return make_integrator(integrator)->integrate(problem_.system, start, problem_.grid, none).final().q;
    } catch (const StepError&) {
      return std::nullopt;
    }
  }

  // The data, held against the end of the shot, `all`, where the path of the carriers leads to `ends`.
  MatchingProblem corrected(const Points& ends, const Points& all) const {
    if (carriers_) return carriers_->problem(ends, all);
    MatchingProblem moved = problem_;
    moved.data = std::make_shared<LandmarkTerm>(problem_.data->landmarks()->moved(ends - all));
    return moved;
  }

  // Empty where the shot amplifies errors so much that rounds do not come closer.
  std::optional<PathSolution> settle(PathSolution path, const std::string& name) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    std::array before{kFar, kFar, kFar};  // the last rounds
    while (path.converged) {
      const std::optional<Points> end = shot(momenta(path), name);
      if (!end) break;
      const double apart = std::abs(problem_.data->value(*end) - path.cost.data) / path.cost.total();
      if (apart <= kSettled || path.cost.total() == 0) return path;
      if (!(apart < 0.5 * before[2])) break;
      before = {apart, before[0], before[1]};
      path = search(corrected(path.path.end(), *end), &path.fields, Finish::kNearMinimum);
    }
    return std::nullopt;
  }

  Points momenta(const PathSolution& path) const { return carriers_ ? carriers_->momenta(path.momenta) : path.momenta; }

  GeodesicSolution solution(const PathSolution& path, std::string integrator) const {
    return {momenta(path), std::move(integrator), path.converged,        path.reason,
            iterations_,   evaluations_,          path.relative_gradient};
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  std::optional<Carriers> carriers_;
  int iterations_ = 0;
  int evaluations_ = 0;
};

}  // namespace

GeodesicSolution search_geodesic(const MatchingProblem& problem, const MinimiseOptions& options) {
  return GeodesicSearch(problem, options).run();
}

}  // namespace pulson
