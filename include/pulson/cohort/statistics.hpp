#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pulson/cohort/atlas.hpp"

namespace pulson::cohort {

/// Principal components of n shapes, r of them with a variance that is not 0 within rounding.
struct ShapeModes {
  Eigen::VectorXd eigenvalues;     ///< r variances, decreasing, with the denominator n − 1
  Eigen::MatrixXd scores;          ///< n×r, whose columns have these variances and the mean 0
  std::vector<Points> directions;  ///< r, each d×N of norm 1; the largest element is positive

  /// The variance of all, Σ eigenvalues.
  double total() const { return eigenvalues.sum(); }
};

/// Principal components of the momenta in the metric of the kernel at the template (tangent PCA; M. Vaillant,
/// M. Miller, L. Younes and A. Trouvé, "Statistics on diffeomorphisms via tangent space representations", 2004):
/// ⟨p, p'⟩ = p·A(q0)p', in which |p| is the length of the geodesic. directions are momenta π_k with π_k·Aπ_k = 1,
/// eigenvalues length units squared; the shape s standard deviations along mode k is where the geodesic with momenta
/// s√eigenvalue_k π_k ends. Cost O(min(n, dN)³ + n²dN) or O(n(dN)²), whichever is less.
ShapeModes momentum_modes(const Atlas& atlas);

/// Shapes of unit centroid size in the tangent space at their mean.
struct ProcrustesModes {
  Points mean;                   ///< d×N, of centroid size 1 about the origin
  ShapeModes modes;              ///< eigenvalues without unit; directions are displacements
  std::vector<int> landmarks{};  ///< of the shapes, counted from 0, to which both belong
};

/// The principal components that are usual in geometric morphometrics: shapes are scaled to centroid size 1 and rotated
/// onto their mean (partial generalised Procrustes analysis), projected orthogonally to the mean (I. Dryden and K.
/// Mardia, Statistical Shape Analysis, 2016, chapter 7), and centred: what `gpagen` and `gm.prcomp` of R's geomorph
/// compute. Landmarks that a shape misses are left out of all. @param shapes d×N
/// @throws InputError where fewer than d + 1 are in all shapes
ProcrustesModes procrustes_modes(const std::vector<Points>& shapes);

/// Random permutations of specimens.
struct PermutationOptions {
  int count = 9999;
  std::uint64_t seed = 1;
};

/// Momenta that are linear in a covariate: a geodesic through the template for each value. test_model() tests them.
struct MomentumRegression {
  Points slope;       ///< d×N, momenta per unit of the covariate
  Points intercept;   ///< d×N: where the covariate is `mean`
  double mean = 0;    ///< of the covariate
  int specimens = 0;  ///< that have a value

  Points momenta(double covariate) const { return intercept + (covariate - mean) * slope; }
};

/// @param covariate n numbers, NaN where a specimen has none @throws InputError where fewer than three have one, or all
/// the same
MomentumRegression regress_momenta(const Atlas& atlas, const Eigen::VectorXd& covariate);

/// A group of specimens.
struct GroupMean {
  std::string name;
  int size = 0;
  Points momenta;  ///< d×N, their mean
};

/// In order of appearance. @param groups n names; specimens with an empty one are left out
std::vector<GroupMean> group_means(const Atlas& atlas, const std::vector<std::string>& groups);

/// The permutation number `index` of 0 … size − 1: a function of these and the seed.
std::vector<int> random_permutation(std::uint64_t seed, std::uint64_t index, int size);

}  // namespace pulson::cohort
