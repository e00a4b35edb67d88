#include <string>

#include "core/checksum.hpp"
#include "fuzz_targets.hpp"
#include "fuzzing.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"

namespace pulson::fuzz {
namespace {

/// Whether replaying it takes a moment only.
bool is_short(const matching::Registration& registration) {
  return registration.source.count() <= 8 && registration.grid.steps <= 8 && registration.samples <= 4 &&
         registration.increments.rows() <= 64;
}

/// A checkpoint belongs to one version and vector target, and ends with its checksum; seeds have marks in their places,
/// and no checksum.
std::string with_marks_replaced(std::string_view input) {
  std::string bytes(input);
  for (const auto& [mark, text] : {std::pair{std::string("\x67@target"), vector_target()},
                                   std::pair{std::string("\x68@version"), std::string(version())}})
    if (const std::size_t at = bytes.find(mark); at != std::string::npos)
      bytes.replace(at, mark.size(), static_cast<char>(0x60 + text.size()) + text);
  return sealed(std::move(bytes));
}

/// One that the seeds in corpus/ belong to.
records::EnsembleRun checkpoint_run() {
  ensemble::EnsembleOptions options;
  options.grid = {0.5, 2};
  options.samples = 128;
  options.antithetic = true;
  options.records = {0, 2};
  options.histograms = {2};
  options.keep = ensemble::KeepStates::kFinal;
  Landmarks shape;
  shape.points = Eigen::RowVector2d(0, 1);
  return {{make_kernel("gaussian:alpha=1", {}), make_noise("ch-sd:beta=1")},
          "variational",
          shape,
          {shape.points, Eigen::RowVector2d(1, -1)},
          options,
          {2},
          {},
          {}};
}

}  // namespace

bool registration_records(std::string_view input) {
  const MemoryFile file(input);
  const auto registration = attempt([&] { return records::read_registration(file.path()); });
  if (!registration) return true;
  const auto text = attempt([&] { return records::registration_json(*registration, {}); });
  if (!text) return true;
  const MemoryFile copy(*text);
  const matching::Registration back =
      demand("a record that is written is not read", [&] { return records::read_registration(copy.path()); });
  require(records::registration_json(back, {}) == *text, "a record changes when it is written and read");
  attempt([&] { return records::residuals_csv(*registration, {}); });
  if (is_short(*registration))
    attempt<Error>([&] { return records::trajectory_csv(*registration, matching::replay(*registration)); });
  return true;
}

bool ensemble_checkpoints(std::string_view input) {
  records::EnsembleRun run = checkpoint_run();
  const std::string bytes = with_marks_replaced(input);
  const auto sums = attempt([&] { return read_ensemble_checkpoint(run, bytes, "f"); });
  if (!sums) return true;
  ensemble::Ensemble ensemble(run.system, run.integrator, run.start, run.options);
  const auto resumed = attempt([&] {
    ensemble.resume(*sums);
    return true;
  });
  if (!resumed) return true;
  while (!ensemble.done()) ensemble.advance(1);
  run.sums = ensemble.sums();
  attempt<Error>([&] { return ensemble_json(run); });  // sums that a file claims may overflow
  ensemble_means_csv(run);
  ensemble_densities_csv(run);
  const auto part = attempt([&] { return records::read_ensemble_part(bytes, "f"); });
  if (part) attempt([&] { return records::merge_ensembles({*part}, {"f"}); });
  demand("a checkpoint that is written is not read",
         [&] { return read_ensemble_checkpoint(run, ensemble_checkpoint(run), "f"); });
  return true;
}

}  // namespace pulson::fuzz
