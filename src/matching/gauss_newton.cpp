// Levenberg–Marquardt in the whitened unknowns, and quasi-Newton steps in its metric where that metric no longer
// changes.

#include <algorithm>
#include <cmath>
#include <limits>

#include "quadratic_model.hpp"
#include "solvers.hpp"

namespace pulson {
namespace {

using Eigen::VectorXd;

// Below this part of J its differences are round-off.
constexpr double kRoundOff = 1e-13;
// A cost, in nats, that no data would show: what equal shapes have by round-off.
constexpr double kNoCost = 1e-12;
constexpr double kSmallestGain = 1e-4;
constexpr double kFirstDamping = 1e-8;
constexpr double kLeastDamping = 1e-14;
constexpr double kMostDamping = 1e12;
constexpr int kMaxCorrections = 3;
// A step that lowers J by less than this part of it calls for quasi-Newton steps: what is left to gain is owed to
// curvature that Gauss–Newton's B does not hold, rather than to changes of B.
constexpr double kPolishBelow = 1e-5;
constexpr int kMaxPolish = 20;
// Iterations without a smaller gradient, see runs_away().
constexpr int kMostGrowing = 3;
// See is_stuck().
constexpr std::size_t kStuckAfter = 10;
constexpr double kStuckGradient = 0.1;
constexpr double kStuckGain = 0.02;

// Nielsen's damping: μ shrinks smoothly with the gain of an accepted step, and grows ever faster while steps are
// refused.
struct Damping {
  double mu = 0;
  double growth = 2;
  void accept(double gain) {
    mu *= std::max(0.1, 1 - std::pow(2 * gain - 1, 3));
    if (mu < kLeastDamping) mu = 0;
    growth = 2;
  }
  void refuse() {
    mu = mu > 0 ? mu * growth : kFirstDamping;
    growth *= 2;
  }
};

// BFGS updates of the inverse of the model's B (Nocedal 1980), from changes of z and of the gradient.
class UpdatedInverse {
 public:
  explicit UpdatedInverse(const QuadraticModel& model) : model_(model) {}

  void add(const VectorXd& step, const VectorXd& change) {
    const double curvature = step.dot(change);
    if (curvature > 0) updates_.push_back({step, change, 1 / curvature});
  }

  VectorXd operator()(VectorXd v) const {
    std::vector<double> parts(updates_.size());
    for (std::size_t i = updates_.size(); i-- > 0;) {
      parts[i] = updates_[i].inverse * updates_[i].step.dot(v);
      v -= parts[i] * updates_[i].change;
    }
    v = model_.solve(v);
    for (std::size_t i = 0; i < updates_.size(); ++i)
      v += (parts[i] - updates_[i].inverse * updates_[i].change.dot(v)) * updates_[i].step;
    return v;
  }

 private:
  struct Update {
    VectorXd step;
    VectorXd change;
    double inverse;
  };
  const QuadraticModel& model_;
  std::vector<Update> updates_;
};

class NewtonSearch {
 public:
  NewtonSearch(const MatchingObjective& objective, const MinimiseOptions& options, MatchingObjective::Evaluation start,
               const Restriction& restriction)
      : objective_(objective),
        options_(options),
        softness_(restriction.softness),
        cautious_(restriction.cautious),
        unknowns_(restriction.unknowns.empty() ? objective.smooth_unknowns(0) : restriction.unknowns),
        roughness_(objective.roughness()(unknowns_)) {
    summary_.solver = Solver::kGaussNewton;
    summary_.solution = std::move(start);
    summary_.evaluations = 1;
  }

  MinimiseSummary run() {
    linearise();
    while (!finished()) {
      const double before = total(at());
      if (!advance()) break;
      ++summary_.iterations;
      linearise();
      if ((cautious_ && runs_away()) || is_stuck()) break;
      if (before - total(at()) < kPolishBelow * before && !finished() && polish()) linearise();
    }
    return std::move(summary_);
  }

 private:
  using Evaluation = MatchingObjective::Evaluation;

  const Evaluation& at() const { return summary_.solution; }

  double total(const Evaluation& at) const {
    return at.cost.energy + at.cost.action + at.cost.data / (softness_ * softness_);
  }

  // Of the unknowns that are moved.
  VectorXd moved(const Evaluation& at) const { return at.z(unknowns_); }

  VectorXd gradient(const Evaluation& at) const {
    return moved(at) + objective_.data_gradient(at)(unknowns_) / (softness_ * softness_);
  }

  std::optional<Evaluation> evaluate_from(const Evaluation& at, const VectorXd& delta) {
    VectorXd z = at.z;
    z(unknowns_) += delta;
    ++summary_.evaluations;
    return objective_.evaluate(z);
  }

  void linearise() {
    linear_ = objective_.linearise(at(), unknowns_);
    linear_.residual /= softness_;
    linear_.jacobian /= softness_;
    model_.emplace(linear_, roughness_);
    const VectorXd gradient = moved(at()) + linear_.jacobian.transpose() * linear_.residual;
    set_relative_gradient(-gradient.dot(model_->step(moved(at()))));
  }

  void set_relative_gradient(double decrement) {
    const double cost = total(at());
    summary_.relative_gradient = cost > 0 ? std::sqrt(std::max(0.0, decrement) / (2 * cost)) : 0;
    if (options_.on_iteration) options_.on_iteration(summary_.iterations, cost, summary_.relative_gradient);
  }

  bool finished() {
    const bool is_flat = summary_.relative_gradient <= options_.gradient_tolerance;
    summary_.converged = is_flat || total(at()) < kNoCost;
    if (summary_.converged) summary_.reason = is_flat ? "the gradient vanishes" : "the cost vanishes";
    if (!summary_.converged && summary_.iterations >= options_.max_iterations)
      summary_.reason = "the limit of iterations was reached";
    return !summary_.reason.empty();
  }

  // Many steps that together gain little of what one alone promises: they end where a step has no root.
  bool is_stuck() {
    costs_.push_back(total(at()));
    if (costs_.size() <= kStuckAfter || summary_.relative_gradient < kStuckGradient) return false;
    if (costs_[costs_.size() - 1 - kStuckAfter] - costs_.back() > kStuckGain * costs_.back()) return false;
    summary_.reason = "the next steps leave what the time step can resolve";
    return true;
  }

  // Near a minimum the gradient falls with the cost. Where it does not any more, the search has found a way to lower
  // the cost by the error of the time step, which has no end but the step's: back to where the gradient was least.
  bool runs_away() {
    if (summary_.relative_gradient <= options_.gradient_tolerance) return false;
    if (summary_.relative_gradient < least_gradient_) {
      least_gradient_ = summary_.relative_gradient;
      quietest_ = at();
      since_least_ = 0;
    }
    if (since_least_++ < kMostGrowing) return false;
    summary_.reason = "the time step does not resolve the roughest momenta";
    summary_.solution = std::move(*quietest_);
    return true;
  }

  // One accepted step, with as much damping as it needs; false where none lowers the cost.
  bool advance() {
    bool out_of_bounds = false;
    const double cost = total(at());
    for (; damping_.mu < kMostDamping; damping_.refuse()) {
      model_->set_damping(damping_.mu);
      const VectorXd z = moved(at());
      const VectorXd delta = model_->step(z);
      const VectorXd foreseen = linear_.residual + linear_.jacobian * delta;
      const double predicted =
          0.5 * (z.squaredNorm() + linear_.residual.squaredNorm() - (z + delta).squaredNorm() - foreseen.squaredNorm());
      if (!(predicted > kRoundOff * cost)) break;
      std::optional<Evaluation> trial = corrected(foreseen, evaluate_from(at(), delta));
      out_of_bounds = !trial;
      const double gain = trial ? (cost - total(*trial)) / predicted : -1;
      if (gain > kSmallestGain) {
        summary_.solution = std::move(*trial);
        damping_.accept(std::min(gain, 1.0));
        return true;
      }
    }
    summary_.reason = out_of_bounds ? "the next step leaves what the time step can resolve"
                                    : "no step lowers the cost by more than round-off";
    return false;
  }

  // The valley of J is narrow and bent: its walls are the residuals that the linear model did not foresee. Taking them
  // out again with the same factors allows far longer steps along it.
  std::optional<Evaluation> corrected(const VectorXd& foreseen, std::optional<Evaluation> trial) {
    if (!objective_.is_least_squares()) return trial;
    for (int i = 0; i < kMaxCorrections && trial; ++i) {
      const VectorXd excess = objective_.residual(*trial) / softness_ - foreseen;
      std::optional<Evaluation> next = evaluate_from(*trial, model_->correction(excess));
      if (!next || !(total(*next) < total(*trial))) break;
      const bool exhausted = total(*next) > 0.9 * total(*trial);
      trial = std::move(next);
      if (exhausted) break;
    }
    return trial;
  }

  // BFGS from the model of the last linearisation: an iteration costs a path and its adjoint, and no Jacobian. False
  // where the first step gains nothing.
  bool polish() {
    model_->set_damping(0);
    UpdatedInverse inverse(*model_);
    VectorXd slope = gradient(at());
    int turns = 0;
    double best = summary_.relative_gradient;
    int since_best = 0;
    for (; turns < kMaxPolish; ++turns) {
      const VectorXd delta = -inverse(slope);
      if (turns > 0) set_relative_gradient(-delta.dot(slope));
      if (summary_.relative_gradient <= 0.5 * options_.gradient_tolerance) break;
      since_best = summary_.relative_gradient < 0.9 * best ? 0 : since_best + 1;
      best = std::min(best, summary_.relative_gradient);
      if (since_best > 5) break;
      std::optional<Evaluation> trial = shortened(delta, slope);
      if (!trial) break;
      const VectorXd before = moved(at());
      summary_.solution = std::move(*trial);
      ++summary_.iterations;
      VectorXd next = gradient(at());
      inverse.add(moved(at()) - before, next - slope);
      slope = std::move(next);
    }
    return turns > 0;
  }

  // z + δ, or with δ halved a few times, where this lowers the cost as it should.
  std::optional<Evaluation> shortened(const VectorXd& delta, const VectorXd& slope) {
    const double cost = total(at());
    const double descent = delta.dot(slope);
    for (const double part : {1.0, 0.5, 0.25}) {
      std::optional<Evaluation> trial = evaluate_from(at(), part * delta);
      if (trial && total(*trial) < cost + 1e-4 * part * descent) return trial;
    }
    return std::nullopt;
  }

  const MatchingObjective& objective_;
  const MinimiseOptions& options_;
  double softness_;
  bool cautious_;
  std::vector<Eigen::Index> unknowns_;
  VectorXd roughness_;
  MinimiseSummary summary_;
  Damping damping_;
  double least_gradient_ = std::numeric_limits<double>::infinity();
  int since_least_ = 0;
  std::vector<double> costs_;
  std::optional<Evaluation> quietest_;
  MatchingObjective::Linearisation linear_;
  std::optional<QuadraticModel> model_;
};

}  // namespace

MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start, const Restriction& restriction) {
  return NewtonSearch(objective, options, std::move(start), restriction).run();
}

}  // namespace pulson
