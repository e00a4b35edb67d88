#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "linear_model.hpp"
#include "noise/bump_fields.hpp"

namespace pulson::posterior {

/// What the vector code of LaneShots computes with: numbers of a lane are `lanes` apart, so that entry i of lane l is
/// at i·lanes + l.
struct LaneShotArguments {
  int dimension = 2;
  int landmarks = 0;
  int steps = 0;
  bool derivatives = false;  ///< of q(T), dN rows, or the paths alone
  int columns = 0;           ///< n, of `slopes`
  bool heun = false;         ///< its steps in place of those of `variational-2`
  bool keeps_order = false;  ///< whether landmarks cannot pass each other: a step in which they do has no path
  double half = 0;           ///< ½Δt
  const std::vector<KernelTerm>* terms = nullptr;
  bool moves_positions = false, moves_momenta = false;  ///< the noise
  const double* q0 = nullptr;                           ///< dN, the same in all lanes
  const double* p0 = nullptr;                           ///< dN, of lanes
  const double* q_kicks = nullptr;  ///< steps·dN, of lanes: Σ_i w_i h_i,p of each step, where it moves positions
  const double* p_kicks = nullptr;  ///< the same of −Σ_i w_i h_i,q
  int bumps = 0;                    ///< or fields over space in place of kicks: F bumps,
  const double* centres = nullptr;  ///< d×F, of width² = 1/`sharpness`
  double sharpness = 0;
  const double* weights = nullptr;  ///< steps·F·d, of lanes: β w_i of each step
  double beta = 0;
  /// dN×n each, of steps: what a change of the kicks does to the slope, see LaneShots::slopes()
  const double* by_q = nullptr;
  const double* by_p = nullptr;
  const double* by_start = nullptr;    ///< dN×n
  const double* by_weights = nullptr;  ///< Fd×n each, of steps
  double* ends = nullptr;              ///< dN, of lanes
  double* middles = nullptr;           ///< dN, of lanes
  double* found = nullptr;             ///< 1 or 0, of lanes
  double* slopes = nullptr;            ///< dN×n, of lanes; or null, and what follows
  double* rows_by_q = nullptr;         ///< dN×dN each, of steps and lanes: the rows' derivatives by the kicks,
  double* rows_by_p = nullptr;         ///< where the noise has them,
  double* rows_by_start = nullptr;     ///< and by p0;
  double* rows_by_weights = nullptr;   ///< Fd×dN each, by w_i
  std::vector<double>* workspace = nullptr;
};

/// Shoots paths of the integrators `heun` and `variational-2` of one model, as many at once as a vector has lanes,
/// where the noise is additive and Hamiltonian, or of bumps over space, and landmarks are few: with the same steps as
/// Integrator::integrate() and its derivatives, whose results they equal to within 1e-10 of the shape's size.
class LaneShots {
 public:
  /// Whether there is vector code for the model.
  static bool knows(const Specimen& specimen, const Specimen::Model& model);

  /// @param chord whose J products() have; null: none
  LaneShots(const Specimen& specimen, const Specimen::Model& model, const LinearAt* chord);

  /// How many are shot at once.
  static int lanes();

  /// Of up to lanes() unknowns at once, U×L.
  struct Shots {
    Eigen::MatrixXd ends;     ///< q(T), dN×L
    Eigen::MatrixXd middles;  ///< q(T/2), dN×L
    std::vector<char> found;  ///< whether each has a path
    /// What was asked for, of each.
    std::vector<Eigen::MatrixXd> products;  ///< J(z)Jᵀ, n×n
    std::vector<Specimen::Slopes> slopes;
  };
  enum class With { kNothing, kProducts, kSlopes };
  Shots shoot(const Eigen::MatrixXd& z, With with) const;

 private:
  struct Rows {
    std::vector<double> by_q, by_p, by_start, by_weights;
  };
  Specimen::Slopes slopes_of(const Rows& rows, Eigen::Index lane, const Eigen::VectorXd& end) const;
  Eigen::Index channels() const { return bumps_ ? bumps_->centres.size() : of_p_.cols(); }

  const Specimen& specimen_;
  const Specimen::Model& model_;
  Eigen::MatrixXd of_q_, of_p_;  // ∇h_i, dN×C
  Eigen::MatrixXd by_q_, by_p_;  // dN×(n·steps)
  Eigen::MatrixXd by_start_;     // dN×n
  std::optional<BumpFields> bumps_;
  Eigen::MatrixXd by_weights_;  // C×(n·steps)
};

}  // namespace pulson::posterior
