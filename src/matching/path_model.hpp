#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "discrete_path.hpp"
#include "kernels/line_steps.hpp"
#include "line_system.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {

/// What the nodes of a path are paired with: derivatives of a cost by them, K + 1 of d×N; that of the first is 0, which
/// does not move.
using NodeCovector = std::vector<Points>;

/// A direction in which a path may go: changes of its nodes, and of the momenta of its steps' fields, which as fields
/// that stay where they are make those changes to first order.
struct PathDirection {
  std::vector<Points> nodes;    ///< K + 1, d×N
  std::vector<Points> momenta;  ///< K, d×N

  void add(double factor, const PathDirection& other);
  void scale(double factor);
};

/// At node j > 0: p_{j−1} − ½Δt f_{j−1} − (p_j + ½Δt f_j), without what follows at the last; 0 at the first.
/// @param momenta p, K @param forces f, K
NodeCovector node_rows(const std::vector<Points>& momenta, const std::vector<Points>& forces, double dt);

double pairing(const NodeCovector& covector, const PathDirection& direction);

/// The cost F = ∫H_tot dt + w D(q(T)) of a DiscretePath and its derivatives, as functions of the nodes.
class PathModel {
 public:
  /// @param path must outlive the model
  /// @param weight w, 1/(λs²): s is the sigma_inflation of the data
  PathModel(const EffectiveHamiltonian& system, const DataTerm& data, const DiscretePath& path, double weight);

  /// ∂F: at node j, p_{j−1} − ½Δt f_{j−1} − (p_j + ½Δt f_j), f the force. It vanishes where the path obeys the midpoint
  /// rule.
  NodeCovector gradient() const;

  /// ∂²F along a direction, exact but for D, which is held by its Gauss–Newton model.
  NodeCovector hessian(const PathDirection& direction) const;

  /// M⁻¹ of a covector, M the Gauss–Newton model of ∂²F: ½Σ Δt δp·A δp + ½w|R δq_K|², D ≈ ½|Rδq|², with the fields of
  /// the path fixed in space, so that landmarks interact through δp alone. By one system of the size of the data,
  /// S = N + CPCᵀ, with CᵀN⁻¹C = wRᵀR, P = Σ Δt Ψ_k A_k Ψ_kᵀ, Ψ_k the propagator from step k to the end.
  PathDirection solve(const NodeCovector& covector) const;

  /// ½w|Rδq_K|² of landmarks that are `deviation` off at node k and stay in the fields of the path.
  double misfit(std::size_t k, const Points& deviation) const;

  /// Of a feedback in a search.
  static constexpr double kFeedbackAccuracy = 1e-2;

  /// How the path goes on best, in the norm of M, from `deviation` off at node k: −Ψ_jᵀCᵀ S_k⁻¹ CΦ_k δq_k is added to
  /// the momenta of the steps j ≥ k, with S_k and its P from step k on, Φ_k the propagator from node k to the end. By
  /// conjugate gradients with S, to an accuracy relative in the norm of S⁻¹.
  PathDirection feedback(std::size_t k, const Points& deviation, double accuracy = kFeedbackAccuracy) const;

 private:
  using SlopesOnLine = std::pair<std::vector<Points>, std::vector<Points>>;  // K, 1×N: Σ_b K'w_b and Σ_b K''w_b
  SlopesOnLine slopes_on_line(const std::vector<Points>& dq) const;
  std::vector<Points> field_changes(const std::vector<Points>& dq, const SlopesOnLine& moved) const;
  std::vector<Points> force_changes(const std::vector<Points>& dq, const std::vector<Points>& dp,
                                    const SlopesOnLine& moved) const;
  std::vector<Points> cometric_solutions(const std::vector<Points>& v) const;
  std::vector<Points> velocities(const std::vector<Points>& p, std::size_t first) const;
  void keep_sums_on_line();
  bool has_roots() const { return roots_.size() > 0; }
  void propagate();
  void factorise();
  void factorise_line();
  Eigen::MatrixXd end_covariance() const;  ///< the upper triangle of P, or of CPCᵀ with C of landmarks
  Eigen::VectorXd observed(const Points& end_change) const;  ///< Cδq
  Points observed_transposed(const Eigen::VectorXd& r) const;
  Eigen::VectorXd observed_from(std::size_t k, const Points& deviation) const;  ///< CΦ_kδq
  Eigen::VectorXd weighed(const Eigen::VectorXd& r) const;                      ///< N⁻¹r
  Eigen::VectorXd system_solve(const Eigen::VectorXd& r) const;                 ///< S⁻¹r
  Eigen::VectorXd solved_iteratively(std::size_t k, const Eigen::VectorXd& r, double accuracy) const;
  Eigen::VectorXd system_product(std::size_t k, const Eigen::VectorXd& r) const;  ///< S_k r
  PathDirection swept(const NodeCovector& covector, const Points& at_end, std::size_t first,
                      const Points& deviation) const;

  const EffectiveHamiltonian& system_;
  const DataTerm& data_;
  const DiscretePath& path_;
  double weight_;
  bool noise_varies_;                      ///< where landmarks are elsewhere
  std::optional<LineSteps> on_line_;       ///< of landmarks on a line: sums of the steps
  SlopesOnLine of_momenta_;                ///< then, of w = p
  std::vector<Eigen::MatrixXd> inverses_;  ///< K, d²×N: (I − ½Δt ∂v/∂x)⁻¹
  // C is √w R, N = I; but where the data have a form of each axis C = I, N = (wRᵀR)⁻¹.
  const QuadraticForm* form_ = nullptr;
  Eigen::MatrixXd roots_;                                 ///< d²×N: C of landmarks, symmetric; empty for other data
  Eigen::MatrixXd root_;                                  ///< C of data that are neither
  std::vector<Eigen::MatrixXd> from_steps_, from_nodes_;  ///< K, d²×N: Ψ_k and Φ_k, times C of landmarks
  std::optional<LineSystem> line_;                        ///< of landmarks on a line, in place of a factor
  Eigen::MatrixXd factor_;                                ///< L on and below its diagonal, LLᵀ = S
};

}  // namespace pulson::matching
