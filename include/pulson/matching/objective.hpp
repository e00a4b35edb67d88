#pragma once

#include <optional>

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// What is matched, and what a match costs:
///
///     J(p0, ΔW) = (λ/2) p0ᵀK(q0)p0 + ½ Σ_k |ΔW_k|²/Δt + ½ Σ_a |q_a(T) − y_a|²/σ²
///
/// minimised over p0 and, where the noise has channels, over the increments: the noise is a control. (The
/// Freidlin–Wentzell MAP, not the Onsager–Machlup one; they are the same for additive noise.)
struct MatchingProblem {
  StochasticSystem system;
  std::shared_ptr<const Integrator> integrator;
  TimeGrid grid;
  Points source;        ///< q0, d×N
  Points target;        ///< y, d×N
  double sigma = 0.01;  ///< standard deviation of the observation, length units
  double lambda = 1;    ///< weight of the energy
};

/// The three terms of J, see MatchingProblem.
struct MatchingCost {
  double energy = 0;
  double action = 0;
  double data = 0;
  double total() const { return energy + action + data; }
};

/// J in whitened unknowns z = (z0, zW): λK(q0) = VDVᵀ, p0 = V D^{-½} z0, ΔW = √Δt zW, so that J = ½|z|² + ½|r|², with
/// r = (q(T) − y)/σ. Directions of p0 whose eigenvalue of K is below 1e-13 of the largest, or below 1e-4 λσ²/T², are
/// left out: K is numerically singular there, or the energy holds them so firmly that they explain less than 1e-4 of
/// any misfit.
class MatchingObjective {
 public:
  /// @throws InputError if two source landmarks coincide or numbers do not fit together
  explicit MatchingObjective(MatchingProblem problem);

  /// The path of one z, with all that the derivatives need.
  struct Evaluation {
    Eigen::VectorXd z;
    Trajectory path;
    Eigen::VectorXd residual;  ///< r, dN
    MatchingCost cost;
  };

  const MatchingProblem& problem() const { return problem_; }

  Eigen::Index unknowns() const;

  /// How rough each unknown is: for momenta the largest eigenvalue of K over that of their direction, 1 for controls.
  /// The path is the less linear in a direction the rougher it is.
  const Eigen::VectorXd& roughness() const { return roughness_; }
  Eigen::Index residuals() const { return problem_.target.size(); }

  /// Empty where a step of the path does not contract: such z are out of bounds, since near the end of a root tiny
  /// controls would move landmarks far.
  std::optional<Evaluation> evaluate(const Eigen::VectorXd& z) const;

  /// ∇J at an evaluation, by the adjoint.
  Eigen::VectorXd gradient(const Evaluation& at) const;

  /// ∂r/∂z, dN × unknowns.
  Eigen::MatrixXd jacobian(const Evaluation& at) const;

  /// The z of given momenta and increments; of p0 what lies in the directions left out is lost.
  Eigen::VectorXd white(const Points& momenta, const Eigen::MatrixXd& increments) const;

  Points momenta(const Eigen::VectorXd& z) const;              ///< p0, d×N
  Eigen::MatrixXd increments(const Eigen::VectorXd& z) const;  ///< ΔW, C×K

 private:
  MatchingProblem problem_;
  int channels_;
  Eigen::VectorXd roughness_;
  Eigen::MatrixXd white_from_momenta_;  ///< rank×N, D^½ Vᵀ
  Eigen::MatrixXd momenta_from_white_;  ///< N×rank, V D^{-½}
};

}  // namespace pulson
