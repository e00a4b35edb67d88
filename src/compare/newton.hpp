#pragma once

#include <functional>

#include <Eigen/Core>

namespace pulson::compare {

/// Bounds of each number.
struct Box {
  Eigen::VectorXd least, most;
  Eigen::VectorXd clipped(const Eigen::VectorXd& x) const { return x.cwiseMax(least).cwiseMin(most); }
};

/// A function to second order.
struct SecondOrder {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;  ///< −∇², or what stands for it; eigenvalues that are not positive count as their size
};

/// The step of Newton's method. Numbers that it would take beyond a bound end there, and the others where the model has
/// them best then; numbers at a bound to which the gradient leads stay there. @param longest of each number
Eigen::VectorXd newton_step(const SecondOrder& here, const Eigen::VectorXd& x, const Box& box, double longest);

/// Where a function is greatest.
struct BoxMaximum {
  Eigen::VectorXd x;
  double value = 0;
  bool converged = false;
};

struct NewtonOptions {
  double tolerance = 1e-4;  ///< of the value, which a further step would still gain
  double longest_step = 1;  ///< of each number
  int most_steps = 30;
};

/// Maximises a function over a box by Newton's method, steps halved until the function rises; numbers at a bound to
/// which the gradient leads stay there.
/// @param value −∞ where there is none, but not at the start @param model at the place where value() rose last
BoxMaximum maximise_in_box(const std::function<double(const Eigen::VectorXd&)>& value,
                           const std::function<SecondOrder(const Eigen::VectorXd&)>& model, const Box& box,
                           const Eigen::VectorXd& start, const NewtonOptions& options = {});

}  // namespace pulson::compare
