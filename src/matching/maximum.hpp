#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace pulson::matching {

/// Bounds of each number; one whose bounds are equal is held.
struct Box {
  Eigen::VectorXd least, most;
  Eigen::VectorXd clipped(const Eigen::VectorXd& x) const { return x.cwiseMax(least).cwiseMin(most); }
};

/// The function of one to four numbers that is maximised; −∞ or NaN where it has no value, but not at the start.
using ValueAt = std::function<double(const Eigen::VectorXd& x)>;

/// Where a function is greatest.
struct Maximum {
  Eigen::VectorXd x;
  double value = 0;
  int evaluations = 0;
  bool converged = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> at_bound{};  ///< within ten tolerances
};

/// How finely and for how long to search.
struct MaximumSearch {
  double tolerance = 1e-4;  ///< of each number; of logarithms, so that four digits of a value hold
  int max_evaluations = 100;
  double first_step = 0.5;  ///< of each number
};

/// Maximises a function without derivatives over a box by quadratic interpolation in a trust region, the nearest
/// maximum to the start (M. Powell, The BOBYQA algorithm for bound constrained optimization without derivatives, 2009;
/// by NLopt). Where the box is not wider than two first steps these are half its width.
Maximum maximise(const ValueAt& f, const Box& box, const Eigen::VectorXd& start, const MaximumSearch& search = {});

/// The same from the best place of a regular grid over the box, with half its spacing as first steps.
/// @param counts places along each number, 2 or more; of a number that is held 1. The last varies fastest
Maximum maximise_from_grid(const ValueAt& f, const Box& box, const std::vector<int>& counts,
                           const MaximumSearch& search = {});

/// A function to second order.
struct SecondOrder {
  double value = 0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;  ///< −∇², or what stands for it; eigenvalues that are not positive count as their size
};

/// By central differences of a step in each number; k² + k + 1 evaluations of k numbers.
/// @param at_once whether f may be called from several threads
SecondOrder second_order(const ValueAt& f, const Eigen::VectorXd& x, double step, bool at_once = false);

/// The step of Newton's method. Numbers that it would take beyond a bound end there, and the others where the model has
/// them best then; numbers at a bound to which the gradient leads stay there. @param longest of each number
Eigen::VectorXd newton_step(const SecondOrder& here, const Eigen::VectorXd& x, const Box& box, double longest);

struct NewtonOptions {
  double tolerance = 1e-4;  ///< of the value, which a further step would still gain
  double longest_step = 1;  ///< of each number
  int most_steps = 30;
  int most_halvings = 10;  ///< of a step
};

/// Where Newton's method ends.
struct NewtonMaximum {
  Eigen::VectorXd x;
  SecondOrder about;       ///< the model at x
  double gain = 0;         ///< what the model promises of a further step
  bool converged = false;  ///< whether that is below the tolerance
};

/// Maximises a function over a box by Newton's method, steps halved until the function rises: for functions that have
/// derivatives, or whose differences serve as such because all evaluations share their random numbers.
NewtonMaximum maximise_by_newton(const ValueAt& value, const std::function<SecondOrder(const Eigen::VectorXd&)>& model,
                                 const Box& box, const Eigen::VectorXd& start, const NewtonOptions& options = {});

}  // namespace pulson::matching
