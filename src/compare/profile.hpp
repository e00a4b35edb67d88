#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "newton.hpp"

namespace pulson::compare {

/// A log-likelihood that is cheap, about its maximum in a box.
struct Likelihood {
  std::function<double(const Eigen::VectorXd&)> value;
  std::function<SecondOrder(const Eigen::VectorXd&)> second_order;
  Box box;
  Eigen::VectorXd maximum;
};

/// By how much the log-likelihood of a number may be below its maximum for the number to be in the interval of 90 %:
/// half of 2.706, the quantile of χ² of one degree, but near the least value that the number can have. There, at a
/// distance of `from_bound` standard deviations, the maximum cannot lie where it would without the bound, and c with
///
///     Q(√c) + Q((c + d²)/(2d)) = 0.1   where d = from_bound < √c
///
/// covers 90 %, 1.642 at the bound; Q is the normal distribution's upper tail (G. Feldman and R. Cousins 1998).
double drop_of_ninety(double from_bound);

/// Far from any bound.
inline constexpr double kDropOfNinety = 2.70554 / 2;

/// The place of all numbers where a profile ends.
struct ProfileEnd {
  Eigen::VectorXd place;
  bool is_beyond = false;  ///< the box ends there, and not the profile
};

/// Where number i, in the direction ±1 from the maximum, has the farthest of the values t at which the profile, the
/// greatest log-likelihood with that number, is at most drop(t) below the maximum.
/// @param step with which an end is sought, about a standard deviation
/// @param others places from which it is sought too, as the likelihood may have several maxima
ProfileEnd profile_end(const Likelihood& likelihood, Eigen::Index i, int direction, double step,
                       const std::function<double(double)>& drop, const std::vector<Eigen::VectorXd>& others = {});

}  // namespace pulson::compare
