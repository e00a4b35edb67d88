#pragma once

#include <vector>

#include <Eigen/Cholesky>

#include "dynamics/effective_hamiltonian.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::cohort {

/// The linear maps of the geodesics from one template to first order in the momenta: with A = A(q0) of the cometric
/// and τ = λσ², momenta p move the template by Ap, and (A + τ)p = y − q0 is the match of a target y.
class TemplateMetric {
 public:
  /// @param nugget A − K(q0), 0 or greater @param tau 0 or greater
  TemplateMetric(const KernelOperator& kernel, double nugget, double tau, Points q0);

  const Points& shape() const { return q0_; }
  const Eigen::MatrixXd& gram() const { return gram_; }  ///< A(q0), N×N
  double tau() const { return tau_; }

  Points velocity(const Points& p) const { return p * gram_; }  ///< Ap
  /// p·Ap, the square of the length of a geodesic.
  double squared_norm(const Points& p) const { return p.cwiseProduct(velocity(p)).sum(); }
  /// (A + τ)p
  Points displacement(const Points& p) const { return p * gram_ + tau_ * p; }

 private:
  Points q0_;
  Eigen::MatrixXd gram_;
  double tau_;
};

/// The factors of A + τ/v for a target whose landmark a has noise of the variance σ²/v_a, or is missing: then its
/// momenta are 0 to first order.
class MatchModel {
 public:
  /// @param observed the landmarks that are not missing @param precisions v, N; empty: all 1
  MatchModel(const TemplateMetric& metric, std::vector<Eigen::Index> observed, const Eigen::VectorXd& precisions = {});

  const std::vector<Eigen::Index>& observed() const { return observed_; }

  /// From momenta to the unknowns of a match and back, both d×N: (A + τ/v)p where a landmark is observed, else sp with
  /// s the largest element of A.
  Points unknowns(const Points& p) const;
  Points momenta(const Points& unknowns) const;
  /// The defect of a match in these units: q(T) + τp(T)/v − y where it is observed, else sp(T).
  Points defect(const PhaseState& end, const Points& target) const;

 private:
  const TemplateMetric* metric_;
  std::vector<Eigen::Index> observed_, missing_;
  double scale_;
  Eigen::VectorXd taus_;  // τ/v, N
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

/// A geodesic that matches a target.
struct GeodesicMatch {
  Points momenta;  ///< p0, d×N
  PhaseState end;  ///< (q, p)(T)
  double defect;   ///< largest |q(T) + τp(T) − y|, length units
  int shots = 0;   ///< geodesics that were shot
  bool converged = false;
};

/// Geodesics of H = ½ p·A(q)p, A = K + λβ², over [0, 1] in Runge–Kutta's steps of order 4, and their matches of
/// targets. The minimum of
///
///     λ∫H dt + ½|q(1) − y|²/σ²
///
/// over paths from q0 is a geodesic that ends with q(1) + λσ² p(1) = y (transversality), and σ = 0 asks for q(1) = y:
/// equations for p0, which are solved by shooting alone.
class Geodesics {
 public:
  /// @param lambda, beta of noise `ch-sd` on every landmark, whose control costs ½∫|u|² dt (EffectiveHamiltonian); a β
  /// of 0 is none
  Geodesics(const KernelOperator& kernel, int steps, double lambda = 1, double beta = 0);

  const KernelOperator& kernel() const { return hamiltonian_.system().kernel; }
  const TimeGrid& grid() const { return grid_; }

  /// @throws StepError where the numbers leave their range
  Trajectory path(const Points& q0, const Points& p0) const;
  PhaseState shoot(const Points& q0, const Points& p0) const;

  /// The match nearest to no deformation, from the momenta `start`. @param target d×N; where a landmark is not observed
  /// any numbers @param tolerance of the defect, length units
  GeodesicMatch match(const TemplateMetric& metric, const MatchModel& model, const Points& target, const Points& start,
                      double tolerance) const;

 private:
  PhaseState step(const PhaseState& state, int k) const;

  EffectiveHamiltonian hamiltonian_;
  TimeGrid grid_;
};

}  // namespace pulson::cohort
