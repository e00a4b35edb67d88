// `pulson ensemble`: Monte Carlo over sample paths.

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/records/records.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/ranks.hpp"
#include "shell/units.hpp"
#include "shell/verbs.hpp"
#include "simulate/start_options.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr double kCheckpointSeconds = 10;
constexpr double kPieceSeconds = 1.0 / 3;
constexpr std::int64_t kMostSamples = 10'000'000'000;
constexpr std::int64_t kMostKept = 400'000'000;    // numbers: 3.2 GB
constexpr std::int64_t kMostHistograms = 100'000;  // of 512 bins: 200 MB

struct EnsembleArguments {
  StartOptions start;
  TimeOptions time{.time = {}, .steps = 20, .dt = 0.02};
  ensemble::EnsembleOptions options;
  std::string integrator = "variational";
  int records = 101;
  std::vector<double> densities;
  std::string shard;
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

/// Consecutive blocks, as they are dealt out.
struct Blocks {
  std::int64_t first = 0;
  std::int64_t count = 0;
};

/// Deals out blocks and puts their sums together, in the order of the paths, whatever order they come in.
class Sampling {
 public:
  Sampling(ensemble::Ensemble& ensemble, records::EnsembleRun& run, const EnsembleArguments& arguments)
      : ensemble_(ensemble),
        run_(run),
        checkpoint_(arguments.checkpoint()),
        dealt_(ensemble.blocks_done()),
        end_(std::clamp(blocks_in(arguments.stop_after.value_or(run.options.samples)), dealt_, ensemble.blocks())),
        first_(ensemble.blocks_done()) {}

  /// Until all paths are there or a signal comes; saves the sums every so often.
  void run() {
    ranks::share<Blocks, ensemble::EnsembleSums>(
        {.next = [this] { return next(); },
         .work = [this](const Blocks& blocks) { return ensemble_.sample(blocks.first, blocks.count); },
         .take = [this](const Blocks& blocks, ensemble::EnsembleSums sums) { take(blocks, std::move(sums)); },
         .to_bytes = [](const ensemble::EnsembleSums& sums) { return bytes_of(sums); },
         .of_bytes = [](std::string_view bytes) { return ensemble::sums_of_bytes(bytes); }});
    run_.sums = ensemble_.sums();
    run_.seconds = seconds_now() - begin_;
    if (ranks::is_first() && (run_.partial() || saved_ > begin_ || run_.options.shard.count > 1)) save();
  }

 private:
  static std::int64_t blocks_in(std::int64_t samples) {
    return (samples + ensemble::kBlockPaths - 1) / ensemble::kBlockPaths;
  }

  // So many that they take a third of a second, and fewer where few are left, so that all threads end together.
  std::optional<Blocks> next() {
    if (dealt_ == end_) return std::nullopt;
    const auto done = static_cast<double>(ensemble_.blocks_done() - first_);
    const auto in_time =
        static_cast<std::int64_t>(done / std::max(1e-3, seconds_now() - begin_) / threads_ * kPieceSeconds);
    const auto in_turn = static_cast<std::int64_t>(static_cast<double>(end_ - dealt_) / (2 * threads_));
    last_ = std::max<std::int64_t>(1, std::min({in_time, in_turn, 2 * last_}));
    const Blocks blocks{dealt_, last_};
    dealt_ += blocks.count;
    return blocks;
  }

  void take(const Blocks& blocks, ensemble::EnsembleSums sums) {
    waiting_.emplace(blocks.first, std::move(sums));
    for (auto found = waiting_.find(ensemble_.blocks_done()); found != waiting_.end();
         found = waiting_.find(ensemble_.blocks_done())) {
      ensemble_.append(found->second);
      waiting_.erase(found);
    }
    const std::int64_t samples = ensemble_.sums().samples;
    progress_.show(static_cast<double>(ensemble_.blocks_done()) / static_cast<double>(end_),
                   fmt::format("{} of {} paths", samples, run_.options.shard_samples()));
    const double time = seconds_now();
    if (time - saved_ < kCheckpointSeconds) return;
    saved_ = time;
    run_.sums = ensemble_.sums();
    save();
  }

  void save() const { write_file_atomically(checkpoint_, ensemble_checkpoint(run_)); }

  const Interrupt interrupt_;
  Progress progress_;
  ensemble::Ensemble& ensemble_;
  records::EnsembleRun& run_;
  fs::path checkpoint_;
  double threads_ = thread_count() * ranks::size();
  double begin_ = seconds_now();
  double saved_ = begin_;
  std::int64_t dealt_;
  std::int64_t end_;
  std::int64_t first_;
  std::int64_t last_ = 1;                                   // blocks dealt out together
  std::map<std::int64_t, ensemble::EnsembleSums> waiting_;  // for those before them
};

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
  Sampling(ensemble, run, arguments).run();
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
  verb->add_option("--integrator", arguments->integrator, "see pulson info integrators")
      ->type_name("NAME")
      ->capture_default_str();
  arguments->time.add_to(*verb, "100 with --q, else 1, or that of --from");
  verb->add_option("--samples", arguments->options.samples, "number of paths")->capture_default_str();
  verb->add_flag("--antithetic", arguments->options.antithetic, "paths in pairs with opposite noise");
  add_seed_option(*verb, arguments->options.seed);
  verb->add_option("--bound", arguments->options.momentum_bound, "momentum beyond which a path counts as lost")
      ->capture_default_str();
  verb->add_option("--records", arguments->records, "number of evenly spaced times at which statistics are taken")
      ->capture_default_str();
  verb->add_option("--densities", arguments->densities, "additional times with statistics and histograms")
      ->type_name("TIMES")
      ->delimiter(',');
  verb->add_flag("--resume", arguments->resume, "continue from what is saved in the folder");
  verb->add_option("--stop-after", arguments->stop_after, "stop after this many samples; continue with --resume");
  verb->add_option("--shard", arguments->shard, "sample part i of n, for pulson merge")->type_name("i/n");
  add_threads_option(*verb);
  arguments->results.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out\n"
      "  pulson ensemble --shape wings.tps#1 --noise ch-sd:beta=0.1 --samples 10000 -o out\n"
      "  pulson ensemble --from out/registration.json --samples 2000 --save-final ends.npy -o out\n"
      "  pulson ensemble --from out/registration.json --shard 3/8 -o parts\n"
      "Ctrl-C writes the results so far, marked partial; --resume continues to the same result, bit for bit.\n"
      "Exit codes: 0 done, 2 bad input, 3 partial, or not all paths are clean (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_ensemble(*arguments); });
}

}  // namespace pulson
