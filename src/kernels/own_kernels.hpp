#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pair_sums.hpp"
#include "pulson/kernels/own_kernel.hpp"

namespace pulson {

/// Whether a profile is one of name_kernel(), which vector code does not know.
bool is_own(KernelProfile profile);
bool has_own(const std::vector<KernelTerm>& terms);

/// @throws InputError where it lives no more
std::shared_ptr<const OwnProfile> own_profile(KernelProfile profile);
std::string own_kernel_name(KernelProfile profile);

/// The term that a row of the table makes of its parameters.
MakeKernelTerm term_maker(KernelProfile profile);

/// kernel_table() with the rows of name_kernel().
NameTable<MakeKernelTerm> table_with_own_kernels();

/// Σ_terms w k(|z|/α) at several s = |z|², with the derivatives of RadialJet up to `order`.
std::vector<RadialJet> jets_of(const std::vector<KernelTerm>& terms, const Eigen::ArrayXd& s, int order);

/// add_pair_sums() of all terms and targets, in plain loops.
void add_plain_pair_sums(const PairSumArguments& arguments, const std::vector<KernelTerm>& terms);

/// K(x_i − y_j), M×N, from one call for all pairs.
Eigen::MatrixXd plain_gram(const std::vector<KernelTerm>& terms, const Points& x, const Points& y);

}  // namespace pulson
