#pragma once

#include <functional>

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The sum of the products of entries.
inline double inner_product(const Points& a, const Points& b) { return a.cwiseProduct(b).sum(); }

/// A map F of which a step needs the root of x = c + s F(x) at s = 1, that is continuously connected to x = c at s = 0.
/// x is a d×M matrix of one or more blocks of equal size in different units, such as [q p].
class ImplicitMap {
 public:
  virtual ~ImplicitMap() = default;

  virtual Points value(const Points& x) const = 0;

  /// ∂F/∂x, index column·d + axis.
  virtual Eigen::MatrixXd jacobian(const Points& x) const = 0;

  /// A bound on the terms of F, one number for each block: it sets the rounding error of x.
  virtual Eigen::VectorXd rounding_scale() const = 0;

  /// Whether roots at two values of s can lie on the same branch.
  virtual bool on_same_branch(const Points& /*before*/, const Points& /*after*/) const { return true; }

  /// The ratio of successive corrections above which the fixed-point iteration is not trusted.
  virtual double contraction() const { return 0.9; }
};

/// How the root of an implicit step was found.
struct ImplicitRoot {
  Points x;
  bool found = false;
  bool continued = false;  ///< found by continuation in s
  double contraction = 0;  ///< largest ratio of successive corrections of the fixed-point iteration
};

/// Solves x = c + F(x) to round-off.
///
/// The fixed-point iteration from x = c is used while each correction is at most `contraction` of the one before, and
/// its limit is accepted if it is on the same branch as c. Where it is not, Newton follows the root from s = 0 to 1; a
/// step in s is accepted if Newton's correction is small relative to the predicted move, the determinant of I − sF' is
/// positive and the roots are on the same branch. Where that fails the branch ends, or cannot be distinguished from its
/// end, and `found` is false.
ImplicitRoot solve_implicit(const ImplicitMap& map, const Points& c, RootSearch search);

/// Solves (I − J)x = b, x in blocks as those of ImplicitMap: by the fixed-point iteration while it contracts, else by
/// GMRES where x is one large block, else by LU factors. @param apply x ↦ Jx @param matrix J, index column·d + axis
Points solve_linear(const std::function<Points(const Points&)>& apply, const std::function<Eigen::MatrixXd()>& matrix,
                    const Points& b, int blocks = 1);

/// The dM×dM matrix of a linear map of d×M matrices, column by column.
Eigen::MatrixXd matrix_of(const std::function<Points(const Points&)>& apply, Eigen::Index rows, Eigen::Index cols);

PhaseState operator+(const PhaseState& a, const PhaseState& b);
PhaseState operator*(double factor, const PhaseState& a);

/// What one step of (11) adds up: F(z) = Δt (H_p, −H_q − λH_p) + (h_w,p, −h_w,q) at z = (q, p), w the increments, with
/// its derivatives. With Δt = 0 it is the noise alone and takes no sums of the kernel.
class StepField {
 public:
  StepField(const StochasticSystem& system, double dt, const Eigen::VectorXd& w) : system_(system), dt_(dt), w_(w) {}

  PhaseState value(const PhaseState& z) const;

  /// F'(z) δ
  PhaseState tangent(const PhaseState& z, const PhaseState& delta) const;

  /// F'(z)ᵀ μ
  PhaseState transposed(const PhaseState& z, const PhaseState& mu) const;

  /// The change of F(z) with w and with the parameters of the noise (which may be empty: none).
  PhaseState forced(const PhaseState& z, const Eigen::VectorXd& w_change, const Eigen::VectorXd& parameters) const;

  /// The transpose of `forced`, added.
  void add_forced_transposed(const PhaseState& z, const PhaseState& mu, Eigen::VectorXd& w_bar,
                             Eigen::VectorXd& parameters_bar) const;

 private:
  bool has_noise() const { return w_.size() > 0; }

  const StochasticSystem& system_;
  double dt_;
  const Eigen::VectorXd& w_;
};

}  // namespace pulson
