#include "saved_ensembles.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "pulson/core/parallel.hpp"
#include "shell/ranks.hpp"
#include "shell/units.hpp"

namespace pulson {

SavedEnsembles::SavedEnsembles(std::filesystem::path folder, records::UnitRun run) : folder_(std::move(folder)) {
  create_output_directory(folder_);
  const std::filesystem::path file = folder_ / "run.units";
  is_resumed_ = is_there(file);
  if (!is_resumed_) {
    write_file_atomically(file, unit_part(run));
    return;
  }
  try {
    resume_units(run, read_saved(file), file.string());
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("{}; repeat that run, remove '{}', or choose another folder", error.what(), folder_.string()));
  }
}

void SavedEnsembles::sample(records::EnsembleRun& run, const std::string& what, Progress& progress) const {
  if (Interrupt::came()) throw Interrupted();
  ensemble::Ensemble ensemble(run.system, run.integrator, run.start, run.options);
  run.options = ensemble.options();
  run.method = ensemble.method();
  run.threads = thread_count() * ranks::size();
  const std::filesystem::path checkpoint = folder_ / (ensemble_fingerprint(run) + ".ensemble");
  if (is_there(checkpoint)) ensemble.resume(read_ensemble_checkpoint(run, read_file(checkpoint), checkpoint.string()));
  run.sums = ensemble.sums();
  if (ensemble.done()) return;
  sample_blocks(ensemble, run, {.checkpoint = checkpoint, .keep = true, .what = what}, progress);
  if (run.partial()) throw Interrupted();
}

void SavedEnsembles::finish_units(records::UnitRun& run, int at_once,
                                  const std::function<void(int, int, records::UnitRun&)>& work) const {
  const std::filesystem::path file = folder_ / (unit_fingerprint(run) + ".units");
  if (is_there(file)) resume_units(run, read_saved(file), file.string());
  for (int first = static_cast<int>(run.results.size()); first < run.units; first += at_once) {
    if (Interrupt::came()) throw Interrupted();
    work(first, std::min(first + at_once, run.units), run);
    write_file_atomically(file, unit_part(run));
  }
}

void SavedEnsembles::remove() const {
  std::error_code error;
  std::filesystem::remove_all(folder_, error);
  if (error) print_warning(fmt::format("'{}' cannot be removed: {}", folder_.string(), error.message()));
}

}  // namespace pulson
