#pragma once

#include <string>
#include <vector>

#include "pulson/compare/comparison.hpp"

namespace pulson {

/// What the picture and the page are called by: that the models do not explain the shapes, else the verdict.
std::string headline(const compare::Comparison& comparison);

/// "none of these models explains the variances of 12 of 19 landmarks"; empty where the best one explains all that is
/// checked, or nothing was checked.
std::string misfit(const compare::Comparison& comparison);

/// The verdict, after what the models do not explain.
std::string finding(const compare::Comparison& comparison);

/// "is the same for sigma from 0.25 to 1", or "depends on sigma" and where it changes; empty where there is no profile.
std::string sigma_range(const compare::Comparison& comparison);

/// How often cohorts like this one would reveal each noise; empty where that was not found.
std::string recognition_words(const compare::Comparison& comparison);

/// By how much the evidences were corrected for the steps, and their differences.
std::string steps_words(const compare::Comparison& comparison);

/// That more steps might change the verdict, and how many would not; empty where they would not.
std::string steps_warning(const compare::Comparison& comparison);

/// What was asked, what was found, how sure that is, and what would change it.
std::vector<std::string> four_sentences(const compare::Comparison& comparison);

}  // namespace pulson
