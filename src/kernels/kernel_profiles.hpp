#pragma once

#include <span>
#include <string_view>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// All that the scalar code knows of a profile. A new kernel needs its value of KernelProfile, its entry in
/// kernel_profiles.cpp, and its vector code: a struct in profiles_body.hpp, chosen in pair_sums_body.hpp.
struct ProfileFacts {
  KernelProfile profile;
  std::string_view name;
  std::string_view help;
  double lipschitz;                          ///< sup |k'| for α = 1
  RadialJet (*jet)(double alpha, double s);  ///< of weight 1, at s = |z|²
};

/// Every profile, in the order of KernelProfile.
std::span<const ProfileFacts> kernel_profiles();

const ProfileFacts& facts_of(KernelProfile profile);

}  // namespace pulson
