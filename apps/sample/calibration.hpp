#pragma once

#include <string>

#include "arguments.hpp"
#include "records/unit_parts.hpp"

namespace pulson {

/// `pulson sample --calibrate`. @param settings the options, see settings_of() @return the exit code
int run_calibration(const SampleArguments& arguments, const std::string& settings);

/// Writes what run_calibration() would have, from the parts of such a run. @return the exit code
int merge_calibration(const records::UnitRun& whole, const OutputOptions& output);

}  // namespace pulson
