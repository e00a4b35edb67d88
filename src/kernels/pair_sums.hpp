#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// All that the scalar code knows of a profile. A new kernel needs its value of KernelProfile, its entry in
/// kernel_table.cpp, and its vector code: a struct in profiles_body.hpp, chosen in pair_sums.cpp.
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

/// The sums over pairs that KernelOperator is made of; z = x_i − y_j. Targets carry u, v, w and sources a, b, c.
enum class PairSum {
  kApply,          ///< Σ_j K a_j
  kApplyJacobian,  ///< Σ_j K a_j and Σ_j a_j ∇Kᵀ (d + d² rows)
  kTangent,        ///< Σ_j a_j ∇K·(u_i − b_j)
  kGradient,       ///< Σ_j (u_i·b_j + v_i·a_j) ∇K, where targets carry (u, v) = sources' (a, b)
  kHessian,        ///< Σ_j (v_i·a_j) ∇²K (u_i − b_j)
  kFlow,           ///< kApply and Σ_j (v_i·a_j) ∇K (2d rows)
  kFlowTangent,    ///< Σ_j K c_j + kTangent, and kHessian + Σ_j (w_i·a_j + v_i·c_j) ∇K (2d rows)
};

/// Targets are processed in blocks of this many. Arrays over targets are padded to a multiple of it, of a single block
/// to whole vectors.
inline constexpr std::size_t kTargetBlock = 64;

/// Coordinate-major arrays: row c of x is x + c·target_stride, of y, a, b, c likewise with source_stride.
struct PairSumArguments {
  PairSum sum = PairSum::kApply;
  int dimension = 2;
  KernelTerm term;
  std::size_t targets = 0;
  std::size_t sources = 0;
  std::size_t target_stride = 0;
  std::size_t source_stride = 0;
  const double* x = nullptr;
  const double* u = nullptr;
  const double* v = nullptr;
  const double* w = nullptr;
  const double* y = nullptr;
  const double* a = nullptr;
  const double* b = nullptr;
  const double* c = nullptr;
  double* out = nullptr;  ///< rows of target_stride, added to
};

/// Adds the sums of the targets first … min(first + kTargetBlock, targets) − 1 to `out`, with the best vector target of
/// this machine. Entries beyond `targets` up to the padded end are scratch.
void add_pair_sums(const PairSumArguments& arguments, std::size_t first);

/// Vector lanes of the chosen target.
std::size_t vector_lanes();

}  // namespace pulson
