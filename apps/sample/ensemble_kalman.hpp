#pragma once

#include "arguments.hpp"

namespace pulson {

/// `pulson sample --method enkf`. @param verb whose options were given @return the exit code
int run_ensemble_kalman(const SampleArguments& arguments, const CLI::App& verb);

}  // namespace pulson
