#pragma once

#include <vector>

#include <Eigen/Cholesky>

#include "dynamics/effective_hamiltonian.hpp"
#include "pulson/core/time_grid.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {

/// A path of landmarks in midpoint steps that need not obey the midpoint rule.
struct CanonicalPath {
  TimeGrid grid;
  std::vector<Points> nodes;    ///< q, K + 1, d×N
  std::vector<Points> momenta;  ///< p, K, d×N: in the middles of the steps

  Points middle(std::size_t k) const { return 0.5 * (nodes[k] + nodes[k + 1]); }
};

/// What of a CanonicalPath does not obey the midpoint rule, or a change of it.
struct PathResidual {
  std::vector<Points> velocities;  ///< K: (q_{k+1} − q_k)/Δt − ∂H/∂p
  std::vector<Points> momenta;  ///< K + 1: at node j > 0, p_{j−1} − ½Δt f_{j−1} − (p_j + ½Δt f_j), f = ∂H/∂q; at the
                                ///< last, with w∂D/∂q in place of what follows
};

/// A change of a CanonicalPath.
struct PathVariation {
  std::vector<Points> nodes;       ///< K + 1; that of the first is 0
  std::vector<Points> momenta;     ///< K
  std::vector<Points> velocities;  ///< K: Aδp of the momenta
};

/// The midpoint rule's equations along a path, made linear with fields that are fixed in space: landmarks interact
/// through the change of their momenta alone. They come down to one system for the costate at the end, (I + WP)η = …,
/// P = Σ Δt Ψ_k A_k Ψ_kᵀ, Ψ_k the propagator from step k to the end, W = w R⁻¹ of the data. P is the sum of what each
/// landmark's own noise does, and of a smooth part, which is approximated by its exact columns for few landmarks,
/// carriers, and its exact blocks on the diagonal (Snelson & Ghahramani, Sparse Gaussian processes using pseudo-inputs,
/// 2006).
class PassiveModel {
 public:
  /// @param gradients K, d²×N: ∂v/∂x of the fields at the landmarks
  /// @param own what each landmark's momentum moves it by itself besides, per time
  /// @param weight w of D
  /// @param carriers which landmarks
  PassiveModel(const EffectiveHamiltonian& system, const LandmarkTerm& data, const CanonicalPath& path,
               std::vector<Eigen::MatrixXd> gradients, double own, double weight,
               const std::vector<Eigen::Index>& carriers);

  /// The change of the path that makes this change of what does not obey the midpoint rule.
  PathVariation solve(const PathResidual& change) const;

  /// Wδq of the end.
  Points pull(const Points& end_change) const;

 private:
  void propagate();
  Points velocity(std::size_t k, const Points& p) const;  ///< A_k p, nearly
  void factorise(double own, const std::vector<Eigen::Index>& carriers);
  Points smooth_product(const Eigen::VectorXd& carried, const Points& like) const;
  /// The costate η at the end where η + W(Pη + `end`) = `costate`.
  Points answer(const Points& costate, const Points& end) const;
  PathVariation swept(const PathResidual& change, const Points& end_costate) const;

  const EffectiveHamiltonian& system_;
  const CanonicalPath& path_;
  std::vector<Eigen::MatrixXd> gradients_;
  Eigen::MatrixXd precisions_;                   ///< W, d²×N
  std::vector<Eigen::MatrixXd> inverses_;        ///< K, d²×N: (I − ½Δt ∂v/∂x)⁻¹
  std::vector<Eigen::MatrixXd> from_steps_;      ///< K, d²×N: Ψ_k
  std::vector<Eigen::MatrixXd> smooth_kernels_;  ///< K, N×M: A_k = aI + UUᵀ, nearly
  double own_rate_;                              ///< a
  Eigen::MatrixXd own_;                          ///< E, d²×N: P = E + VVᵀ
  Eigen::MatrixXd smooth_;                       ///< V, dN×dM, index a·d + axis
  Eigen::MatrixXd answers_;                      ///< F = (W⁻¹ + E)⁻¹, d²×N
  Eigen::LLT<Eigen::MatrixXd> factors_;          ///< I + VᵀFV
};

}  // namespace pulson::matching
