#pragma once

#include <string>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson {

/// What a user of the recorded path should know, a line each, the likeliest remedy first: not converged, not matched.
/// Every verb that reads a registration repeats them.
std::vector<std::string> path_warnings(const matching::Registration& registration);

/// The same for a user of the momenta: also that an accurate integrator changes the cost by more than 1 %, or that they
/// alone do not reproduce a path that was recorded.
std::vector<std::string> momenta_warnings(const matching::Registration& registration);

/// The same for a user of the result, which is the path where its states are recorded, else a shot of the momenta.
std::vector<std::string> result_warnings(const matching::Registration& registration);

/// Where an accurate integrator takes the momenta, as in "an accurate integrator ends 0.017 away, cost +3.1 %", or that
/// they alone do not reproduce the path; empty where it ends within 1e-4 of the diameter and changes the cost by at
/// most 1 %.
std::string accuracy_text(const matching::Registration& registration);

}  // namespace pulson
