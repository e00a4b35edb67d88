// Newton's method for the equations of a path that is best, in the space of its positions and momenta: where momenta
// are unknowns beside positions no cometric is inverted, and all that is needed are sums over pairs. It begins near the
// path, at the fields of a search for few landmarks; each iteration solves its linear equations by GMRES (Saad &
// Schultz 1986), preconditioned by the PassiveModel, to an accuracy that rises with what is reached (Eisenstat & Walker
// 1996), and is shortened until the next would be shorter (Deuflhard, Newton Methods for Nonlinear Problems, 2004).

#include "path_equations.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "matching/momentum_basis.hpp"
#include "passive_model.hpp"
#include "path_model.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "representatives.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What the carriers leave over of the variance of all landmarks together, in parts of what each has by itself.
constexpr double kLeftOver = 0.1;
// Of carriers, beyond which their matrix costs more than it saves.
constexpr Index kMostCarrierCoordinates = 1200;
// Where more are needed, the model is too far from what it stands for.
constexpr int kMostKrylovSteps = 30;
constexpr double kLinearAccuracy = 0.03;  // of Newton's steps, relative
constexpr double kShortest = 1.0 / 16;    // part of a step
constexpr int kMostNewtonSteps = 30;
// The relative gradient where the equations hold: round-off comes soon after.
constexpr double kSolved = 1e-10;

// The variance of the coordinates of a landmark by its own noise alone; 0 without noise.
double own_variance(const MatchingProblem& problem) {
  const NoiseCometric noise = noise_cometric(*problem.system.noise, problem.source);
  return noise.matrix.nonZeros() > 0 ? noise.matrix.coeff(0, 0) * problem.grid.time : 0;
}

class PathEquations {
 public:
  PathEquations(const MatchingProblem& problem, const MinimiseOptions& options)
      : problem_(problem),
        options_(options),
        data_(*problem.data->landmarks()),
        system_(problem.system, problem.lambda),
        variance_(own_variance(problem)),
        carriers_(find_carriers()) {}

  std::optional<PathSolution> run(const StepFields& start) {
    if (!begin_in(start)) return std::nullopt;
    return search(kSolved);
  }

  std::optional<PathSolution> run(const DiscretePath& path) {
    path_ = {path.grid, path.nodes, {}};
    for (const PhaseState& middle : path.middles) path_.momenta.push_back(middle.p);
    linearise();
    return search(std::max(kSolved, kShootableGradient * options_.gradient_tolerance));
  }

 private:
  std::optional<PathSolution> search(double tolerance) {
    while (true) {
      const double total = cost();
      relative_ = std::sqrt(size_ / (2 * total));
      if (options_.on_iteration) options_.on_iteration(iterations_, problem_.lambda * total, relative_);
      if (relative_ <= tolerance) return solution();
      if (options_.is_interrupted()) return std::nullopt;
      if (iterations_ == std::min(kMostNewtonSteps, options_.max_iterations) || !advance()) return std::nullopt;
      ++iterations_;
    }
  }

  std::vector<Index> find_carriers() const {
    const double known = problem_.sigma * problem_.sigma + variance_;
    return pivoted_landmarks(problem_.system.kernel, problem_.source,
                             kLeftOver * problem_.lambda * known / std::pow(problem_.grid.time, 2),
                             std::min(problem_.source.cols(), kMostCarrierCoordinates / problem_.source.rows()));
  }

  double own() const {
    return problem_.lambda * variance_ / problem_.grid.time + regularisation(problem_.system.kernel);
  }
  double weight() const { return 1 / problem_.lambda; }

  double energy() const {
    double sum = 0;
    for (std::size_t k = 0; k < path_.momenta.size(); ++k)
      sum += 0.5 * path_.momenta[k].cwiseProduct(path_.nodes[k + 1] - path_.nodes[k]).sum();
    return sum;
  }

  double cost() const { return energy() + weight() * data_.value(path_.nodes.back()); }

  // Momenta of least energy that move landmarks along the fields' path, with what is best for the data.
  bool begin_in(const StepFields& start) {
    const std::vector<Points> rest(static_cast<std::size_t>(problem_.grid.steps) + 1, problem_.source);
    auto nodes = carried(problem_.system, problem_.grid, problem_.source, start, rest);
    if (!nodes) return false;
    const Points none = Points::Zero(problem_.source.rows(), problem_.source.cols());
    path_ = {problem_.grid, std::move(*nodes), std::vector<Points>(start.momenta.size(), none)};
    std::vector<MatrixXd> gradients(start.momenta.size());
    PathResidual wrong{{}, std::vector<Points>(path_.nodes.size(), none)};
    for (std::size_t k = 0; k < start.momenta.size(); ++k) {
      problem_.system.kernel.apply_with_jacobian(path_.middle(k), start.centres[k], start.momenta[k], gradients[k]);
      wrong.velocities.emplace_back((path_.nodes[k] - path_.nodes[k + 1]) / problem_.grid.dt());
    }
    wrong.momenta.back() = -weight() * data_.gradient(path_.nodes.back());
    const PassiveModel model(system_, data_, path_, std::move(gradients), own(), weight(), carriers_);
    // Of the nodes' change, too, which the momenta make.
    add(path_, 1, model.solve(wrong));
    linearise();
    return true;
  }

  static void add(CanonicalPath& path, double factor, const PathVariation& change) {
    for (std::size_t j = 0; j < path.nodes.size(); ++j) path.nodes[j] += factor * change.nodes[j];
    for (std::size_t k = 0; k < path.momenta.size(); ++k) path.momenta[k] += factor * change.momenta[k];
  }

  // What does not obey the midpoint rule, negated.
  PathResidual wrong(const CanonicalPath& path) const {
    const auto steps = path.momenta.size();
    const double dt = path.grid.dt();
    PathResidual wrong{std::vector<Points>(steps), {}};
    std::vector<Points> forces(steps);
    parallel_for(path.grid.steps, [&](int step) {
      const auto k = static_cast<std::size_t>(step);
      const Flow flow = system_.flow({path.middle(k), path.momenta[k]});
      wrong.velocities[k] = flow.velocity + regularisation(problem_.system.kernel) * path.momenta[k] -
                            (path.nodes[k + 1] - path.nodes[k]) / dt;
      forces[k] = flow.force;
    });
    wrong.momenta = node_rows(path.momenta, forces, dt);
    wrong.momenta.back() += weight() * data_.gradient(path.nodes.back());
    for (Points& row : wrong.momenta) row = -row;
    return wrong;
  }

  // The derivative of what does not obey the midpoint rule.
  PathResidual product(const PathVariation& change) const {
    const auto steps = path_.momenta.size();
    const double dt = path_.grid.dt();
    PathResidual product{std::vector<Points>(steps), {}};
    std::vector<Points> forces(steps);
    parallel_for(path_.grid.steps, [&](int step) {
      const auto k = static_cast<std::size_t>(step);
      const Points dq = 0.5 * (change.nodes[k] + change.nodes[k + 1]);
      const Flow flow = system_.flow_change({path_.middle(k), path_.momenta[k]}, {dq, change.momenta[k]});
      product.velocities[k] = (change.nodes[k + 1] - change.nodes[k]) / dt - flow.velocity -
                              regularisation(problem_.system.kernel) * change.momenta[k];
      forces[k] = flow.force;
    });
    product.momenta = node_rows(change.momenta, forces, dt);
    product.momenta.back() += model_->pull(change.nodes.back());
    return product;
  }

  void linearise() {
    std::vector<MatrixXd> gradients(path_.momenta.size());
    parallel_for(path_.grid.steps, [&](int step) {
      const auto k = static_cast<std::size_t>(step);
      const Points middle = path_.middle(k);
      problem_.system.kernel.apply_with_jacobian(middle, middle, path_.momenta[k], gradients[k]);
    });
    model_.emplace(system_, data_, path_, std::move(gradients), own(), weight(), carriers_);
    first_ = model_->solve(wrong(path_));
    size_ = size(first_);
  }

  // In the norm of the model: ∫δp·Aδp dt + w|R δq(T)|².
  double size(const PathVariation& change) const {
    double sum = model_->pull(change.nodes.back()).cwiseProduct(change.nodes.back()).sum();
    for (std::size_t k = 0; k < change.momenta.size(); ++k)
      sum += problem_.grid.dt() * change.momenta[k].cwiseProduct(change.velocities[k]).sum();
    return sum;
  }

  // A vector of a change; positions and momenta count alike where they are as large as in the first.
  VectorXd flat(const PathVariation& change) const {
    const Index part = problem_.source.size();
    const auto steps = static_cast<Index>(change.momenta.size());
    VectorXd all(2 * steps * part);
    for (Index k = 0; k < steps; ++k) {
      const auto at = static_cast<std::size_t>(k);
      all.segment(k * part, part) = change.nodes[at + 1].reshaped() / nodes_scale_;
      all.segment((steps + k) * part, part) = change.momenta[at].reshaped() / momenta_scale_;
    }
    return all;
  }

  PathVariation unflat(const VectorXd& all) const {
    const Index part = problem_.source.size(), d = problem_.source.rows();
    const auto steps = static_cast<Index>(path_.momenta.size());
    PathVariation change{{Points::Zero(d, problem_.source.cols())}, {}, {}};
    for (Index k = 0; k < steps; ++k) {
      change.nodes.emplace_back(nodes_scale_ * all.segment(k * part, part).reshaped(d, part / d));
      change.momenta.emplace_back(momenta_scale_ * all.segment((steps + k) * part, part).reshaped(d, part / d));
    }
    return change;
  }

  // By GMRES; empty where the model is too far from what it stands for.
  std::optional<PathVariation> newton_step() {
    double of_nodes = 0, of_momenta = 0;
    for (const Points& q : first_.nodes) of_nodes += q.squaredNorm();
    for (const Points& p : first_.momenta) of_momenta += p.squaredNorm();
    nodes_scale_ = std::sqrt(of_nodes);
    momenta_scale_ = std::sqrt(of_momenta);
    const VectorXd first = flat(first_);
    const double norm = first.norm();
    std::vector<VectorXd> basis{first / norm};
    MatrixXd hessenberg = MatrixXd::Zero(kMostKrylovSteps + 1, kMostKrylovSteps);
    VectorXd answer;
    for (int m = 0; m < kMostKrylovSteps; ++m) {
      VectorXd next = flat(model_->solve(product(unflat(basis.back()))));
      for (int i = 0; i <= m; ++i) {
        hessenberg(i, m) = basis[static_cast<std::size_t>(i)].dot(next);
        next -= hessenberg(i, m) * basis[static_cast<std::size_t>(i)];
      }
      hessenberg(m + 1, m) = next.norm();
      const MatrixXd h = hessenberg.topLeftCorner(m + 2, m + 1);
      const VectorXd right = norm * VectorXd::Unit(m + 2, 0);
      answer = h.colPivHouseholderQr().solve(right);
      const double left = (right - h * answer).norm();
      if (left <= kLinearAccuracy * norm || hessenberg(m + 1, m) == 0) break;
      if (m + 1 == kMostKrylovSteps) return std::nullopt;
      basis.emplace_back(next / hessenberg(m + 1, m));
    }
    VectorXd all = VectorXd::Zero(first.size());
    for (Index i = 0; i < answer.size(); ++i) all += answer[i] * basis[static_cast<std::size_t>(i)];
    return unflat(all);
  }

  bool advance() {
    const double before = size_;
    const std::optional<PathVariation> step = newton_step();
    if (!step) return false;
    const CanonicalPath from = path_;
    for (double length = 1; length >= kShortest; length /= 2) {
      path_ = from;
      add(path_, length, *step);
      ++evaluations_;
      linearise();
      if (std::sqrt(size_) <= (1 - length / 4) * std::sqrt(before)) return true;
    }
    path_ = from;
    return false;
  }

  PathSolution solution() {
    PathSolution solution;
    solution.path = {path_.grid, path_.nodes, {}, {}, {}, energy()};
    for (std::size_t k = 0; k < path_.momenta.size(); ++k)
      solution.path.middles.push_back({path_.middle(k), path_.momenta[k]});
    describe(system_, data_, solution);
    solution.converged = true;
    solution.reason = "the gradient vanishes";
    solution.iterations = iterations_;
    solution.evaluations = evaluations_;
    solution.relative_gradient = relative_;
    return solution;
  }

  const MatchingProblem& problem_;
  const MinimiseOptions& options_;
  const LandmarkTerm& data_;
  EffectiveHamiltonian system_;
  double variance_;
  std::vector<Index> carriers_;
  CanonicalPath path_;
  std::optional<PassiveModel> model_;
  PathVariation first_;  ///< what the model makes of what does not obey the midpoint rule
  double size_ = 0;      ///< of it
  double nodes_scale_ = 1, momenta_scale_ = 1;
  double relative_ = 1;
  int iterations_ = 0;
  int evaluations_ = 0;
};

}  // namespace

std::optional<PathSolution> solve_path_equations(const MatchingProblem& problem, const MinimiseOptions& options,
                                                 const StepFields& start) {
  if (own_variance(problem) == 0) return std::nullopt;
  return PathEquations(problem, options).run(start);
}

PathSolution continue_path_equations(const MatchingProblem& problem, const MinimiseOptions& options,
                                     DiscretePath path) {
  if (std::optional<PathSolution> found = PathEquations(problem, options).run(path)) return std::move(*found);
  PathSolution none;
  none.path = std::move(path);
  return none;
}

MatchingProblem without_own_noise(const MatchingProblem& problem) {
  MatchingProblem smooth = problem;
  smooth.system.noise = make_noise("none");
  smooth.data = std::make_shared<LandmarkTerm>(problem.data->landmarks()->blurred(own_variance(problem)));
  return smooth;
}

}  // namespace pulson::matching
