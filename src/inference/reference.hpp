#pragma once

#include <memory>
#include <vector>

#include "parameters.hpp"
#include "posterior/minimum.hpp"

namespace pulson::inference {

using posterior::LinearAt;
using posterior::LinearModel;
using posterior::Minimum;
using posterior::Specimen;

/// posterior::find_minima() of one specimen, as accurately as a reference needs it.
/// @throws NumericalError where neither `start` nor rest has a path
Minimum find_minimum(const Specimen& specimen, const Specimen::Model& model, const Eigen::VectorXd& start);

/// So few data of a specimen may have minima, or tails, that one search does not find.
inline constexpr Eigen::Index kFewData = 12;

/// The distinct minima that searches from several guesses find; those whose linear evidence is more than 12 nats below
/// the greatest are dropped. The guesses are the minima that registration finds, and draws of the prior.
/// @param searches one more than draws of the prior; 0: 16 where there are at most 12 data, else 1
std::vector<Minimum> find_minima(const Specimen& specimen, const Specimen::Model& model, int searches,
                                 std::uint64_t seed);

/// The width of the component that is the prior: to rounding the data say nothing then.
inline constexpr double kOfPrior = 1e8;

/// One law of the reference of a specimen: the posterior of the linear model at a minimum, with σ `width` times as
/// large; the prior where that is very large.
struct Component {
  std::size_t mode = 0;
  double width = 1;
};

/// The reference of a posterior: for each specimen a mixture Σ_c a_c g_c(z | θ), and for φ one of N(φ̂, BBᵀ) and
/// N(0, I). It is defensive (T. Hesterberg 1995): a small part of each are laws that are wider step by step up to the
/// prior, so that no weight exceeds the greatest likelihood over that part, and draws come to tails and minima that no
/// narrow law reaches.
struct Reference {
  std::vector<std::vector<Minimum>> minima;        ///< [specimen][mode]
  std::vector<std::vector<Component>> components;  ///< [specimen], of each mode first the one that is not wide
  std::vector<Eigen::VectorXd> log_weights;        ///< log a_c; as make_reference() gives them, of the modes
  Eigen::VectorXd centre;                          ///< φ̂
  Eigen::MatrixXd root;                            ///< B, lower triangle
  double laplace_log_evidence = 0;  ///< log p(y), by Laplace's approximation over φ of the linear evidence

  /// The logarithm of the density of φ.
  double log_density(const Eigen::VectorXd& phi) const;
  /// φ of standard normal numbers and one that is uniform in (0, 1).
  Eigen::VectorXd draw(const Eigen::VectorXd& normals, double uniform) const;
};

/// Adds the components. @param inflation the width of those that are not wide
void defend(Reference& reference, const std::vector<Specimen>& specimens, const ParameterSpace& space,
            double inflation);

/// Minima at the φ of greatest linear evidence, found in turns; without components.
Reference make_reference(const std::vector<Specimen>& specimens, const ParameterSpace& space, int searches,
                         std::uint64_t seed);

/// log N(φ; 0, I)
double log_standard_normal(const Eigen::VectorXd& phi);

}  // namespace pulson::inference
