#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pulson/records/records.hpp"
#include "shell/messages.hpp"

namespace pulson {

/// Where the sums of an ensemble are saved while it is sampled, and how far.
struct SamplingPlan {
  std::filesystem::path checkpoint;          ///< written every ten seconds, and at the end of what is partial
  std::optional<std::int64_t> stop_after{};  ///< samples
  bool keep = false;                         ///< whether the sums are saved at the end in any case
  std::string what{};                        ///< what the line of progress begins with
};

/// Samples the remaining paths of the ensemble on all threads of all ranks, until all paths are there or a signal
/// comes; the caller holds an Interrupt. The sums go to `run`, on rank 0.
void sample_blocks(ensemble::Ensemble& ensemble, records::EnsembleRun& run, const SamplingPlan& plan,
                   Progress& progress);

}  // namespace pulson
