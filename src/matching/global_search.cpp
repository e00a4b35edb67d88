// Searches over paths end at local minima: two landmarks may pass each other on either side. The cost with isotropic
// noise of amplitude β on every landmark besides,
//
//     A = K + λΣ_i h_i,p h_i,pᵀ + λβ²,
//
// seems to have one minimum where λβ² is as large as K(0) (benchmarks/minima.cpp), and that of a branch only rises as β
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

#include <fmt/format.h>

#include "noise/models.hpp"
#include "path_starts.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "representatives.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

// Minima are looked for in so many steps, but on a line, where landmarks that pass each other need all, and for so many
// landmarks. (K = 7, 8 and 10 find as many: benchmarks/minima.cpp.)
constexpr int kFewSteps = 8;
constexpr Index kFewestLandmarks = 32;
// λβ² in parts of K(0): where there is one minimum, where bent paths begin, and where β may as well be 0.
constexpr double kOneMinimum = 1, kSeveral = 1.0 / 16, kNone = 4e-4;
constexpr double kLittle = 1.0 / 256;
constexpr double kHalves = 1.0 / 4, kQuarters = 1.0 / 16;  // of λβ², from one to the next
// Searches end where so many found the least cost. After that many of 30 random pairs of 4 to 8 landmarks: see
// benchmarks/minima.cpp.
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
// Costs that differ by less are those of one minimum; and by which those in few steps may be wrong.
constexpr double kSameCost = 5e-3, kFewStepsError = 0.05;
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
  if (problem.source.cols() > kFewestLandmarks && can_be_subsampled(problem))
    few = subsampled(problem, representatives(problem, kFewestLandmarks));
  if (problem.source.rows() > 1) few.grid.steps = std::min(problem.grid.steps, kFewSteps);
  return few;
}

MatchingProblem without_noise(MatchingProblem problem) {
  problem.system.noise = make_noise("none");
  return problem;
}

// The mean of λΣ_i h_i,p² over coordinates, what the noise adds to K(0).
double added_by_noise(const MatchingProblem& problem) {
  const NoiseCometric cometric = noise_cometric(*problem.system.noise, problem.source);
  return problem.lambda * cometric.matrix.diagonal().mean();
}

// With noise on every landmark besides, λβ² = `more`.
MatchingProblem with_more_noise(MatchingProblem problem, double more) {
  if (more <= 0) return problem;
  const auto each = make_noise(fmt::format("ch-sd:beta={:.17g}", std::sqrt(more / problem.lambda)));
  const NoiseModel& noise = *problem.system.noise;
  const bool is_noisy =
      noise.channels(static_cast<int>(problem.source.rows()), static_cast<int>(problem.source.cols())) > 0;
  problem.system.noise = is_noisy ? sum_of_noises({problem.system.noise, each}) : each;
  return problem;
}

bool landmarks_meet(const std::vector<Points>& nodes) {
  for (Index b = 1; b < nodes.front().cols(); ++b)
    for (Index a = 0; a < b; ++a) {
      const auto apart = [&](const Points& q) { return (q.col(a) - q.col(b)).norm(); };
      const double least = kMeeting * std::min(apart(nodes.front()), apart(nodes.back()));
      if (std::any_of(nodes.begin(), nodes.end(), [&](const Points& q) { return apart(q) < least; })) return true;
    }
  return false;
}

class GlobalSearch {
 public:
  GlobalSearch(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish)
      : problem_(problem), options_(options), finish_(finish), few_(in_few(problem)), quiet_(options) {
    quiet_.on_iteration = {};
    quiet_.max_iterations = std::min(options.max_iterations, kMostQuickIterations);
  }

  PathSolution run() {
    PathSolution best = search_paths(problem_, options_, nullptr, finish_);
    most_work_ = kMostWork * best.iterations * problem_.grid.steps * static_cast<double>(problem_.source.cols()) /
                 static_cast<double>(few_.source.cols());
    if (has_several() && best.path.energy > 0 && begin_at(best.path)) {
      look();
      refine(best);
    } else {
      best.minima = {{best.cost.total(), 1, 0}};
    }
    return best;
  }

 private:
  // Landmarks on a line keep their order without noise, and curves have no targets to go to.
  bool has_several() const {
    return problem_.data->landmarks() != nullptr &&
           (problem_.source.rows() > 1 || problem_.system.noise->traits().moves_positions);
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

  // The minimum next to these nodes; nothing where there is no path along them.
  std::optional<PathSolution> near(const std::vector<Points>& nodes, double more, Outcome& outcome) const {
    MatchingProblem problem = with_more_noise(few_, more);
    problem.grid.steps = static_cast<int>(nodes.size()) - 1;
    MinimiseOptions how = quiet_;
    how.gradient_tolerance *= more > 0 ? kLoose : kClose;
    auto path = along({problem.system, problem.lambda}, problem.grid, nodes);
    if (!path) return std::nullopt;
    PathSolution solution = continue_path(problem, how, std::move(*path));
    outcome.work += solution.iterations * problem.grid.steps;
    return solution;
  }

  // Nothing where there is no path, or where the branch costs more than `most` already. Bends that are too strong for
  // few steps take all, or twice as many.
  Outcome follow(std::vector<Points> nodes, const std::vector<double>& more, double most) const {
    Outcome outcome;
    double cost = 0;
    for (const double level : more) {
      std::optional<PathSolution> solution = near(nodes, level, outcome);
      for (int steps = problem_.grid.steps; !solution && steps <= 2 * problem_.grid.steps; steps *= 2)
        solution = near(resampled(nodes, steps), level, outcome);
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

  bool is_same(const Found& a, const Found& b) const {
    if (std::abs(a.cost - b.cost) > kSameCost * std::min(a.cost, b.cost)) return false;
    double apart = 0;
    const std::vector<Points> first = resampled(a.nodes, few_.grid.steps), second = resampled(b.nodes, few_.grid.steps);
    for (std::size_t k = 0; k < first.size(); ++k) apart = std::max(apart, rms_distance(first[k], second[k]));
    return apart <= kSamePlace * diameter(few_.source);
  }

  void add(Found found) {
    const auto same = std::find_if(minima_.begin(), minima_.end(), [&](const Found& m) { return is_same(m, found); });
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

  // In all steps and for all landmarks. Where that bends too much for these nodes, a little noise lets go first.
  std::optional<PathSolution> refined(const Found& minimum) const {
    MatchingProblem part = few_;
    part.grid = problem_.grid;
    auto path = along({part.system, part.lambda}, part.grid, resampled(minimum.nodes, part.grid.steps));
    if (!path) {
      const Outcome eased = follow(resampled(minimum.nodes, part.grid.steps), levels(kLittle, kQuarters),
                                   std::numeric_limits<double>::infinity());
      if (!eased.found) return std::nullopt;
      path = along({part.system, part.lambda}, part.grid, eased.found->nodes);
    }
    if (!path) return std::nullopt;
    if (!is_part()) return continue_path(problem_, quiet_, std::move(*path), finish_);
    StepFields fields = continue_path(part, quiet_, std::move(*path)).fields;
    const auto channels = problem_.system.noise->channels(static_cast<int>(problem_.source.rows()),
                                                          static_cast<int>(problem_.source.cols()));
    fields.controls.assign(fields.momenta.size(), Eigen::VectorXd::Zero(channels));
    fields.own.clear();
    return search_paths(problem_, quiet_, &fields, finish_);
  }

  void refine(PathSolution& best) {
    Found* recorded = &minima_.front();
    recorded->refined = best.cost.total();
    std::vector<Found*> order;
    for (std::size_t i = 1; i < minima_.size(); ++i) order.push_back(&minima_[i]);
    std::sort(order.begin(), order.end(), [](const Found* a, const Found* b) { return a->cost < b->cost; });
    double reached = recorded->cost;  // in few steps, of those that are refined
    int tried = 0;
    for (Found* minimum : order) {
      if (minimum->cost > (1 + kFewStepsError) * reached || tried++ == kMostRefined || options_.is_interrupted()) break;
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
      }
    }
    record(*recorded, best);
  }

  // Of minima that are known in few steps only, in proportion.
  void record(const Found& recorded, PathSolution& best) {
    best.minima = {{recorded.refined, recorded.searches, 0}};
    for (const Found& m : minima_) {
      if (&m == &recorded) continue;
      const double total = m.refined > 0 ? m.refined : recorded.refined * m.cost / recorded.cost;
      best.minima.push_back({total, m.searches, recorded.refined - total});
    }
    std::sort(best.minima.begin() + 1, best.minima.end(),
              [](const Minimum& a, const Minimum& b) { return a.total < b.total; });
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  Finish finish_;
  MatchingProblem few_;
  MinimiseOptions quiet_;
  double most_work_ = 0;
  std::vector<Found> minima_;  ///< the first that of the search at hand
};

}  // namespace

PathSolution search_globally(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish) {
  return GlobalSearch(problem, options, finish).run();
}

}  // namespace pulson::matching
