// Levenberg–Marquardt in the whitened unknowns.

#include <algorithm>
#include <cmath>
#include <limits>

#include "damping.hpp"
#include "quadratic_model.hpp"
#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::VectorXd;

// Below this part of J its differences are round-off.
constexpr double kRoundingOfCost = 1e-13;
constexpr double kSmallestGain = 1e-4;
constexpr int kMaxCorrections = 3;

class NewtonSearch {
 public:
  NewtonSearch(const MatchingObjective& objective, const MinimiseOptions& options, MatchingObjective::Evaluation start)
      : objective_(objective),
        options_(options),
        frequency_(objective.frequency()),
        active_unknowns_(objective.active_unknowns()) {
    summary_.solver = Solver::kGaussNewton;
    summary_.solution = std::move(start);
    summary_.evaluations = 1;
  }

  MinimiseSummary run() {
    linearise();
    while (!finished()) {
      if (!advance()) break;
      ++summary_.iterations;
      linearise();
    }
    return std::move(summary_);
  }

 private:
  using Evaluation = MatchingObjective::Evaluation;

  const Evaluation& at() const { return summary_.solution; }

  static double total(const Evaluation& at) { return at.cost.total(); }

  std::optional<Evaluation> evaluate_from(const Evaluation& at, const VectorXd& delta) {
    ++summary_.evaluations;
    return objective_.evaluate(at.z + delta);
  }

  void linearise() {
    linear_ = objective_.linearise(at());
    linear_.jacobian *= active_unknowns_.asDiagonal();
    model_.emplace(linear_, frequency_);
    const VectorXd gradient = at().z + linear_.jacobian.transpose() * linear_.residual;
    const double decrement = -gradient.dot(model_->step(at().z));
    const double cost = total(at());
    // Factors of a Jacobian whose squares leave the range of numbers foresee no step at all.
    const bool is_finite = std::isfinite(decrement) && std::isfinite(linear_.jacobian.squaredNorm());
    summary_.relative_gradient = !is_finite ? std::numeric_limits<double>::max()  // no minimum
                                 : cost > 0 ? std::sqrt(std::max(0.0, decrement) / (2 * cost))
                                            : 0;
    if (options_.on_iteration) options_.on_iteration(summary_.iterations, cost, summary_.relative_gradient);
  }

  bool finished() {
    const bool is_flat = summary_.relative_gradient <= options_.gradient_tolerance;
    summary_.converged = is_flat || total(at()) < kNegligibleCost;
    if (summary_.converged) summary_.reason = is_flat ? "the gradient vanishes" : "the cost vanishes";
    if (!summary_.converged && summary_.iterations >= options_.max_iterations)
      summary_.reason = "the limit of iterations was reached";
    if (!summary_.converged && options_.is_interrupted()) summary_.reason = kInterrupted;
    return !summary_.reason.empty();
  }

  // One accepted step, with as much damping as it needs; false where none lowers the cost.
  bool advance() {
    bool out_of_bounds = false;
    const double cost = total(at());
    for (; !damping_.is_exhausted(); damping_.refuse()) {
      model_->set_damping(damping_.mu());
      const VectorXd& z = at().z;
      const VectorXd delta = model_->step(z);
      const VectorXd foreseen = linear_.residual + linear_.jacobian * delta;
      const double predicted =
          0.5 * (z.squaredNorm() + linear_.residual.squaredNorm() - (z + delta).squaredNorm() - foreseen.squaredNorm());
      if (!(predicted > kRoundingOfCost * cost)) break;
      std::optional<Evaluation> trial = corrected(foreseen, evaluate_from(at(), delta));
      out_of_bounds = !trial;
      const double gain = trial ? (cost - total(*trial)) / predicted : -1;
      if (gain > kSmallestGain) {
        summary_.solution = std::move(*trial);
        damping_.accept(gain);
        return true;
      }
    }
    summary_.reason = out_of_bounds ? kTooCoarse : "no step lowers the cost by more than round-off";
    return false;
  }

  // The valley of J is narrow and bent: its walls are the residuals that the linear model did not foresee. Taking them
  // out again with the same factors allows far longer steps along it.
  std::optional<Evaluation> corrected(const VectorXd& foreseen, std::optional<Evaluation> trial) {
    if (!objective_.is_least_squares()) return trial;
    for (int i = 0; i < kMaxCorrections && trial; ++i) {
      const VectorXd excess = objective_.residual(*trial) - foreseen;
      std::optional<Evaluation> next = evaluate_from(*trial, model_->correction(excess));
      if (!next || !(total(*next) < total(*trial))) break;
      const bool exhausted = total(*next) > 0.9 * total(*trial);
      trial = std::move(next);
      if (exhausted) break;
    }
    return trial;
  }

  const MatchingObjective& objective_;
  const MinimiseOptions& options_;
  VectorXd frequency_;
  VectorXd active_unknowns_;
  MinimiseSummary summary_;
  Damping damping_;
  MatchingObjective::Linearisation linear_;
  std::optional<QuadraticModel> model_;
};

}  // namespace

MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start) {
  return NewtonSearch(objective, options, std::move(start)).run();
}

}  // namespace pulson::matching
