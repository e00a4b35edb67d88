#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson {

class MomentumBasis;

/// What is matched, and what a match costs:
///
///     J(p0, ΔW) = (λ/2) p0ᵀK(q0)p0 + ½ Σ_k |ΔW_k|²/Δt + D(q(T))
///
/// with D the data term, ½ Σ_a |q_a(T) − y_a|²/σ² for landmarks. Minimised over p0 and, where the noise has channels,
/// over the increments: the noise is a control. (The Freidlin–Wentzell MAP, not the Onsager–Machlup one; they are the
/// same for additive noise.) Where realisations of the noise are given instead, the increments are those, the action
/// drops out, and D is its mean over the realisations.
struct MatchingProblem {
  StochasticSystem system;
  std::shared_ptr<const Integrator> integrator;
  TimeGrid grid;
  Points source;  ///< q0, d×N
  std::shared_ptr<const DataTerm> data;
  double sigma = 0;   ///< what the data can resolve, length units: see MatchingObjective; must be given
  double lambda = 0;  ///< weight of the energy; must be given
  std::vector<Eigen::MatrixXd> realisations{};  ///< frozen ΔW, C×K each; empty: the increments are fitted
};

/// @throws InputError if a number is out of its range or shapes do not fit together
void check(const MatchingProblem& problem);

/// @throws InputError if two source landmarks coincide
void require_distinct(const Points& source);

/// The three terms of J, see MatchingProblem.
struct MatchingCost {
  double energy = 0;
  double action = 0;
  double data = 0;
  double total() const { return energy + action + data; }
};

/// The problem of n of its N landmarks, which stand for all of them: each weighs N/n times as much.
/// @param problem one whose data are landmarks
/// @throws InputError if of these nothing is observed
MatchingProblem subsampled(const MatchingProblem& problem, const std::vector<Eigen::Index>& landmarks);

/// J in whitened unknowns z = (z0, zW): p0 = VD^{-½}z0 with λK(q0) = VDVᵀ at the landmarks of a MomentumBasis, ΔW = √Δt
/// zW, so that J = ½|z|² + D. Landmarks are left without a momentum of their own where those of others do what it could
/// do: while the trace of what is left of K is below 1e-3 λσ²/T², no direction that is left out would explain more than
/// 1e-3 of any misfit. Nor are any taken whose Schur complement is below 1e-13 K(0), where K is numerically singular.
class MatchingObjective {
 public:
  /// @throws InputError if two source landmarks coincide or numbers do not fit together
  explicit MatchingObjective(MatchingProblem problem);

  /// The paths of one z, with all that the derivatives need.
  struct Evaluation {
    Eigen::VectorXd z;
    std::vector<Trajectory> paths;  ///< one, or one for each realisation
    MatchingCost cost;
    const Trajectory& path() const { return paths.front(); }
  };

  /// D + ½|z|² to second order: D(z + δ) ≈ D(z) + ½|r + Jδ|² − ½|r|².
  struct Linearisation {
    Eigen::VectorXd residual;  ///< r
    Eigen::MatrixXd jacobian;  ///< J, residuals × unknowns
  };

  const MatchingProblem& problem() const { return problem_; }
  const MomentumBasis& basis() const { return *basis_; }

  Eigen::Index unknowns() const;

  /// The spatial frequency of each unknown: MomentumBasis::frequency() for momenta, 1 for controls. The path is the
  /// less linear in a direction the rougher it is.
  Eigen::VectorXd frequency() const;

  /// 1 for unknowns that a search should move, 0 for others: momenta in directions whose eigenvalue of λK is below 1e-3
  /// of λσ²/T², as that of all landmarks would be, which the data do not see; and, where noise that moves landmarks is
  /// fitted, those of high frequency (an eigenvalue below 1e-2 of the largest) and belong to the noise: with B
  /// its map from increments to displacements, v = Kp and unit z, T|v|² < 0.1 |Bᵀv|²/|v|², so that of a small misfit
  /// the momenta would explain less than a tenth. Their energy counts at t = 0 only, where they nearly cancel: noise
  /// that separates such landmarks would set free a flow that J has not paid for.
  Eigen::VectorXd active_unknowns() const;

  /// Empty where a step of a path does not contract: such z are out of bounds, since near the end of a root tiny
  /// controls would move landmarks far.
  std::optional<Evaluation> evaluate(const Eigen::VectorXd& z) const;

  /// ∂D/∂z at an evaluation, by the adjoint: ∇J = z + it.
  Eigen::VectorXd data_gradient(const Evaluation& at) const;

  Linearisation linearise(const Evaluation& at) const;

  /// Whether D = ½|r|², and then r.
  bool is_least_squares() const { return problem_.data->is_least_squares(); }
  Eigen::VectorXd residual(const Evaluation& at) const;

  /// ∂q(T)/∂z of one path, dN×unknowns.
  Eigen::MatrixXd endpoint_changes(const Trajectory& path) const;

  /// The z of given momenta and increments: of p0 its projection on the basis.
  Eigen::VectorXd white(const Points& momenta, const Eigen::MatrixXd& increments) const;

  Points momenta(const Eigen::VectorXd& z) const;              ///< p0, d×N
  Eigen::MatrixXd increments(const Eigen::VectorXd& z) const;  ///< ΔW, C×K, where they are fitted

 private:
  Eigen::Index controls() const;

  MatchingProblem problem_;
  int channels_;
  std::shared_ptr<const MomentumBasis> basis_;
};

}  // namespace pulson
