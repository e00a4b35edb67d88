#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {

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
  /// A variance, of σ²: directions of the momenta whose prior moves the landmarks by less than that fade, from ten
  /// times as much to a tenth of it. 0: none do.
  double faint = 0;
  /// Whether the energy is paid for along the path, λ∫H dt in place of λH(q0, p0). Where the noise moves positions its
  /// controls are then u = λh(q, p), energy and action together are λT H_tot(q0, p0), and paths are those of H_tot (see
  /// EffectiveHamiltonian), over p0 alone. With noise the integrator has to be `variational`, the potentials linear in
  /// p.
  bool along_path = false;
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
  /// controls would move landmarks far. Of several realisations, where a step has no root that is connected to Δt = 0.
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
  StochasticSystem flow_;  ///< of the paths
  int channels_;           ///< of its noise
  std::shared_ptr<const MomentumBasis> basis_;
};

/// Why a search ended that was interrupted.
constexpr const char* kInterrupted = "interrupted";

/// How the objective is minimised.
enum class Solver {
  kAuto,         ///< paths where the problem is one of paths in midpoint steps, else shooting by its size
  kPaths,        ///< Newton's method on paths, see search_paths()
  kShooting,     ///< shooting, by one of the following; without an integrator by `variational`, that of (20)
  kGaussNewton,  ///< shooting, Levenberg–Marquardt with dense Jacobians: few iterations
  kLbfgs,        ///< shooting, limited-memory quasi-Newton on the adjoint gradient: O(N²) an iteration, O(NK) memory
};

/// @throws InputError that lists `auto`, `paths`, `shooting`, `gauss-newton`, `lbfgs`
Solver parse_solver(std::string_view name);
std::string solver_name(Solver solver);

struct MinimiseOptions {
  Solver solver = Solver::kAuto;
  int max_iterations = 500;
  /// Converged where the relative gradient is at most this: √(gᵀB⁻¹g / 2J) with g = ∇J and B Gauss–Newton's model of
  /// the second derivatives; its square is the part of J that is still to be gained. L-BFGS, which has no B:
  /// relative_gradient().
  double gradient_tolerance = 1e-3;
  std::uint64_t seed = 1;  ///< of the disturbance of a start
  /// Called after each iteration, for progress.
  std::function<void(int iteration, double cost, double relative_gradient)> on_iteration{};
  /// Asked after each iteration: whether to end, with the best that was found. The answer must stay yes.
  std::function<bool()> interrupted{};

  bool is_interrupted() const { return interrupted && interrupted(); }
};

/// A minimum of J that some of several searches ended at.
struct Minimum {
  double total = 0;       ///< J
  int found = 0;          ///< by so many searches
  double log_weight = 0;  ///< −(J − J of the first in a list): log of its density over that of the first
};

struct MinimiseSummary {
  Solver solver = Solver::kAuto;  ///< the one that was used
  bool converged = false;
  std::string reason{};  ///< why it stopped, in words
  int iterations = 0;    ///< of the search over paths and of shooting
  int evaluations = 0;
  double relative_gradient = 0;
  MatchingObjective::Evaluation solution{};
};

/// Minimises the objective by shooting, from what a search over paths finds: with the noise as a control where it is to
/// be fitted and linear in p, else without noise.
MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options);

/// |∇J| / (|z| + |∇J − z|), 0 where both vanish.
double relative_gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient);

/// The posterior of a match near its minimum as a Gaussian, and how well the model explains the data.
struct LaplaceApproximation {
  Points momentum_deviation;  ///< standard deviations of p0, d×N; 0 at landmarks without a momentum of their own
  Points velocity_deviation;  ///< of v0 = K(q0)p0 at the landmarks, d×N: well conditioned where momenta are not
  Points end_deviation;       ///< of q(T), d×N, length units; of several realisations: of the mean of their ends
  double log_evidence = 0;    ///< log p(y), see log_evidence(); NaN where the data have no normalised density
};

/// Laplace's approximation (D. MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 27) of the
/// posterior of the whitened unknowns z with the prior N(0, I) and the likelihood exp(−D(q(T))):
///
///     z | y ≈ N(z*, B⁻¹),   B = I + JᵀJ,   cov(Az) = A B⁻¹ Aᵀ,
///
/// z* the minimum of the objective and B Gauss–Newton's Hessian there (MatchingObjective::Linearisation): exact where
/// q(T) is linear in z and the data are landmarks. A is ∂p0/∂z, K(q0)∂p0/∂z and ∂q(T)/∂z. In terms of momenta the prior
/// is N(0, (λK)⁻¹) at the landmarks of the basis, and no momentum at all elsewhere; increments of fitted noise are
/// N(0, Δt). The deviations are those of one minimum, and of given kernel, noise, σ and λ.
///
/// Cost: two linearisations, O(UD·min(U, D)) time and O(U(D + dN)) memory for U unknowns and D residuals.
/// @param minimum where ∇J vanishes: MinimiseSummary::solution
LaplaceApproximation laplace(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum);

/// The log of the density of the data y, the unknowns integrated out by Laplace's approximation,
///
///     log p(y) ≈ −J(z*) + ½ gᵀB⁻¹g − ½ log det B − ½ Σ_a log det(2πR_a/w_a),
///
/// with g = ∇J, which vanishes at a minimum but for what the search left; the last sum LandmarkTerm::log_determinant().
/// It is a density in the length units of y to the power of minus the number of coordinates observed. Where there are
/// several realisations, D is a mean over them, and so is the log of the likelihood here.
/// @throws InputError where the data are not landmarks: their term is no log of a normalised density
double log_evidence(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum);

}  // namespace pulson::matching
