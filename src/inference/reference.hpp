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

/// The distinct minima that searches from several guesses find; those whose linear evidence is more than 12 nats below
/// the greatest are dropped. The guesses are the minima that registration finds, and draws of the prior.
/// @param searches one more than draws of the prior; 0: 4 where there are at most 12 data, else 1
std::vector<Minimum> find_minima(const Specimen& specimen, const Specimen::Model& model, int searches,
                                 std::uint64_t seed);

/// The Gaussian reference of a posterior: for each specimen the mixture Σ_m a_m g_m(z | θ) of linear models, and
/// N(φ̂, BBᵀ) for φ.
struct Reference {
  std::vector<std::vector<Minimum>> minima;  ///< [specimen][mode]
  std::vector<Eigen::VectorXd> log_weights;  ///< log a_m
  Eigen::VectorXd centre;                    ///< φ̂
  Eigen::MatrixXd root;                      ///< B, lower triangle
  double laplace_log_evidence = 0;           ///< log p(y), by Laplace's approximation over φ of the linear evidence

  /// log N(φ; φ̂, BBᵀ)
  double log_density(const Eigen::VectorXd& phi) const;
};

/// Minima at the φ of greatest linear evidence, found in turns.
Reference make_reference(const std::vector<Specimen>& specimens, const ParameterSpace& space, int searches,
                         std::uint64_t seed);

/// log N(φ; 0, I)
double log_standard_normal(const Eigen::VectorXd& phi);

}  // namespace pulson::inference
