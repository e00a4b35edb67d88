#pragma once

#include <string>

#include "arguments.hpp"
#include "records/unit_parts.hpp"

namespace pulson {

/// `pulson compare --simulate`. @param settings the options, see settings_of() @return the exit code
int run_study(const CompareArguments& arguments, const std::string& settings);

/// Writes what run_study() would have, from the parts of such a run. @return the exit code
int merge_study(const records::UnitRun& whole, const OutputOptions& output);

}  // namespace pulson
