#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// The probability of a shape, aligned with a reference x of d×N, by its displacement y from it (a column of dN
/// numbers, landmark by landmark): but for a constant
///
///     max over members of  log c − ½(ν + m) log(κ + yᵀPy),
///
/// a Student distribution in the m directions that a similarity leaves; P, dN×dN, is 0 in the others, so that the pose
/// has a flat prior. Of one shape against another (κ = ν = 0; the scale is integrated out) the members are widths and
/// strengths of a kernel, and each hypothesis has the best of them, since the numbers of wrong data would hide what is
/// wrong. Of a cohort there is one member, see cohort_law.hpp.
class LandmarkLaw {
 public:
  struct Member {
    Eigen::MatrixXd precision;  ///< P
    double log_constant = 0;    ///< log c
  };
  /// Of one landmark's distance e from where the others say that it is, in predicted standard deviations: e/√scale has
  /// a Student distribution.
  struct Tail {
    double degrees = 0;      ///< 0: those of the law
    Eigen::VectorXd scales;  ///< of each landmark; empty: 1
  };

  LandmarkLaw(Points reference, std::vector<Member> members, double directions, double degrees, double offset);

  const Points& reference() const { return reference_; }
  const std::vector<Member>& members() const { return members_; }
  bool has(int landmark) const { return !is_dropped_[static_cast<std::size_t>(landmark)]; }
  int landmarks() const;
  double directions() const { return directions_; }
  void set_tail(Tail tail) { tail_ = std::move(tail); }

  /// Landmark a is integrated out, as where it is missing.
  void drop(int landmark);

  /// @param square yᵀPy
  double log_density(const Member& member, double square) const;
  double log_density(const Eigen::VectorXd& displacement) const;

  /// Of the other landmarks, wherever this one is.
  double log_density_without(int landmark, const Eigen::VectorXd& displacement) const;

  /// One landmark given the others.
  struct Prediction {
    double log_density = 0;     ///< of where it is
    double log_rest = 0;        ///< of where the others are, as log_density()
    Eigen::VectorXd deviation;  ///< of where it is from where it is expected, d
    double spread = 0;          ///< geometric mean of the predicted standard deviations of its coordinates
    double distance = 0;        ///< e
  };
  /// Of each landmark by the others; nothing where it is dropped. Of several members by that which suits the others
  /// best.
  std::vector<Prediction> predict(const Eigen::VectorXd& displacement) const;

 private:
  struct Block;
  Block block(const Member& member, int landmark, const Eigen::VectorXd& weighted, double square) const;
  double log_factor(double directions, double square) const;
  Prediction predict(const Block& block, int landmark) const;

  Points reference_;
  std::vector<Member> members_;
  double directions_, degrees_, offset_;  // m, ν, κ
  Tail tail_;
  std::vector<bool> is_dropped_;
};

/// Of one shape against another one, the displacement's covariance being a multiple of (ρK + (1 − ρ)I) ⊗ I, K matern32:
/// members of several widths and ρ. @param reference d×N, complete, not all at one place
LandmarkLaw pair_law(const Points& reference);

/// The covariances of the members of pair_law() without the factor I, N×N.
std::vector<Eigen::MatrixXd> kernel_covariances(const Points& reference);

/// An orthonormal basis of the displacements that are no motion of the reference, to first order; dN×m.
Eigen::MatrixXd directions_of_shape(const Points& reference);

}  // namespace pulson::audit
