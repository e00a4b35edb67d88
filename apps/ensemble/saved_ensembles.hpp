#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

#include "records/unit_parts.hpp"
#include "sampling.hpp"

namespace pulson {

/// The user asked to stop; what there is is saved.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

/// A run of several ensembles, one after another, each of which has its checkpoint in a folder beside the results.
/// Those that are finished stay there until all are, so that a run that ended early, however that was, goes on after
/// them.
class SavedEnsembles {
 public:
  /// @param folder such as `out/sweep.partial`; made where it is missing
  /// @param run its verb, settings and shapes, and 1 unit
  /// @throws InputError that names what differs where the folder is of another run
  SavedEnsembles(std::filesystem::path folder, records::UnitRun run);

  /// Whether the folder was there.
  bool is_resumed() const { return is_resumed_; }

  /// Samples `run` to its end, from its checkpoint where there is one. The caller holds an Interrupt.
  /// @param what for the line of progress @throws Interrupted; InputError where the noise or the integrator refuse it
  void sample(records::EnsembleRun& run, const std::string& what, Progress& progress) const;

  /// The same for units of other work: `work` does those from `first` up to `last` and adds their results.
  /// @param at_once units between looks at the user
  void finish_units(records::UnitRun& run, int at_once,
                    const std::function<void(int first, int last, records::UnitRun& run)>& work) const;

  /// After the results were written.
  void remove() const;

 private:
  std::filesystem::path folder_;
  bool is_resumed_ = false;
};

}  // namespace pulson
