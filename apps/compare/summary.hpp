#pragma once

#include <string>
#include <vector>

#include "pulson/compare/comparison.hpp"

namespace pulson {

/// The kernel that all models begin with, and whether each has a width of its own.
std::string kernel_words(const compare::CohortSettings& settings);

/// `sigma 0.5`, or that it is fitted.
std::string sigma_words(const compare::CohortSettings& settings);

void print_comparison(const compare::Comparison& comparison);

/// One line: which model explains the shapes best, or that they do not decide.
std::string verdict(const compare::Comparison& comparison);

/// The text with a capital first letter.
std::string as_title(std::string text);

void print_recovery(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                    const compare::RecoveryOptions& options);

/// A number as tables have it, "-" where there is none.
std::string number(double value, const char* format = "{:.3g}");

/// "beta = 0.24 (± 22 %)", where it may be more than twice as much its interval, "(at most 0.3)"; "(undetermined)"
/// where that has no ends; where it vanishes "beta = 0" and "lambda = ∞".
std::string fitted_text(const compare::FittedNumber& fitted);

}  // namespace pulson
