#pragma once

#include "pulson/core/landmarks.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::cohort {

struct TransportOptions {
  int rungs = 20;
  int steps = 20;  ///< Runge–Kutta's of each geodesic
};

/// Momenta carried by parallel transport along the geodesic from q0 with momenta `along` over [0, 1], by the pole
/// ladder (M. Lorenzi and X. Pennec, "Efficient parallel transport of deformations in time series of images", 2014): of
/// each of n pieces of the geodesic, with ends q and q' and the middle m,
///
///     p' = −n² log_q'(exp_m(−log_m(exp_q(p/n²)))).
///
/// It keeps inner products p·K(q)p' up to its error, which is O(n⁻²) (N. Guigui and X. Pennec, "Numerical accuracy of
/// ladder schemes for parallel transport on manifolds", 2022).
/// @param q0, along, momentum d×N @return d×N, at the end of the geodesic
/// @throws NumericalError where landmarks come so close that a piece has no geodesic, InputError for wrong options
Points transported(const KernelOperator& kernel, const Points& q0, const Points& along, const Points& momentum,
                   const TransportOptions& options = {});

}  // namespace pulson::cohort
