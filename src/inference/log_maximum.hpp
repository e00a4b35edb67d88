#pragma once

#include <functional>

#include <Eigen/Core>

namespace pulson::inference {

/// A maximum over the logarithms of positive numbers.
struct LogMaximum {
  Eigen::VectorXd x;           ///< the logarithms, from the start
  double value = 0;            ///< of the function
  Eigen::VectorXd deviations;  ///< see maximise_over_logs(); NaN where there are none
  int evaluations = 0;
  bool converged = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> at_bound;
};

/// Where, how finely and for how long to search.
struct LogSearch {
  Eigen::VectorXd least, most;  ///< bounds of x, about 0
  double first_step = 0.5;
  double tolerance = 0.01;  ///< in each x_i
  int max_evaluations = 60;
  bool with_deviations = true;
};

/// −bound ≤ x_i ≤ bound for each of `size` logarithms.
LogSearch log_search(Eigen::Index size, double bound, double tolerance, int max_evaluations);

/// Maximises f(x) from x = 0 by quadratic interpolation in a trust region (M. Powell, The BOBYQA algorithm for bound
/// constrained optimization without derivatives, 2009). f is −∞ where it cannot be evaluated, but not at 0. The
/// deviations are the roots of the diagonal of (−∇²f)⁻¹, by central differences, over those x_i that are not at a
/// bound; NaN for the others, and where −∇²f is not positive definite.
LogMaximum maximise_over_logs(const std::function<double(const Eigen::VectorXd&)>& f, const LogSearch& search);

}  // namespace pulson::inference
