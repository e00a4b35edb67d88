#pragma once

#include <string>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson {

class LandmarkTerm;

/// A positive definite quadratic form, N×N.
struct QuadraticForm {
  Eigen::MatrixXd root;     ///< U, upper triangle: the form is UᵀU
  Eigen::MatrixXd inverse;  ///< (UᵀU)⁻¹
};

/// What holds the end points of a flow near its target: D(q), q = q(T), d×N, and a quadratic model of it,
///
///     D(q + δ) ≈ D(q) + ½|r + Fδ|² − ½|r|²,   Fᵀr = ∂D/∂q,
///
/// with FᵀF positive semi-definite: Gauss–Newton's approximation of the second derivatives. All methods are const and
/// thread-safe.
class DataTerm {
 public:
  struct Linearisation {
    Eigen::VectorXd residual;  ///< r
    Eigen::MatrixXd changes;   ///< FΔ, one column for each column of Δ
  };

  virtual ~DataTerm() = default;

  virtual double value(const Points& q) const = 0;

  /// ∂D/∂q, d×N.
  virtual Points gradient(const Points& q) const = 0;

  /// r and FΔ. @param changes Δ, dN×R (index a·d + axis)
  virtual Linearisation linearise(const Points& q, const Eigen::MatrixXd& changes) const = 0;

  /// Whether D = ½|r|² with F constant: then residual() is r.
  virtual bool is_least_squares() const { return false; }

  /// r. @throws std::logic_error unless is_least_squares()
  virtual Eigen::VectorXd residual(const Points& q) const;

  /// FᵀF, where it is the same for each axis, 0 between them, and constant; else null.
  virtual const QuadraticForm* form_of_each_axis() const { return nullptr; }

  /// This term, where the data are landmarks.
  virtual const LandmarkTerm* landmarks() const { return nullptr; }
};

}  // namespace pulson
