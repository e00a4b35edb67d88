#pragma once

#include "pulson/matching/registration.hpp"
#include "registration_problem.hpp"

namespace pulson::matching {

/// Registration::step_error of the momenta, increments, end points and cost of a `registration` that is a shot of them.
/// None where the momenta of that shot grow beyond all bounds. It costs about four sums of the kernel for each of twice
/// the steps.
std::optional<DiscretisationError> step_error(const MatchingProblem& problem, const Registration& registration);

/// Registration::amplification of a path: three products with ∂q(T)/∂q0 and its transpose (power iteration), of Heun's
/// method linearised at the recorded states. An estimate, mostly from below. Without noise it is of the landmarks that
/// have momenta, as the others act on nothing. None where it leaves the range of numbers.
std::optional<double> amplification(const StochasticSystem& system, const Trajectory& path);

}  // namespace pulson::matching
