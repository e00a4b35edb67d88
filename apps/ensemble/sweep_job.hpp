#pragma once

#include <string>

#include "shell/outputs.hpp"
#include "sweep.hpp"

namespace pulson {

/// `pulson ensemble --sweep`.
struct SweepJob {
  records::EnsembleRun base;  ///< what all ensembles have in common
  SweepValues sweep;
  std::string settings;  ///< all options on which the results depend
  bool resume = false;
  const OutputOptions& output;
};

/// @return the exit code @throws InputError
int run_sweep(const SweepJob& job);

}  // namespace pulson
