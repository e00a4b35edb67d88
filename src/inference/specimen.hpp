#pragma once

#include <memory>
#include <optional>

#include "parameters.hpp"

namespace pulson::inference {

/// One target's unknowns z ~ N(0, I): momenta p0 = (λ(K(q0) + εI))^{-½} z0 by Cholesky factorisation, which is smooth
/// in the width of the kernel, and increments ΔW = √Δt zW. Of a tree the increments of its branches, one after the
/// other, and no momenta. Thread-safe.
class Specimen {
 public:
  /// @param tree see PosteriorProblem; empty: one path with the data of the problem
  explicit Specimen(matching::MatchingProblem problem, std::vector<Branch> tree = {});

  /// The models at one θ.
  struct Model {
    StochasticSystem system;
    double lambda = 1;
    double sigma = 1;                             ///< relative to that of the data
    std::shared_ptr<const Eigen::MatrixXd> root;  ///< L, LLᵀ = K(q0) + εI
  };

  struct Shot {
    std::vector<Trajectory> paths;  ///< of each branch
    Eigen::VectorXd residual;       ///< r
    double log_likelihood = 0;      ///< log p(y | z, θ)
  };

  /// Which unknowns and data a branch has.
  struct Place {
    Eigen::Index first_unknown, unknowns;
    Eigen::Index first_datum, data;  ///< all that depend on it: its own first
  };

  const matching::MatchingProblem& problem() const { return problem_; }
  const std::vector<Branch>& branches() const { return branches_; }
  const std::vector<Place>& places() const { return places_; }
  Eigen::Index unknowns() const { return momenta_ + channels_ * steps_; }
  Eigen::Index momentum_unknowns() const { return momenta_; }
  Eigen::Index channels() const { return channels_; }
  Eigen::Index data() const { return count_; }

  Model model(const ModelNumbers& numbers) const;
  Points momenta(const Model& model, const Eigen::VectorXd& z) const;              ///< p0
  Eigen::MatrixXd increments(std::size_t branch, const Eigen::VectorXd& z) const;  ///< ΔW
  /// The z of p0 and ΔW, of one path.
  Eigen::VectorXd white(const Model& model, const Points& momenta, const Eigen::MatrixXd& increments) const;

  /// None where a step has no root or numbers overflow.
  std::optional<std::vector<Trajectory>> paths(const Model& model, const Eigen::VectorXd& z) const;
  std::optional<Shot> shoot(const Model& model, const Eigen::VectorXd& z) const;

  /// ½∇|r|² = J(z)ᵀr, by the adjoint.
  Eigen::VectorXd misfit_gradient(const Model& model, const Shot& shot) const;

  /// The derivatives of the data, at the σ of the data, by p0 and by the unknowns of each branch.
  struct Slopes {
    Eigen::MatrixXd momenta;                 ///< n×dN, or n×0
    std::vector<Eigen::MatrixXd> by_branch;  ///< of the data that depend on it
  };
  Slopes slopes(const Model& model, const Shot& shot) const;

  /// −log p(y | z, θ) − ½|r|²
  double log_volume(const Model& model) const;

 private:
  Eigen::MatrixXd root_of(const KernelOperator& kernel) const;
  Eigen::VectorXd residual(const std::vector<Trajectory>& paths) const;

  matching::MatchingProblem problem_;
  std::vector<Branch> branches_;
  std::vector<Place> places_;
  Eigen::Index momenta_;  ///< of the unknowns
  Eigen::Index steps_ = 0;
  Eigen::Index channels_;
  Eigen::Index count_ = 0;
  double nugget_;
  double log_determinant_ = 0;
  std::shared_ptr<const Eigen::MatrixXd> reference_root_;
};

}  // namespace pulson::inference
