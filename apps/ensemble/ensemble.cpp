// `pulson ensemble`: Monte Carlo over sample paths.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "picture.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/records/records.hpp"
#include "results.hpp"
#include "sampling.hpp"
#include "shell/help_groups.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/ranks.hpp"
#include "shell/units.hpp"
#include "shell/verbs.hpp"
#include "simulate/start_options.hpp"
#include "sweep_job.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMostSamples = 10'000'000'000;
constexpr std::int64_t kMostKept = 400'000'000;    // numbers: 3.2 GB
constexpr std::int64_t kMostHistograms = 100'000;  // of 512 bins: 200 MB

struct EnsembleArguments {
  StartOptions start;
  TimeOptions time = TimeOptions::of(matching::path_defaults());
  ensemble::EnsembleOptions options;
  std::string integrator = matching::path_defaults().integrator.value;
  int records = 101;
  std::vector<double> densities;
  std::string shard;
  std::string sweep;
  std::optional<std::int64_t> stop_after;
  bool resume = false;
  EnsembleOutput results;

  /// Where the sums are kept: of a shard for good.
  fs::path checkpoint() const {
    const ensemble::Shard& part = options.shard;
    return results.output.file(part.count == 1 ? "ensemble.partial"
                                               : fmt::format("part-{}-of-{}.ensemble", part.index, part.count));
  }
};

void sort_unique(std::vector<int>& steps) {
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
}

/// The step nearest to each time, and the last.
std::vector<int> density_steps(const std::vector<double>& times, const TimeGrid& grid) {
  std::vector<int> steps = {grid.steps};
  for (const double time : times) {
    if (!(time >= 0 && time <= grid.time))
      throw InputError(fmt::format("--densities: {} is not a time from 0 to {}", time, grid.time));
    steps.push_back(static_cast<int>(std::lround(time / grid.dt())));
  }
  sort_unique(steps);
  return steps;
}

void check_numbers(const EnsembleArguments& arguments) {
  const ensemble::EnsembleOptions& options = arguments.options;
  if (options.samples < 1 || options.samples > kMostSamples)
    throw InputError(fmt::format("--samples is {}; it must be from 1 to {}", options.samples, kMostSamples));
  if (options.antithetic && options.samples % 2 != 0)
    throw InputError(fmt::format("--samples is {}; with --antithetic it must be even", options.samples));
  if (!(options.momentum_bound > 0))
    throw InputError(fmt::format("--bound is {}; it must be greater than 0", options.momentum_bound));
  if (arguments.records < 2) throw InputError(fmt::format("--records is {}; it must be at least 2", arguments.records));
  if (arguments.stop_after && *arguments.stop_after < 1)
    throw InputError(fmt::format("--stop-after is {}; it must be at least 1", *arguments.stop_after));
}

// Where `densities` are to be written; histograms for quantiles are taken at all records where they are not too many.
ensemble::EnsembleOptions ensemble_options(const EnsembleArguments& arguments, const Start& start,
                                           const std::vector<int>& densities, const TimeGrid& grid) {
  check_numbers(arguments);
  ensemble::EnsembleOptions options = arguments.options;
  options.grid = grid;
  options.records = ensemble::spread_steps(grid, arguments.records);
  options.records.insert(options.records.end(), densities.begin(), densities.end());
  sort_unique(options.records);
  const std::int64_t coordinates = 2 * start.state.q.size();
  const auto histograms = [&](const std::vector<int>& steps) {
    return static_cast<std::int64_t>(steps.size()) * coordinates;
  };
  options.histograms = histograms(options.records) <= kMostHistograms / 10 ? options.records : densities;
  if (histograms(options.histograms) > kMostHistograms)
    throw InputError(fmt::format("densities of {} coordinates at {} times are too many; ask for fewer times",
                                 coordinates, options.histograms.size()));
  if (!arguments.results.save_paths.empty())
    options.keep = ensemble::KeepStates::kAll;
  else if (!arguments.results.save_final.empty())
    options.keep = ensemble::KeepStates::kFinal;
  if (keeps_for_picture(options, start.state)) options.keep = ensemble::KeepStates::kAll;
  if (const std::int64_t numbers = options.kept_numbers(start.state) * options.samples; numbers > kMostKept)
    throw InputError(
        fmt::format("the states to keep are {} numbers, and the limit is {}: use fewer --records or --samples", numbers,
                    kMostKept));
  return options;
}

// @return whether sums are saved, to go on from
bool check_outputs(const EnsembleArguments& arguments) {
  const fs::path checkpoint = arguments.checkpoint();
  if (arguments.options.shard.count > 1) {
    arguments.results.output.check_only(checkpoint.filename().string());
  } else {
    arguments.results.check();
    check_result_file(checkpoint, "--out");
  }
  return saved_before(checkpoint, arguments.resume, arguments.options.shard.count > 1);
}

int finish_shard(const records::EnsembleRun& run, const EnsembleArguments& arguments) {
  print_notes(run.notes);
  const ensemble::Shard& part = run.options.shard;
  if (arguments.results.output.prints())
    print_text("part {} of {}: {} of its {} paths in {}\n", part.index, part.count, run.sums.samples,
               run.options.shard_samples(), arguments.checkpoint().string());
  if (!run.partial()) return kDone;
  print_warning(
      fmt::format("partial: {} of {} paths; continue with --resume", run.sums.samples, run.options.shard_samples()));
  return kNotConverged;
}

// All that a sweep has no use for: it writes nothing but crossings.
void check_sweep_options(const CLI::App& verb) {
  for (const char* const option :
       {"--densities", "--records", "--save-final", "--save-paths", "--shard", "--stop-after"})
    if (verb.count(option) > 0)
      throw InputError(
          fmt::format("--sweep and {} cannot be combined: of each value there are the crossings and the "
                      "counts of paths alone",
                      option));
  if (ranks::size() > 1)
    throw InputError(fmt::format("--sweep is for one process, and there are {} ranks", ranks::size()));
}

int run_ensemble_sweep(EnsembleArguments arguments, const CLI::App& verb) {
  check_sweep_options(verb);
  const SweepValues sweep = parse_sweep(arguments.sweep);
  if (arguments.start.noise) arguments.start.noise = with_parameter(*arguments.start.noise, sweep.parameter);
  const Start start = arguments.start.start();
  check_numbers(arguments);
  ensemble::EnsembleOptions options = arguments.options;
  options.grid = arguments.time.grid(start.default_time);
  records::EnsembleRun base{start.system, arguments.integrator, start.shape, start.state, options, {}, {}, "", 1, 0};
  base.notes = start.notes;
  return run_sweep({std::move(base), sweep, settings_of(verb), arguments.resume, arguments.results.output});
}

int run_ensemble(EnsembleArguments arguments) {
  if (!arguments.shard.empty()) arguments.options.shard = parse_shard(arguments.shard);
  const Start start = arguments.start.start();
  const TimeGrid grid = arguments.time.grid(start.default_time);
  const std::vector<int> densities = density_steps(arguments.densities, grid);
  const ensemble::EnsembleOptions options = ensemble_options(arguments, start, densities, grid);
  const bool saved = ranks::is_first() && check_outputs(arguments);
  ensemble::Ensemble ensemble(start.system, arguments.integrator, start.state, options);
  records::EnsembleRun run{start.system,
                           arguments.integrator,
                           start.shape,
                           start.state,
                           ensemble.options(),
                           densities,
                           {},
                           ensemble.method(),
                           thread_count() * ranks::size(),
                           0};
  run.notes = start.notes;
  const fs::path checkpoint = arguments.checkpoint();
  const bool is_shard = options.shard.count > 1;
  if (saved) ensemble.resume(read_ensemble_checkpoint(run, read_file(checkpoint), checkpoint.string()));
  if (arguments.resume && !is_shard) {
    const bool is_done = ranks::is_first() && !saved &&
                         is_done_before(arguments.results.output.file("ensemble.json"), ensemble_fingerprint(run));
    if (ranks::gather(is_done ? "1" : "") == "1") return kDone;
  }
  log_step(fmt::format("{} landmarks, {} steps, {}", start.shape.count(), grid.steps, run.method));
  const Interrupt interrupt;
  Progress progress;
  sample_blocks(ensemble, run, {.checkpoint = checkpoint, .stop_after = arguments.stop_after, .keep = is_shard},
                progress);
  progress.clear();
  if (!ranks::is_first()) return kDone;
  log_step(fmt::format("sampled {} paths", run.sums.samples));
  if (is_shard) return finish_shard(run, arguments);
  const int code = arguments.results.finish(run);
  if (!run.partial()) remove_saved(checkpoint);
  return code;
}

}  // namespace

void add_ensemble_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("ensemble", "Sample many paths: crossing probability, mean paths, densities");
  auto arguments = std::make_shared<EnsembleArguments>();
  arguments->start.add_to(*verb);
  add_flip_option(*verb, arguments->start.reading);
  begin_group(*verb, more(kModelGroup));
  verb->add_option("--integrator", arguments->integrator, "see pulson info integrators")
      ->type_name("NAME")
      ->capture_default_str();
  begin_group(*verb, kModelGroup);
  arguments->time.add_to(*verb, "100 with --q, else 1, or that of --from");
  begin_group(*verb, kSamplingGroup);
  verb->add_option("--samples", arguments->options.samples, "number of paths")->capture_default_str();
  verb->add_flag("--antithetic", arguments->options.antithetic, "paths in pairs with opposite noise");
  add_seed_option(*verb, arguments->options.seed);
  begin_group(*verb, more(kSamplingGroup));
  verb->add_option("--bound", arguments->options.momentum_bound, "momentum beyond which a path counts as lost")
      ->capture_default_str();
  verb->add_option("--records", arguments->records, "number of evenly spaced times at which statistics are taken")
      ->capture_default_str();
  begin_group(*verb, kSamplingGroup);
  verb->add_option("--densities", arguments->densities, "additional times with statistics and histograms")
      ->type_name("TIMES")
      ->delimiter(',');
  verb->add_flag("--resume", arguments->resume, "continue from what is saved in the folder");
  begin_group(*verb, more(kSamplingGroup));
  verb->add_option("--stop-after", arguments->stop_after, "stop after this many samples; continue with --resume");
  begin_group(*verb, kSamplingGroup);
  verb->add_option("--sweep", arguments->sweep,
                   "the probability of crossing for several values of a number of the noise or kernel: "
                   "beta=0:6.5:0.25 or kernel.alpha=0.5,1,2")
      ->type_name("NAME=VALUES");
  verb->add_option("--shard", arguments->shard, "sample part i of n, for pulson merge")->type_name("i/n");
  begin_group(*verb, more(kSamplingGroup));
  add_threads_option(*verb);
  arguments->results.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out\n"
      "  pulson ensemble --shape wings.tps#1 --noise ch-sd:beta=0.1 --samples 10000 -o out\n"
      "  pulson ensemble --from out/registration.json --samples 2000 --save-final ends.npy -o out\n"
      "  pulson ensemble --from out/registration.json --shard 3/8 -o parts\n"
      "  pulson ensemble --q 0,10 --p 4,1 --noise ch-sd:on=2 --sweep beta=0:6.5:0.25 -o out\n"
      "Ctrl-C writes the results so far, marked partial; --resume continues to the same result, bit for bit.\n"
      "Exit codes: 0 done, 2 bad input, 3 partial, or not all paths are clean (results are written).");
  verb->callback([arguments, verb, &exit_code] {
    exit_code = arguments->sweep.empty() ? run_ensemble(*arguments) : run_ensemble_sweep(*arguments, *verb);
  });
}

}  // namespace pulson
