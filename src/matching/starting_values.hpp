#pragma once

#include "core/open_numbers.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// The specification of a noise with numbers for those that are to be fitted and have neither a starting value nor a
/// default. To first order about the source at rest, and in the mean over the targets, the momenta and each such
/// amplitude explain equal shares of the variance of the displacements beyond σ; ranges, such as `gamma`, are the
/// squared width of the kernel. With as few as 16 draws of the increments: it is where a search begins.
/// @throws InputError as make_problem(), or where the noise moves no landmark to first order
std::string with_starting_values(const OpenSpec& noise, const Landmarks& source, const std::vector<Landmarks>& targets,
                                 RegistrationOptions options);

}  // namespace pulson::matching
