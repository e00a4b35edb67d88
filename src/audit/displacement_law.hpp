#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// Two landmarks whose exchange makes a displacement more probable than any other exchange does.
struct Exchange {
  int first = -1, second = -1;
  double log_likelihood = 0;
};

/// The probability of displacements y, d×N, from a reference shape x to other shapes that are aligned with it:
///
///     y ~ N(Xb, s(C ⊗ I)),   C = ρK + (1 − ρ)I,   P = C⁻¹ − C⁻¹X(XᵀC⁻¹X)⁻¹XᵀC⁻¹,
///
/// X the motions of a similarity, b with a flat prior, s in closed form, K matern32. Width and ρ are those of greatest
/// likelihood on a grid, for each displacement its own: the numbers of wrong data would hide what is wrong. Exchanging
/// landmarks a and b of the shape adds v = (E_a − E_b)(t_b − t_a) to y and 2vᵀPy + vᵀPv to yᵀPy, so that all pairs
/// together cost O(N²) after one factorisation of O(N³) for each of the grid.
class DisplacementLaw {
 public:
  /// @param reference d×N, complete, not all at one point; 2N or 3N coordinates more than a similarity has numbers
  explicit DisplacementLaw(const Points& reference);

  const Points& reference() const { return reference_; }
  /// But for a constant. @param shape d×N, complete and aligned with the reference
  double log_likelihood(const Points& shape) const;
  Exchange best_exchange(const Points& shape) const;

 private:
  struct Member {
    Eigen::MatrixXd inverse;     ///< C⁻¹, N×N
    Eigen::MatrixXd directions;  ///< V, dN×r: P = C⁻¹ ⊗ I − VVᵀ
    double log_determinants;     ///< −½ log det(C ⊗ I) − ½ log det(XᵀC⁻¹X)
  };
  double half_degrees() const;
  Points projected(const Member& member, const Points& displacement) const;

  Points reference_;
  std::vector<Member> members_;  ///< of the grid
};

}  // namespace pulson::audit
