// Newton's method on the action of paths. The unknowns are paths, DiscretePath, rather than p0: nothing is shot, so
// nothing amplifies, and every path has a cost. Each iteration
// 1. solves the Newton equations by conjugate gradients, preconditioned by the Gauss–Newton model, within a trust
//    region (Steihaug 1983; Nocedal & Wright, Numerical Optimization, 2006, ch. 4 and 7), which also finds directions
//    of negative curvature and follows them;
// 2. takes the step in the fields of the path rather than in its nodes, so that what moves together keeps doing so, and
//    with feedback, since bent flows amplify what the model leaves out: where landmarks leave the nodes that the model
//    has, the later fields answer (as in differential dynamic programming, Jacobson & Mayne 1970);
// 3. projects: of all fields that move the landmarks along the new path those of least energy.
// Where the gradient vanishes, negative curvature is looked for and followed: symmetric paths are often saddles.
// The data are held softly at first, σ being s times as large, and ever more firmly.

#include "path_search.hpp"

#include <algorithm>
#include <cmath>

#include "noise_homotopy.hpp"
#include "path_curvature.hpp"
#include "path_equations.hpp"
#include "path_model.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/random/brownian.hpp"
#include "representatives.hpp"
#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// σ is inflated at first: by this part of the root mean square residual over σ; then the inflation is divided.
constexpr double kFirstPart = 0.2;
constexpr double kInflationRatio = 4;
constexpr double kStageGradient = 0.1;  // relative, where it comes down
// Below this part of the cost its differences are round-off.
constexpr double kRoundOff = 1e-14;
// A trust region's usual numbers: what part of the gain foreseen a step must have to be taken, for the region to
// shrink, and for it to grow.
constexpr double kLeastGain = 1e-3, kPoorGain = 0.25, kGoodGain = 0.75;
constexpr double kShrink = 0.25, kGrow = 2.5;
constexpr double kLeastRadius = 1e-10;  // of that of the full step
constexpr int kMostProducts = 40;
// Iterations below the tolerance: Newton's squares the gradient, so that round-off comes first; where the data have but
// a Gauss–Newton model, these.
constexpr int kMostPolish = 10;
constexpr const char* kFlat = "the gradient vanishes";
constexpr const char* kCostSettled = "the cost has settled";
// Where landmarks on a line change their order, J bends wherever two of them meet in the middle of a step, and the
// gradient hardly vanishes: then the search ends where so many iterations lower J by less than the tolerance.
constexpr std::size_t kSettlingIterations = 8;
// How far the start is disturbed, in parts of the diameter. Symmetric paths may end at saddles, which are left, but
// also where no step of the midpoint rule has a root any more: two discs that change places without noise.
constexpr double kDisturbance = 1e-3;
// Saddles that are left, one after the other.
constexpr int kMostSaddles = 5;

class PathSearch {
 public:
  PathSearch(const MatchingProblem& problem, const MinimiseOptions& options)
      : problem_(problem),
        options_(options),
        system_(problem.system, problem.lambda),
        noise_(noise_cometric(*problem.system.noise, problem.source)) {}

  PathSolution run(const StepFields* start, Finish finish) {
    finish_ = finish;
    at_rest_ = problem_.data->value(problem_.source);
    first_inflation_ = softest();
    if (start == nullptr || !begin_in(*start)) {
      begin_at_rest();
      if (at_rest_ < kNegligibleCost) return equal_shapes();
      sigma_inflation_ = first_inflation_;
      disturb();
    } else if (problem_.data->value(path_.end()) < kNegligibleCost && path_.energy == 0) {
      return equal_shapes();
    }
    return search();
  }

  PathSolution run(DiscretePath path, Finish finish) {
    finish_ = finish;
    at_rest_ = problem_.data->value(problem_.source);
    first_inflation_ = softest();
    path_ = std::move(path);
    return search();
  }

 private:
  double softest() const {
    return std::max(1.0, kFirstPart * std::sqrt(2 * at_rest_ / static_cast<double>(problem_.source.cols())));
  }

  PathSolution equal_shapes() {
    relative_ = 0;
    stop(true, reason_at_rest(problem_));
    return solution();
  }

  PathSolution search() {
    while (!finished()) {
      const bool may_be_saddle = is_flat() && flat_ == 1 && saddles_ < kMostSaddles && finish_ != Finish::kShootable;
      if (!(may_be_saddle && leave_saddle()) && !advance()) break;
      ++iterations_;
    }
    return solution();
  }

  double weight() const { return 1 / (problem_.lambda * sigma_inflation_ * sigma_inflation_); }
  double cost(const DiscretePath& path) const { return path.energy + weight() * problem_.data->value(path.end()); }

  std::optional<DiscretePath> follow(const StepFields& fields, const std::vector<Points>& guess) {
    ++evaluations_;
    auto nodes = carried(problem_.system, problem_.grid, problem_.source, fields, guess);
    if (!nodes) return std::nullopt;
    return measured(std::move(*nodes));
  }

  // The path through nodes, if its cost is a number.
  std::optional<DiscretePath> measured(std::vector<Points> nodes) const {
    std::optional<DiscretePath> path = along(system_, problem_.grid, std::move(nodes), &noise_, path_.keeps_velocities);
    if (path && !std::isfinite(cost(*path))) return std::nullopt;
    return path;
  }

  std::vector<Points> rest() const {
    std::vector<Points> nodes(static_cast<std::size_t>(problem_.grid.steps) + 1, problem_.source);
    return nodes;
  }

  void begin_at_rest() {
    std::optional<DiscretePath> path = measured(rest());
    if (!path) throw NumericalError("the distances to the target, divided by sigma, leave the range of numbers");
    path_ = std::move(*path);
  }

  // At the path of `start`, if there is one that is better than rest: whether it is.
  bool begin_in(const StepFields& start) {
    std::optional<DiscretePath> path = follow(start, rest());
    if (!path || cost(*path) >= weight() * at_rest_) return false;
    path_ = std::move(*path);
    return true;
  }

  void disturb() {
    const Points& q0 = problem_.source;
    StepFields fields = fields_of(system_, path_);
    Points p =
        brownian_increments(options_.seed, 0, static_cast<int>(q0.size()), {1, 1}).reshaped(q0.rows(), q0.cols());
    const double fastest = problem_.system.kernel.apply(q0, q0, p).colwise().norm().maxCoeff();
    p *= kDisturbance * diameter(q0) / (problem_.grid.time * fastest);
    for (Points& momenta : fields.momenta) momenta = p;
    fields.own.clear();
    if (std::optional<DiscretePath> path = follow(fields, path_.nodes)) path_ = std::move(*path);
  }

  bool is_flat() const { return sigma_inflation_ == 1 && relative_ <= options_.gradient_tolerance; }

  // For shots, once it was looked for negative curvature.
  bool is_enough() const {
    return relative_ <= kShootableGradient * options_.gradient_tolerance && finish_ != Finish::kRoundOff &&
           (finish_ == Finish::kShootable || flat_ > 1);
  }

  void stop(bool converged, std::string reason) {
    converged_ = converged;
    reason_ = std::move(reason);
  }

  // Linearises where the path is, and holds the data more firmly where that is due.
  bool finished() {
    while (true) {
      model_.emplace(system_, *problem_.data, path_, weight());
      gradient_ = model_->gradient();
      steepest_ = model_->solve(gradient_);
      const double slope = pairing(gradient_, steepest_);
      slope_ = std::max(0.0, slope);
      const double total = cost(path_);
      relative_ = total > 0 ? std::sqrt(slope_ / (2 * total)) : 0;
      // By round-off the model is not positive, or numbers have left their range.
      if (!(slope >= 0) || !std::isfinite(slope) || !std::isfinite(total)) relative_ = 1;
      if (options_.on_iteration) options_.on_iteration(iterations_, problem_.lambda * total, relative_);
      if (options_.is_interrupted()) {
        stop(false, kInterrupted);
        return true;
      }
      if (sigma_inflation_ > 1 && relative_ < kStageGradient) {
        sigma_inflation_ = std::max(1.0, sigma_inflation_ / kInflationRatio);
        radius_ = -1;
        continue;
      }
      if (problem_.lambda * total < kNegligibleCost)
        stop(true, "the cost vanishes");
      else if (has_settled(total))
        stop(true, kCostSettled);
      else if (is_flat() && (++flat_ > kMostPolish || is_enough()))
        stop(true, kFlat);
      else if (iterations_ >= options_.max_iterations)
        stop(is_flat(), "the limit of iterations was reached");
      if (radius_ < 0) radius_ = std::sqrt(slope_);
      return !reason_.empty();
    }
  }

  bool has_settled(double total) {
    if (!path_.keeps_velocities || is_flat() || sigma_inflation_ > 1) return false;
    costs_.push_back(total);
    return costs_.size() > kSettlingIterations &&
           costs_[costs_.size() - 1 - kSettlingIterations] - total < options_.gradient_tolerance * total;
  }

  struct Step {
    PathDirection direction;
    double gain = 0;           ///< foreseen
    bool at_boundary = false;  ///< of the trust region
  };

  // Conjugate gradients for the Newton equations, in the norm of the model.
  Step newton_step() const {
    const auto nodes = gradient_.size();
    const Points none = Points::Zero(problem_.source.rows(), problem_.source.cols());
    Step step{{std::vector<Points>(nodes, none), std::vector<Points>(nodes - 1, none)}};
    NodeCovector residual = gradient_;
    NodeCovector product(nodes, none);  // of the Hessian and the step
    PathDirection along = steepest_;
    along.scale(-1);
    double squared = slope_;  // of the residual
    double step_step = 0, step_along = 0, along_along = slope_;
    const double enough = std::min(0.3, std::sqrt(relative_)) * std::sqrt(slope_);
    for (int i = 0; i < kMostProducts; ++i) {
      const NodeCovector h = model_->hessian(along);
      const double curvature = pairing(h, along);
      const double length = squared / curvature;
      const double next = step_step + 2 * length * step_along + length * length * along_along;
      step.at_boundary = curvature <= 0 || next >= radius_ * radius_;
      const double taken =
          step.at_boundary
              ? (-step_along + std::sqrt(step_along * step_along + along_along * (radius_ * radius_ - step_step))) /
                    along_along
              : length;
      step.direction.add(taken, along);
      for (std::size_t j = 0; j < nodes; ++j) product[j] += taken * h[j];
      if (step.at_boundary) break;
      for (std::size_t j = 0; j < nodes; ++j) residual[j] += length * h[j];
      const PathDirection solved = model_->solve(residual);
      const double new_squared = pairing(residual, solved);
      if (!(new_squared > enough * enough)) break;
      const double ratio = new_squared / squared;
      step_along = ratio * (step_along + length * along_along);
      along_along = new_squared + ratio * ratio * along_along;
      step_step = next;
      squared = new_squared;
      along.scale(ratio);
      along.add(-1, solved);
    }
    step.gain = -(pairing(gradient_, step.direction) + 0.5 * pairing(product, step.direction));
    return step;
  }

  // The step is taken with feedback: where landmarks are carried off the nodes that the model has, by so much that it
  // would cost more than `tolerance`, the rest of the step is changed to what is best from there.
  std::optional<DiscretePath> moved(PathDirection direction, double tolerance) {
    ++evaluations_;
    if (path_.keeps_velocities) return moved_nodes(direction);
    StepFields fields = fields_of(system_, path_);
    std::vector<Points> nodes{path_.nodes.front()};
    for (std::size_t k = 0; k < fields.momenta.size(); ++k) {
      const Points deviation = nodes[k] - path_.nodes[k] - direction.nodes[k];
      if (model_->misfit(k, deviation) > tolerance) direction.add(1, model_->feedback(k, deviation));
      const PhaseState change{path_.middles[k].q, direction.momenta[k]};
      fields.momenta[k] += change.p;
      fields.controls[k] += system_.controls(change);
      fields.own[k] += own_velocities(system_, change);
      const Points guess = path_.nodes[k + 1] - path_.nodes[k] + direction.nodes[k + 1] - direction.nodes[k];
      std::optional<Points> next = carried_by_step(problem_.system, problem_.grid, fields, k, nodes[k], guess);
      if (!next) return std::nullopt;
      nodes.push_back(std::move(*next));
    }
    return measured(std::move(nodes));
  }

  std::optional<DiscretePath> moved_nodes(const PathDirection& direction) const {
    std::vector<Points> nodes = path_.nodes;
    for (std::size_t k = 0; k < nodes.size(); ++k) nodes[k] += direction.nodes[k];
    return measured(std::move(nodes));
  }

  // The gradient vanishes at saddles, too: whether this was one, and is left. What follows may be far, and firm data
  // leave but a narrow bent valley: they are held softly again.
  bool leave_saddle() {
    Curvature curvature = least_curvature(*model_, problem_.source, problem_.grid.steps, options_.seed);
    if (!curvature.is_negative()) return false;
    if (pairing(gradient_, curvature.direction) > 0) curvature.direction.scale(-1);
    const double before = cost(path_);
    for (double length = std::sqrt(2 * before);; length *= kShrink) {
      PathDirection direction = curvature.direction;
      direction.scale(length);
      const double gain = -pairing(gradient_, direction) - 0.5 * curvature.least * length * length;
      if (!(gain > kRoundOff * before)) return false;
      std::optional<DiscretePath> trial = moved(std::move(direction), kPoorGain * gain);
      if (!trial || before - cost(*trial) < kPoorGain * gain) continue;
      path_ = std::move(*trial);
      sigma_inflation_ = first_inflation_;
      radius_ = -1;
      ++saddles_;
      flat_ = 0;
      return true;
    }
  }

  // Newton's last step, which costs no longer show: near a minimum it squares what is left of the gradient, so that the
  // path obeys the midpoint rule about as well as it can.
  void refine(const Step& step) {
    if (std::optional<DiscretePath> trial = moved(step.direction, kRoundOff * cost(path_));
        trial && cost(*trial) <= cost(path_) * (1 + kRoundOff))
      path_ = std::move(*trial);
  }

  bool advance() {
    const double full = std::sqrt(slope_);
    const double before = cost(path_);
    while (radius_ > kLeastRadius * full) {
      const Step step = newton_step();
      if (!(step.gain > kRoundOff * before)) {
        refine(step);
        break;
      }
      std::optional<DiscretePath> trial = moved(step.direction, kPoorGain * step.gain);
      const double part = trial ? (before - cost(*trial)) / step.gain : -1;
      if (part < kPoorGain)
        radius_ = kShrink * std::min(radius_, full);
      else if (part > kGoodGain && step.at_boundary)
        radius_ *= kGrow;
      if (part > kLeastGain) {
        path_ = std::move(*trial);
        return true;
      }
    }
    if (is_flat())
      stop(true, kFlat);
    else if (path_.keeps_velocities && sigma_inflation_ == 1)
      stop(true, kCostSettled);
    else
      stop(false, "no step lowers the cost by more than round-off");
    return false;
  }

  PathSolution solution() {
    PathSolution solution;
    solution.path = std::move(path_);
    describe(system_, *problem_.data, solution);
    solution.converged = converged_;
    solution.reason = reason_;
    solution.iterations = iterations_;
    solution.evaluations = evaluations_;
    solution.relative_gradient = relative_;
    return solution;
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  Finish finish_ = Finish::kRoundOff;
  EffectiveHamiltonian system_;
  NoiseCometric noise_;  ///< at the source
  DiscretePath path_;
  double sigma_inflation_ = 1;
  double first_inflation_ = 1;
  double at_rest_ = 0;  ///< the data's cost of the source
  double radius_ = -1;  ///< of the trust region, in the norm of the model; below 0: that of the full step
  double relative_ = 1;
  double slope_ = 0;
  std::optional<PathModel> model_;
  NodeCovector gradient_;
  PathDirection steepest_;
  std::vector<double> costs_;  ///< of iterations that may settle
  int iterations_ = 0;
  int saddles_ = 0;  ///< left
  int flat_ = 0;     ///< iterations within the tolerance
  int evaluations_ = 0;
  bool converged_ = false;
  std::string reason_;
};

}  // namespace

void describe(const EffectiveHamiltonian& system, const DataTerm& data, PathSolution& solution) {
  const DiscretePath& path = solution.path;
  const double dt = path.grid.dt();
  double action = 0;
  solution.increments.resize(system.controls(path.middles.front()).size(), path.grid.steps);
  for (std::size_t k = 0; k < path.middles.size(); ++k) {
    const PhaseState& middle = path.middles[k];
    const Points force = system.force(middle);
    solution.states.push_back({path.nodes[k], middle.p + 0.5 * dt * force});
    if (k + 1 == path.middles.size()) solution.states.push_back({path.end(), middle.p - 0.5 * dt * force});
    const Eigen::VectorXd u = system.controls(middle);
    solution.increments.col(static_cast<Index>(k)) = u * dt;
    action += 0.5 * dt * u.squaredNorm();
  }
  solution.momenta = solution.states.front().p;
  solution.cost = {system.lambda() * path.energy - action, action, data.value(path.end())};
  solution.fields = fields_of(system, path);
}

std::string reason_at_rest(const MatchingProblem& problem) {
  constexpr double kRounding = 1e-9;  // of the diameter: what files in ten digits leave
  const LandmarkTerm* data = problem.data->landmarks();
  const bool is_equal = data != nullptr && problem.sigma * data->residual(problem.source).lpNorm<Eigen::Infinity>() <=
                                               kRounding * diameter(problem.source);
  return is_equal ? "the shapes are equal" : "the shapes do not differ beyond sigma";
}

PathSolution continue_path(const MatchingProblem& problem, const MinimiseOptions& options, DiscretePath path,
                           Finish finish) {
  if (path.cometrics.empty()) return continue_path_equations(problem, options, std::move(path));
  return PathSearch(problem, options).run(std::move(path), finish);
}

namespace {

PathSolution search_from(const MatchingProblem& problem, const MinimiseOptions& options, const StepFields& start,
                         Finish finish) {
  // The equations of the path take matrices; along a line the search below does without, by sweeps.
  if (!sweeps_along_line(problem.system.kernel, noise_cometric(*problem.system.noise, problem.source), problem.source))
    if (std::optional<PathSolution> found = solve_path_equations(problem, options, start)) return std::move(*found);
  return PathSearch(problem, options).run(&start, finish);
}

}  // namespace

PathSolution search_paths(const MatchingProblem& problem, const MinimiseOptions& options, const StepFields* start,
                          Finish finish) {
  check(problem);
  const Points& q0 = problem.source;
  if (!problem.system.noise->traits().moves_positions()) require_distinct(q0);
  if (start == nullptr && searched_by_sweeps(problem.system.kernel, noise_cometric(*problem.system.noise, q0), q0) &&
      problem.data->value(q0) >= kNegligibleCost)
    return search_from_much_noise(problem, options, finish);
  if (q0.cols() <= 2 * kFewLandmarks || !can_be_subsampled(problem))
    return PathSearch(problem, options).run(start, finish);
  if (start != nullptr) return search_from(problem, options, *start, finish);
  const MatchingProblem few = subsampled(without_own_noise(problem), representatives(problem, kFewLandmarks));
  PathSolution coarse = PathSearch(few, options).run(nullptr, finish);
  const int channels = problem.system.noise->channels(static_cast<int>(q0.rows()), static_cast<int>(q0.cols()));
  coarse.fields.controls.assign(coarse.fields.momenta.size(), Eigen::VectorXd::Zero(channels));
  coarse.fields.own.clear();
  PathSolution solution = search_from(problem, options, coarse.fields, finish);
  solution.iterations += coarse.iterations;
  solution.evaluations += coarse.evaluations;
  return solution;
}

}  // namespace pulson::matching
