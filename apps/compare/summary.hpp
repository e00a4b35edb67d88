#pragma once

#include "pulson/compare/comparison.hpp"
#include "pulson/compare/recovery.hpp"

namespace pulson {

void print_comparison(const Comparison& comparison);

/// A line that says which model the shapes call for, or that they do not tell.
std::string verdict(const Comparison& comparison);

void print_recovery(const std::vector<RecoveryRow>& rows, const std::vector<std::string>& candidates,
                    const RecoveryOptions& options);

}  // namespace pulson
