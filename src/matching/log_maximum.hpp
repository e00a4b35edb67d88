#pragma once

#include <functional>

#include <Eigen/Core>

namespace pulson {

/// A maximum over the logarithms of positive numbers.
struct LogMaximum {
  Eigen::VectorXd x;           ///< the logarithms, from the start
  double value = 0;            ///< of the function
  Eigen::VectorXd deviations;  ///< see maximise_over_logs(); NaN where there are none
  int evaluations = 0;
  bool converged = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> at_bound;
};

/// Maximises f(x) over |x_i| ≤ bound from x = 0 by quadratic interpolation in a trust region (M. Powell, The BOBYQA
/// algorithm for bound constrained optimization without derivatives, 2009), to `tolerance` in each x_i. f is −∞ where
/// it cannot be evaluated, but not at 0. The deviations are the roots of the diagonal of (−∇²f)⁻¹, by central
/// differences of step 0.05, over those x_i that are not at a bound; NaN for the others, and where −∇²f is not positive
/// definite. They are left out, with their evaluations, unless `with_deviations`.
LogMaximum maximise_over_logs(const std::function<double(const Eigen::VectorXd&)>& f, Eigen::Index size, double bound,
                              double tolerance, int max_evaluations, bool with_deviations = true);

}  // namespace pulson
