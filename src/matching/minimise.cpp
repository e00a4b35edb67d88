#include "pulson/matching/minimise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pulson/matching/landmark_term.hpp"
#include "solvers.hpp"
#include "starts.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::array<std::pair<std::string_view, Solver>, 3> kSolverNames = {
    {{"auto", Solver::kAuto}, {"gauss-newton", Solver::kGaussNewton}, {"lbfgs", Solver::kLbfgs}}};

// Beyond these a Jacobian costs more than the iterations it saves: its columns, and with fitted noise its rows.
constexpr Index kMostColumns = 1200;
constexpr Index kMostRows = 800;

// Continuation: the first softness, of the root mean square residual, and how it comes down.
constexpr double kFirstPart = 0.2;
constexpr double kSoftnessRatio = 2;
constexpr double kStageTolerance = 1e-2;
constexpr int kStageIterations = 30;

// A search that stops with a larger relative gradient has failed.
constexpr double kFarFromMinimum = 0.1;
// Residuals of this size, root mean square in deviations, count as matched.
constexpr double kMatched = 3;

// A start that costs this many times a match already found will not end below it.
constexpr double kHopeless = 10;

// Levels of MatchingObjective::smooth_unknowns(): the last is all.
constexpr std::array<double, 3> kLevels = {0.1, 0.01, 1e-3};
constexpr double kLevelTolerance = 1e-2;  // of those that are not the last

// Two minima are one where no landmark is ever further apart than this part of the diameter.
constexpr double kSamePath = 1e-3;

using Evaluation = MatchingObjective::Evaluation;

class Searches {
 public:
  Searches(const MatchingObjective& objective, const MinimiseOptions& options)
      : objective_(objective), problem_(objective.problem()), options_(options) {
    std::optional<Evaluation> rest = objective.evaluate(VectorXd::Zero(objective.unknowns()));
    if (!rest)
      throw InputError(problem_.system.noise->traits().compensated
                           ? "landmarks at rest have no path: either the noise is too strong for the time step (use "
                             "more --steps or a smaller amplitude), or the distances to the target, divided by sigma, "
                             "leave the range of numbers"
                           : "the distances to the target, divided by sigma, leave the range of numbers");
    rest_ = std::move(*rest);
  }

  MinimiseSummary run() {
    for (const Start& start : starts()) search(start);
    // Shapes that stay apart: they may have to turn round each other.
    if (!matched() && options_.starts == 1 && problem_.source.rows() > 1 && problem_.data->landmarks() != nullptr)
      for (const int way : {1, 2}) search(start_by(way));
    if (!matched() && dense()) found_.push_back(continuation());
    if (found_.empty()) found_.push_back(solve(rest_, options_));
    std::stable_sort(found_.begin(), found_.end(), better);
    std::vector<Minimum> minima = distinct();
    MinimiseSummary best = std::move(found_.front());
    best.minima = std::move(minima);
    best.iterations = iterations_;
    best.evaluations = evaluations_;
    return best;
  }

 private:
  bool fits_noise() const { return objective_.unknowns() > objective_.basis().unknowns(); }

  // Without the rough momenta of a flow without noise: what they do the noise does at less cost.
  VectorXd smoothed(const VectorXd& z) const {
    const std::vector<Index> smooth = objective_.smooth_unknowns(kLevels.front());
    VectorXd part = VectorXd::Zero(z.size());
    part(smooth) = z(smooth);
    return part;
  }

  bool dense() const {
    if (options_.solver != Solver::kAuto) return options_.solver == Solver::kGaussNewton;
    return fits_noise() ? problem_.source.size() <= kMostRows : objective_.unknowns() <= kMostColumns;
  }

  // Where searches begin: flows without noise, each by another way; and, where there is noise to be fitted, the
  // landmarks at rest but for the noise.
  std::vector<Start> starts() {
    if (problem_.data->landmarks() == nullptr) return {};
    std::vector<Start> starts;
    for (int way = 0; way < options_.starts; ++way) starts.push_back(start_by(way));
    if (problem_.realisations.empty() && problem_.system.noise->traits().moves_positions)
      starts.push_back(start_by_noise(objective_));
    return starts;
  }

  // Where there are many landmarks: what a search of the same kind finds for a few of them.
  Start start_by(int way) {
    const std::vector<Index> few = representatives(objective_);
    if (few.empty()) return flow_start_by(way);
    const MatchingObjective objective(thinned(problem_, few));
    Searches searches(objective, options_);
    const Start start = searches.flow_start_by(way);
    searches.search(start);
    iterations_ += searches.iterations_;
    evaluations_ += searches.evaluations_;
    Points momenta = Points::Zero(problem_.source.rows(), problem_.source.cols());
    momenta(Eigen::all, few) = objective.momenta(searches.found_.back().solution.z);
    return {start.name, without_noise(objective_, momenta)};
  }

  Start flow_start_by(int way) {
    Start start = start_by_flow(objective_, way, options_.seed);
    iterations_ += start.iterations;
    return start;
  }

  MinimiseSummary solve(Evaluation start, const MinimiseOptions& options, const Restriction& restriction = {}) {
    MinimiseSummary summary = dense() ? minimise_gauss_newton(objective_, options, std::move(start), restriction)
                                      : minimise_lbfgs(objective_, options, std::move(start));
    iterations_ += summary.iterations;
    evaluations_ += summary.evaluations;
    return summary;
  }

  // The smooth momenta first, then with ever rougher ones. Where the time step does not resolve these they stay as far
  // as they came, and the smooth ones are solved for once more.
  MinimiseSummary solve_by_levels(Evaluation start) {
    const std::vector<Index> every = objective_.smooth_unknowns(kLevels.back());
    if (!dense() || every.empty()) {
      MinimiseSummary summary = solve(std::move(start), options_);
      summary.resolved = objective_.unknowns();
      return summary;
    }
    MinimiseOptions rough = options_;
    rough.gradient_tolerance = std::max(kLevelTolerance, options_.gradient_tolerance);
    std::vector<Index> smooth;  // of the first level
    std::vector<Index> reached;
    MinimiseSummary best;
    for (const double part : kLevels) {
      std::vector<Index> unknowns = objective_.smooth_unknowns(part);
      const bool last = unknowns.size() == every.size();
      if (unknowns.empty() || unknowns.size() == reached.size()) continue;
      const bool first = smooth.empty();
      MinimiseSummary summary = solve(first ? start : best.solution, last ? options_ : rough, {1, unknowns, !first});
      if (first) smooth = unknowns;
      if (!summary.converged && !first)
        return solve_smooth(smooth, std::move(summary.solution), std::move(best.solution));
      reached = std::move(unknowns);
      best = std::move(summary);
      if (!best.converged || last) break;
    }
    best.resolved = std::ssize(reached);
    return best;
  }

  MinimiseSummary solve_smooth(const std::vector<Index>& smooth, Evaluation rough, Evaluation smoother) {
    MinimiseSummary summary = solve(std::move(rough), options_, {1, smooth, true});
    if (!summary.converged) summary = solve(std::move(smoother), options_, {1, smooth, false});
    summary.resolved = std::ssize(smooth);
    return summary;
  }

  // Whether a search ended in a minimum whose residuals are as large as the errors of the data.
  bool matched() const {
    const double most = 0.5 * kMatched * kMatched * static_cast<double>(problem_.source.size());
    return std::any_of(found_.begin(), found_.end(), [&](const MinimiseSummary& summary) {
      return summary.solution.cost.data <= most && (summary.relative_gradient < kFarFromMinimum || fits_noise());
    });
  }

  void search(const Start& start) {
    std::optional<Evaluation> at = objective_.evaluate(fits_noise() ? smoothed(start.z) : start.z);
    // The path of the start, or that of landmarks at rest where this costs less.
    const bool of_use = at && at->cost.total() < rest_.cost.total();
    if (is_hopeless(of_use ? *at : rest_)) return;
    found_.push_back(solve_by_levels(of_use ? std::move(*at) : rest_));
    found_.back().start = of_use ? start.name : "rest";
  }

  bool is_hopeless(const Evaluation& start) const {
    if (options_.starts > 1 || !matched()) return false;
    const MinimiseSummary& best = *std::min_element(found_.begin(), found_.end(), better);
    return best.converged && start.cost.total() > kHopeless * best.solution.cost.total();
  }

  // Where one search did not converge its cost may be the time step's error: 1 % less does not recommend it.
  static bool better(const MinimiseSummary& a, const MinimiseSummary& b) {
    const double of_a = (a.converged ? 0.99 : 1) * a.solution.cost.total();
    const double of_b = (b.converged ? 0.99 : 1) * b.solution.cost.total();
    return of_a < of_b;
  }

  // From rest, with the data held ever more firmly, and moving what is smooth for data held so firmly.
  MinimiseSummary continuation() {
    MinimiseOptions stage = options_;
    stage.gradient_tolerance = std::max(kStageTolerance, options_.gradient_tolerance);
    stage.max_iterations = std::min(kStageIterations, options_.max_iterations);
    const auto count = static_cast<double>(problem_.source.size());
    double softness = kFirstPart * std::sqrt(2 * rest_.cost.data / count);
    Evaluation at = rest_;
    int stages = 0;
    for (; softness > 1; softness /= kSoftnessRatio, ++stages) {
      const std::vector<Eigen::Index> smooth = objective_.smooth_unknowns(kLevels.front() * softness * softness);
      if (!smooth.empty()) at = solve(std::move(at), stage, {softness, smooth}).solution;
    }
    MinimiseSummary summary = solve_by_levels(std::move(at));
    summary.start = "rest";
    summary.continuation_stages = stages;
    return summary;
  }

  double apart(const Evaluation& a, const Evaluation& b) const {
    double largest = 0;
    for (std::size_t k = 0; k < a.path().states.size(); ++k)
      largest = std::max(largest, (a.path().states[k].q - b.path().states[k].q).colwise().norm().maxCoeff());
    return largest;
  }

  std::vector<Minimum> distinct() const {
    std::vector<Minimum> minima;
    std::vector<const Evaluation*> kept;
    const double same = kSamePath * diameter(problem_.source);
    for (const MinimiseSummary& summary : found_) {
      std::size_t i = 0;
      while (i < kept.size() && apart(*kept[i], summary.solution) > same) ++i;
      if (i < kept.size()) {
        ++minima[i].found;
      } else {
        kept.push_back(&summary.solution);
        minima.push_back({summary.solution.cost, summary.converged, 1});
      }
    }
    return minima;
  }

  const MatchingObjective& objective_;
  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  Evaluation rest_;
  std::vector<MinimiseSummary> found_;
  int iterations_ = 0;
  int evaluations_ = 1;
};

}  // namespace

Solver parse_solver(std::string_view name) {
  std::string valid;
  for (const auto& [known, solver] : kSolverNames) {
    if (known == name) return solver;
    valid += (valid.empty() ? "" : ", ") + std::string(known);
  }
  throw InputError("unknown solver '" + std::string(name) + "'; valid: " + valid);
}

std::string solver_name(Solver solver) {
  for (const auto& [name, known] : kSolverNames)
    if (known == solver) return std::string(name);
  return {};
}

double relative_gradient(const VectorXd& z, const VectorXd& gradient) {
  const double size = gradient.norm();
  const double scale = z.norm() + (gradient - z).norm();
  // Identical shapes: z = 0, r = 0, and nothing to do.
  return scale > 1e-12 ? size / scale : 0;
}

MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options) {
  return Searches(objective, options).run();
}

}  // namespace pulson
