// Searches over paths end at local minima: two landmarks may pass each other on either side. The cost with isotropic
// noise of amplitude β on every landmark besides,
//
//     A = K + λΣ_i h_i,p h_i,pᵀ + λβ²,
//
// seems to have one minimum where λβ² is as large as K(0), and that of a branch only rises as β
// falls, since a path costs no less at a smaller β. So minima are followed from there down to β = 0, and from paths
// that are bent from a lower β, all in few steps and for few landmarks. What one search finds costs little beside the
// search in all steps and for all landmarks. They end where enough of them have found the least cost, or one and the
// search at hand have where nothing suggests another minimum. Those that cost less than what the search at hand found,
// or about as much, are searched for in all steps.

#include "global_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "noise_homotopy.hpp"
#include "path_starts.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "representatives.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

// Minima are looked for in so many steps, but on a line, where landmarks that pass each other need all, and for so many
// landmarks. (In 7 steps 3 of 60 random pairs of 6 landmarks and 8 of 60 of 8 were missed, in 8 steps 3 and 6.)
constexpr int kFewSteps = 8;
constexpr Index kFewestLandmarks = 32;  // of more than twice as many
// λβ² in parts of K(0): where there is one minimum, where bent paths begin, and where β may as well be 0.
constexpr double kOneMinimum = 1, kSeveral = 1.0 / 16, kNone = 4e-4;
constexpr double kLittle = 1.0 / 256;
constexpr double kHalves = 1.0 / 4, kQuarters = 1.0 / 16;  // of λβ², from one to the next
// Searches end where so many found the least cost: with 8 in place of 5 as many pairs of 4 landmarks are missed, at 1.3
// times the work; or after so many altogether. They are made in parallel, so many at once.
constexpr int kEnough = 5;
constexpr int kMostSearches = 40;
constexpr int kAtOnce = 4;
// No more than so much of the work of the search at hand, counted in iterations times steps times landmarks.
constexpr double kMostWork = 5;
// And where so many in turn found nothing better.
constexpr int kPatience = 16;
// No two landmarks of a path meet where none come closer than this part of their distance at either end. Of 57 random
// pairs of 4, 6 and 8 landmarks where no more than two searches ended, 3 had a better minimum: benchmarks/minima.cpp.
constexpr double kMeeting = 0.75;
// Relative gradients over their tolerance: where a minimum is left for the next β, and at the last.
constexpr double kLoose = 3e3, kClose = 30;
constexpr int kMostQuickIterations = 100;
// Costs that differ by less are those of one minimum.
constexpr double kSameCost = 5e-3;
// By which costs in few steps may be wrong, relatively; and where they are those of few landmarks, by which others have
// to be lower, since it takes long to search for all.
constexpr double kMostError = 0.05, kErrorOfPart = 0.01;
// More landmarks than these have no matrices: see search_paths().
constexpr Index kMostDense = 300;
constexpr int kMostRefined = 3;
constexpr double kSamePlace = 0.05;  // of paths of one minimum: diameters
constexpr double kSameToRounding = 1e-6;

// A minimum in few steps, for few landmarks.
struct Found {
  std::vector<Points> nodes;
  double cost = 0;
  int searches = 1;    ///< that ended there
  double refined = 0;  ///< its cost in all steps, for all landmarks; 0: not known
};

// What one search found, if anything, and what it took.
struct Outcome {
  std::optional<Found> found;
  int work = 0;  ///< iterations times steps
};

MatchingProblem in_few(const MatchingProblem& problem) {
  MatchingProblem few = problem;
  if (problem.source.cols() > 2 * kFewestLandmarks && can_be_subsampled(problem))
    few = subsampled(problem, representatives(problem, kFewestLandmarks));
  if (problem.source.rows() > 1) few.grid.steps = std::min(problem.grid.steps, kFewSteps);
  return few;
}

MatchingProblem without_noise(MatchingProblem problem) {
  problem.system.noise = make_noise("none");
  return problem;
}

class GlobalSearch {
 public:
  GlobalSearch(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish)
      : problem_(problem), options_(options), finish_(finish), few_(in_few(problem)), fully_(options) {
    fully_.on_iteration = {};
    quiet_ = fully_;
    quiet_.max_iterations = std::min(options.max_iterations, kMostQuickIterations);
  }

  PathSolution run() {
    PathSolution best = search_paths(problem_, options_, nullptr, finish_);
    most_work_ = kMostWork * best.iterations * problem_.grid.steps * static_cast<double>(problem_.source.cols()) /
                 static_cast<double>(few_.source.cols());
    if (has_several() && best.path.energy > 0 && !options_.is_interrupted() && begin_at(best.path)) {
      look();
      refine(best);
    } else {
      best.minima = {{best.cost.total(), 1, 0}};
    }
    return best;
  }

 private:
  // Landmarks on a line keep their order without noise, and curves have no targets to go to. Many on a line have been
  // followed from where there is one minimum already.
  bool has_several() const {
    const NoiseCometric noise = noise_cometric(*problem_.system.noise, problem_.source);
    if (searched_by_sweeps(problem_.system.kernel, noise, problem_.source)) return false;
    return problem_.data->landmarks() != nullptr &&
           (problem_.source.rows() > 1 || problem_.system.noise->traits().moves_positions());
  }

  bool is_part() const { return few_.source.cols() < problem_.source.cols(); }

  std::vector<Points> part_of(std::vector<Points> nodes) const {
    if (!is_part()) return nodes;
    const std::vector<Index> chosen = representatives(problem_, kFewestLandmarks);
    for (Points& q : nodes) q = Points(q(Eigen::all, chosen));
    return nodes;
  }

  bool begin_at(const DiscretePath& path) {
    Outcome outcome =
        follow(resampled(part_of(path.nodes), few_.grid.steps), {0}, std::numeric_limits<double>::infinity());
    if (!outcome.found) return false;
    minima_ = {std::move(*outcome.found)};
    return true;
  }

  // λβ² of noise to be added, from `first` K(0) down to 0; it counts what the problem has already.
  std::vector<double> levels(double first, double ratio) const {
    const double unit = few_.system.kernel.at_zero(), own = added_by_noise(few_);
    std::vector<double> more;
    for (double level = first * unit; level > std::max(own, kNone * unit); level *= ratio) more.push_back(level - own);
    more.push_back(0);
    return more;
  }

  // The minimum next to these nodes, for the landmarks of `base`; nothing where there is no path along them.
  std::optional<PathSolution> near(const MatchingProblem& base, const std::vector<Points>& nodes, double more,
                                   int& work) const {
    MatchingProblem problem = with_more_noise(base, more);
    problem.grid.steps = static_cast<int>(nodes.size()) - 1;
    MinimiseOptions how = quiet_;
    how.gradient_tolerance *= more > 0 ? kLoose : kClose;
    auto path = along({problem.system, problem.lambda}, problem.grid, nodes);
    if (!path) return std::nullopt;
    PathSolution solution = continue_path(problem, how, std::move(*path));
    work += solution.iterations * problem.grid.steps;
    return solution;
  }

  // Nothing where there is no path, or where the branch costs more than `most` already. Bends that are too strong for
  // few steps take all, or twice as many.
  Outcome follow(std::vector<Points> nodes, const std::vector<double>& more, double most) const {
    Outcome outcome;
    double cost = 0;
    for (const double level : more) {
      std::optional<PathSolution> solution = near(few_, nodes, level, outcome.work);
      for (int steps = problem_.grid.steps; !solution && steps <= 2 * problem_.grid.steps; steps *= 2)
        solution = near(few_, resampled(nodes, steps), level, outcome.work);
      if (!solution) return outcome;
      cost = solution->cost.total();
      if (!(cost <= most)) return outcome;
      nodes = std::move(solution->path.nodes);
    }
    outcome.found = Found{std::move(nodes), cost};
    return outcome;
  }

  double least() const {
    return std::min_element(minima_.begin(), minima_.end(),
                            [](const Found& a, const Found& b) { return a.cost < b.cost; })
        ->cost;
  }

  // How many searches found it.
  int times_found() const {
    const double most = (1 + kSameCost) * least();
    return std::accumulate(minima_.begin(), minima_.end(), 0,
                           [&](int sum, const Found& m) { return m.cost <= most ? sum + m.searches : sum; });
  }

  // Of costs and nodes of two paths.
  bool is_same(double a, double b, const std::vector<Points>& of_a, const std::vector<Points>& of_b) const {
    if (std::abs(a - b) > kSameCost * std::min(a, b)) return false;
    const std::vector<Points> first = resampled(of_a, few_.grid.steps), second = resampled(of_b, few_.grid.steps);
    double apart = 0;
    for (std::size_t k = 0; k < first.size(); ++k) apart = std::max(apart, rms_distance(first[k], second[k]));
    return apart <= kSamePlace * diameter(problem_.source);
  }

  void add(Found found) {
    const auto same = std::find_if(minima_.begin(), minima_.end(),
                                   [&](const Found& m) { return is_same(m.cost, found.cost, m.nodes, found.nodes); });
    if (same == minima_.end()) {
      minima_.push_back(std::move(found));
      return;
    }
    ++same->searches;
    if (found.cost < same->cost) {
      same->cost = found.cost;
      same->nodes = std::move(found.nodes);
    }
  }

  // Bends −1, 0, 1, …: −1 is the path without noise.
  Outcome search(int bend, double most) const {
    if (bend >= 0) return follow(bent_path(few_, bend, options_.seed), levels(kSeveral, kQuarters), most);
    const PathSolution geodesic = search_paths(without_noise(few_), quiet_, nullptr, Finish::kNoSaddle);
    Outcome outcome = follow(geodesic.path.nodes, {0}, most);
    outcome.work += geodesic.iterations * few_.grid.steps;
    return outcome;
  }

  void look() {
    Outcome straight = follow(straight_path(few_), levels(kOneMinimum, kHalves), (1 + kSameCost) * least());
    int work = straight.work, searches = 2;
    if (straight.found) add(std::move(*straight.found));
    if (times_found() == searches && !landmarks_meet(minima_.front().nodes)) return;
    const bool is_noisy = added_by_noise(few_) > 0 && few_.source.rows() > 1;
    int since = 0;  // the last that found something better
    for (int bend = is_noisy ? -1 : 0; searches < kMostSearches && times_found() < kEnough; bend += kAtOnce) {
      if (since >= kPatience || work > most_work_ || options_.is_interrupted()) return;
      std::vector<Outcome> outcomes(kAtOnce);
      const double before = least(), most = (1 + kSameCost) * before;
      parallel_for(kAtOnce, [&](int i) { outcomes[static_cast<std::size_t>(i)] = search(bend + i, most); });
      for (Outcome& outcome : outcomes) {
        work += outcome.work;
        ++searches;
        if (outcome.found) add(std::move(*outcome.found));
      }
      since = least() < (1 - kSameCost) * before ? 0 : since + kAtOnce;
    }
  }

  // The minimum next to these nodes, in full. A little noise lets go first where there is no path along them.
  std::optional<PathSolution> settled(const MatchingProblem& base, std::vector<Points> nodes, bool eased) const {
    if (eased) {
      int work = 0;
      for (const double level : levels(kLittle, kQuarters)) {
        if (level == 0) break;
        std::optional<PathSolution> solution = near(base, nodes, level, work);
        if (!solution) return std::nullopt;
        nodes = std::move(solution->path.nodes);
      }
    }
    if (auto path = along({base.system, base.lambda}, base.grid, nodes))
      return continue_path(base, fully_, std::move(*path), finish_);
    return eased ? std::nullopt : settled(base, std::move(nodes), true);
  }

  // In all steps, for few landmarks.
  double cost_of_part(const Found& minimum) const {
    MatchingProblem part = few_;
    part.grid = problem_.grid;
    const auto solution = settled(part, resampled(minimum.nodes, part.grid.steps), false);
    return solution ? solution->cost.total() : std::numeric_limits<double>::infinity();
  }

  // In all steps and for all landmarks: the others are carried along, and let go to where they should be.
  std::optional<PathSolution> refined(const Found& minimum) const {
    MatchingProblem part = few_;
    part.grid = problem_.grid;
    std::optional<PathSolution> solution = settled(part, resampled(minimum.nodes, part.grid.steps), false);
    if (!solution || !is_part()) return solution;
    if (!(solution->cost.total() < (1 - kErrorOfPart) * cost_of_part(minima_.front()))) return std::nullopt;
    StepFields fields = std::move(solution->fields);
    const auto channels = problem_.system.noise->channels(static_cast<int>(problem_.source.rows()),
                                                          static_cast<int>(problem_.source.cols()));
    fields.controls.assign(fields.momenta.size(), Eigen::VectorXd::Zero(channels));
    fields.own.clear();
    if (problem_.source.cols() > kMostDense) return search_paths(problem_, fully_, &fields, finish_);
    const std::vector<Points> rest(fields.momenta.size() + 1, problem_.source);
    auto nodes = carried(problem_.system, problem_.grid, problem_.source, fields, rest);
    return nodes ? settled(problem_, std::move(*nodes), true) : std::nullopt;
  }

  void refine(PathSolution& best) {
    Found* recorded = &minima_.front();
    recorded->refined = best.cost.total();
    std::vector<Found*> order;
    for (std::size_t i = 1; i < minima_.size(); ++i) order.push_back(&minima_[i]);
    std::sort(order.begin(), order.end(), [](const Found* a, const Found* b) { return a->cost < b->cost; });
    // By as much as few steps are wrong for the one at hand, so for others, about.
    const double wrong = is_part() ? -kErrorOfPart : std::abs(recorded->cost / recorded->refined - 1) + kSameCost;
    double reached = recorded->cost;  // in few steps, of those that are refined
    int tried = 0;
    for (Found* minimum : order) {
      if (minimum->cost > (1 + std::min(wrong, kMostError)) * reached || tried++ == kMostRefined ||
          options_.is_interrupted())
        break;
      std::optional<PathSolution> solution = refined(*minimum);
      if (!solution || !solution->converged) continue;
      minimum->refined = solution->cost.total();
      reached = std::min(reached, minimum->cost);
      solution->iterations += best.iterations;
      solution->evaluations += best.evaluations;
      if (minimum->refined < (1 - kSameToRounding) * recorded->refined || !best.converged) {
        recorded = minimum;
        best = std::move(*solution);
      } else {
        best.iterations = solution->iterations;
        best.evaluations = solution->evaluations;
        if (is_same(recorded->refined, minimum->refined, best.path.nodes, solution->path.nodes)) {
          recorded->searches += std::exchange(minimum->searches, 0);
        }
      }
    }
    record(*recorded, best);
  }

  // Of minima that are known in few steps only, in proportion; what would then be below the one recorded is no minimum
  // in all steps, or its search there did not converge.
  void record(const Found& recorded, PathSolution& best) {
    best.minima = {{recorded.refined, recorded.searches, 0}};
    best.others.clear();
    const auto total = [&](const Found& m) {
      return m.refined > 0 ? m.refined : recorded.refined * m.cost / recorded.cost;
    };
    std::vector<const Found*> others;
    for (const Found& m : minima_)
      if (&m != &recorded && m.searches > 0 && (m.refined > 0 || total(m) >= recorded.refined)) others.push_back(&m);
    std::sort(others.begin(), others.end(), [&](const Found* a, const Found* b) { return total(*a) < total(*b); });
    for (const Found* m : others) {
      best.minima.push_back({total(*m), m->searches, recorded.refined - total(*m)});
      best.others.push_back(is_part() ? std::vector<Points>() : m->nodes);
    }
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  Finish finish_;
  MatchingProblem few_;
  MinimiseOptions fully_, quiet_;  ///< without progress, in full and in few iterations
  double most_work_ = 0;
  std::vector<Found> minima_;  ///< the first that of the search at hand
};

}  // namespace

bool landmarks_meet(const std::vector<Points>& nodes) {
  for (Index b = 1; b < nodes.front().cols(); ++b)
    for (Index a = 0; a < b; ++a) {
      const auto apart = [&](const Points& q) { return (q.col(a) - q.col(b)).norm(); };
      const double least = kMeeting * std::min(apart(nodes.front()), apart(nodes.back()));
      if (std::any_of(nodes.begin(), nodes.end(), [&](const Points& q) { return apart(q) < least; })) return true;
    }
  return false;
}

std::optional<PathSolution> search_along(const MatchingProblem& problem, const MinimiseOptions& options,
                                         const std::vector<Points>& nodes, Finish finish) {
  auto path = along({problem.system, problem.lambda}, problem.grid, resampled(nodes, problem.grid.steps));
  if (!path) return std::nullopt;
  return continue_path(problem, options, std::move(*path), finish);
}

PathSolution search_near(const MatchingProblem& problem, const MinimiseOptions& options,
                         const std::vector<Points>& nodes, Finish finish) {
  const EffectiveHamiltonian system(problem.system, problem.lambda);
  const auto path = along(system, problem.grid, resampled(nodes, problem.grid.steps));
  if (!path) return search_globally(problem, options, finish);
  const StepFields fields = fields_of(system, *path);
  PathSolution found = search_paths(problem, options, &fields, finish);
  found.minima = {{found.cost.total(), 1, 0}};
  return found;
}

PathSolution search_globally(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish) {
  return GlobalSearch(problem, options, finish).run();
}

}  // namespace pulson::matching
