#pragma once

#include <memory>
#include <optional>

#include "parameters.hpp"

namespace pulson::inference {

/// One target's unknowns z ~ N(0, I): momenta p0 = (λ(K(q0) + εI))^{-½} z0 by Cholesky factorisation, which is smooth
/// in the width of the kernel, and increments ΔW = √Δt zW. Thread-safe.
class Specimen {
 public:
  explicit Specimen(matching::MatchingProblem problem);

  /// The models at one θ.
  struct Model {
    StochasticSystem system;
    double lambda = 1;
    double sigma = 1;                             ///< relative to that of the data
    std::shared_ptr<const Eigen::MatrixXd> root;  ///< L, LLᵀ = K(q0) + εI
  };

  struct Shot {
    Trajectory path;
    Eigen::VectorXd residual;   ///< r
    double log_likelihood = 0;  ///< log p(y | z, θ)
  };

  const matching::MatchingProblem& problem() const { return problem_; }
  Eigen::Index unknowns() const { return problem_.source.size() + channels_ * problem_.grid.steps; }
  Eigen::Index channels() const { return channels_; }
  Eigen::Index data() const { return count_; }

  Model model(const ModelNumbers& numbers) const;
  Points momenta(const Model& model, const Eigen::VectorXd& z) const;  ///< p0
  Eigen::MatrixXd increments(const Eigen::VectorXd& z) const;          ///< ΔW
  /// The z of p0 and ΔW.
  Eigen::VectorXd white(const Model& model, const Points& momenta, const Eigen::MatrixXd& increments) const;

  /// None where a step has no root or numbers overflow.
  std::optional<Trajectory> path(const Model& model, const Eigen::VectorXd& z) const;
  std::optional<Shot> shoot(const Model& model, const Eigen::VectorXd& z) const;

  /// ½∇|r|² = J(z)ᵀr, by the adjoint.
  Eigen::VectorXd misfit_gradient(const Model& model, const Shot& shot) const;

  /// −log p(y | z, θ) − ½|r|²
  double log_volume(const Model& model) const;

 private:
  Eigen::MatrixXd root_of(const KernelOperator& kernel) const;

  matching::MatchingProblem problem_;
  Eigen::Index channels_;
  Eigen::Index count_;
  double nugget_;
  double log_determinant_;
  std::shared_ptr<const Eigen::MatrixXd> reference_root_;
};

}  // namespace pulson::inference
