#pragma once

#include <string>

#include "pulson/records/records.hpp"
#include "shell/outputs.hpp"

namespace pulson {

/// What `ensemble` and `merge` write of an ensemble.
struct EnsembleOutput {
  std::string save_final;
  std::string save_paths;
  OutputOptions output;

  void add_to(CLI::App& verb);
  /// @throws InputError where a file cannot be written
  void check() const;
  /// Writes all files or none, prints the summary, notes and warnings. @return the exit code
  int finish(const records::EnsembleRun& run) const;
};

}  // namespace pulson
