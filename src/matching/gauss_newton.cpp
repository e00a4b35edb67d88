// Levenberg–Marquardt in the whitened unknowns, solved in data space: a step costs one dN×dN factorisation, however
// many controls the noise has.

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "solvers.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Below this part of J its differences are round-off.
constexpr double kRoundOff = 1e-13;
constexpr double kSmallestGain = 1e-4;
constexpr double kFirstDamping = 1e-8;
constexpr double kLeastDamping = 1e-14;
constexpr double kMostDamping = 1e12;
constexpr int kMaxCorrections = 3;

// The quadratic model ½|z + δ|² + ½|r + Jδ|² + ½μ δᵀRδ at one point, R diagonal, factored in data space: with
// C = (I + μR)⁻¹ and S = I + JCJᵀ its minimum is δ = −C(z + Jᵀ S⁻¹ (r − JCz)).
class DampedModel {
 public:
  DampedModel(const MatrixXd& jacobian, const VectorXd& roughness, double mu)
      : jacobian_(jacobian), c_((1 + mu * roughness.array()).inverse()) {
    MatrixXd s = jacobian * c_.asDiagonal() * jacobian.transpose();
    s.diagonal().array() += 1;
    factors_.compute(s);
  }

  VectorXd step(const VectorXd& z, const VectorXd& r) const {
    return -c_.cwiseProduct(z + pull(r - jacobian_ * c_.cwiseProduct(z)));
  }

  // The least change that takes a residual `excess`, which the linear model did not foresee, out again.
  VectorXd correction(const VectorXd& excess) const { return -c_.cwiseProduct(pull(excess)); }

 private:
  VectorXd pull(const VectorXd& r) const { return jacobian_.transpose() * factors_.solve(r); }

  const MatrixXd& jacobian_;
  VectorXd c_;
  Eigen::LLT<MatrixXd> factors_;
};

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

class Search {
 public:
  Search(const MatchingObjective& objective, const MinimiseOptions& options, MatchingObjective::Evaluation start)
      : objective_(objective), options_(options) {
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

  void linearise() {
    jacobian_ = objective_.jacobian(at());
    gradient_ = at().z + jacobian_.transpose() * at().residual;
    const VectorXd newton = DampedModel(jacobian_, objective_.roughness(), 0).step(at().z, at().residual);
    const double total = at().cost.total();
    summary_.relative_gradient = total > 0 ? std::sqrt(std::max(0.0, -gradient_.dot(newton)) / (2 * total)) : 0;
    if (options_.on_iteration) options_.on_iteration(summary_.iterations, total, summary_.relative_gradient);
  }

  bool finished() {
    summary_.converged = summary_.relative_gradient <= options_.gradient_tolerance || at().cost.total() < 1e-20;
    if (summary_.converged) summary_.reason = "the gradient vanishes";
    if (!summary_.converged && summary_.iterations >= options_.max_iterations)
      summary_.reason = "the limit of iterations was reached";
    return !summary_.reason.empty();
  }

  // One accepted step, with as much damping as it needs; false where none lowers the cost.
  bool advance() {
    bool out_of_bounds = false;
    for (; damping_.mu < kMostDamping; damping_.refuse()) {
      const DampedModel model(jacobian_, objective_.roughness(), damping_.mu);
      const VectorXd delta = model.step(at().z, at().residual);
      const VectorXd foreseen = at().residual + jacobian_ * delta;
      const double predicted = at().cost.total() - 0.5 * (at().z + delta).squaredNorm() - 0.5 * foreseen.squaredNorm();
      if (!(predicted > kRoundOff * at().cost.total())) break;
      std::optional<Evaluation> trial = corrected(model, foreseen, evaluate(at().z + delta));
      out_of_bounds = !trial;
      const double gain = trial ? (at().cost.total() - trial->cost.total()) / predicted : -1;
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

  std::optional<Evaluation> evaluate(const VectorXd& z) {
    ++summary_.evaluations;
    return objective_.evaluate(z);
  }

  // The valley of J is narrow and bent: its walls are the residuals that the linear model did not foresee. Taking them
  // out again with the same factors allows far longer steps along it.
  std::optional<Evaluation> corrected(const DampedModel& model, const VectorXd& foreseen,
                                      std::optional<Evaluation> trial) {
    for (int i = 0; i < kMaxCorrections && trial; ++i) {
      std::optional<Evaluation> next = evaluate(trial->z + model.correction(trial->residual - foreseen));
      if (!next || !(next->cost.total() < trial->cost.total())) break;
      const bool exhausted = next->cost.total() > 0.9 * trial->cost.total();
      trial = std::move(next);
      if (exhausted) break;
    }
    return trial;
  }

  const MatchingObjective& objective_;
  const MinimiseOptions& options_;
  MinimiseSummary summary_;
  Damping damping_;
  MatrixXd jacobian_;
  VectorXd gradient_;
};

}  // namespace

MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start) {
  return Search(objective, options, std::move(start)).run();
}

}  // namespace pulson
