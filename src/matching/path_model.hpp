#pragma once

#include <vector>

#include <Eigen/Cholesky>

#include "discrete_path.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson {

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

double pairing(const NodeCovector& covector, const PathDirection& direction);

/// The cost F = ∫H_tot dt + w D(q(T)) of a DiscretePath and its derivatives, as functions of the nodes.
class PathModel {
 public:
  /// @param path must outlive the model
  /// @param weight w, 1/(λs²): s is the softness of the data
  PathModel(const EffectiveHamiltonian& system, const DataTerm& data, const DiscretePath& path, double weight);

  /// ∂F: at node j, p_{j−1} − ½Δt f_{j−1} − (p_j + ½Δt f_j), f the force. It vanishes where the path obeys the midpoint
  /// rule.
  NodeCovector gradient() const;

  /// ∂²F along a direction, exact but for D, which is held by its Gauss–Newton model.
  NodeCovector hessian(const PathDirection& direction) const;

  /// M⁻¹ of a covector, M the Gauss–Newton model of ∂²F: ½Σ Δt δp·A δp + ½w|R δq_K|², D ≈ ½|Rδq|², with the fields of
  /// the path fixed in space, so that landmarks interact through δp alone. By one system of the size of the data,
  /// S = I + wRPRᵀ, P = Σ Δt Ψ_k A_k Ψ_kᵀ, Ψ_k the propagator from step k to the end.
  PathDirection solve(const NodeCovector& covector) const;

  /// The least change of the fields, in the norm of M, that moves the end by −`excess`, as far as the data ask for it.
  PathDirection correction(const Points& excess) const;

 private:
  void factorise();
  Eigen::VectorXd whitened(const Points& end_change) const;    ///< √w R δq
  Points whitened_transposed(const Eigen::VectorXd& r) const;  ///< √w Rᵀ r
  Points end_costate(const Points& end_change) const;          ///< −√wRᵀ S⁻¹ √wR δq
  PathDirection swept(const NodeCovector& covector, const Points& at_end) const;

  const EffectiveHamiltonian& system_;
  const DataTerm& data_;
  const DiscretePath& path_;
  double weight_;
  std::vector<Eigen::MatrixXd> inverses_;  ///< K, d²×N: (I − ½Δt ∂v/∂x)⁻¹
  std::vector<Eigen::MatrixXd> roots_;     ///< N, d×d: √w R of landmarks, symmetric; empty for other data
  Eigen::MatrixXd axis_root_;              ///< √w R of data with a root of each axis, upper triangle
  Eigen::MatrixXd root_;                   ///< √w R of other data
  Eigen::LLT<Eigen::MatrixXd> factors_;    ///< of S
};

}  // namespace pulson
