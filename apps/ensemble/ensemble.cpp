// `pulson ensemble`: Monte Carlo over sample paths.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "picture.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/records/records.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/report_parts.hpp"
#include "shell/verbs.hpp"
#include "simulate/start_options.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr double kCheckpointSeconds = 10;
constexpr std::int64_t kBlock = 64;  // paths
constexpr int kBlocksAtOnce = 16;    // for each thread
constexpr std::int64_t kMostSamples = 10'000'000'000;
constexpr std::int64_t kMostKept = 400'000'000;    // numbers: 3.2 GB
constexpr std::int64_t kMostHistograms = 100'000;  // of 512 bins: 200 MB
const std::string kCheckpoint = "ensemble.partial";

struct EnsembleArguments {
  StartOptions start;
  TimeOptions time{.time = {}, .steps = 20, .dt = 0.02};
  ensemble::EnsembleOptions options;
  std::string integrator = "variational";
  int records = 101;
  std::vector<double> densities;
  std::string save_final;
  std::string save_paths;
  std::optional<std::int64_t> stop_after;
  bool resume = false;
  OutputOptions output;
};

const std::vector<std::string> kEnsembleFiles = {"ensemble.json", "means.csv", "densities.csv", "report.html"};
const std::vector<std::string> kEnsemblePictures = {"ensemble"};

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
  if (!arguments.save_paths.empty())
    options.keep = ensemble::KeepStates::kAll;
  else if (!arguments.save_final.empty())
    options.keep = ensemble::KeepStates::kFinal;
  if (const std::int64_t numbers = options.kept_numbers(start.state) * options.samples; numbers > kMostKept)
    throw InputError(
        fmt::format("the states to keep are {} numbers, and the limit is {}: use fewer --records or --samples", numbers,
                    kMostKept));
  return options;
}

void check_outputs(const EnsembleArguments& arguments) {
  arguments.output.check(kEnsembleFiles, kEnsemblePictures);
  const fs::path checkpoint = arguments.output.file(kCheckpoint);
  check_output_file(checkpoint);
  if (fs::exists(checkpoint) && !arguments.resume)
    throw InputError(fmt::format(
        "'{}' belongs to an unfinished run: continue it with --resume, remove the file, or choose another folder",
        checkpoint.string()));
  for (const std::string& file : {arguments.save_final, arguments.save_paths})
    if (!file.empty()) check_output_file(file);
}

std::string file_contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("there is nothing to resume: '{}' cannot be read", path.string()));
  return {std::istreambuf_iterator<char>(file), {}};
}

// Samples until all paths are there or a signal comes; saves the sums every so often.
void sample(ensemble::Ensemble& ensemble, records::EnsembleRun& run, const EnsembleArguments& arguments) {
  const Interrupt interrupt;
  Progress progress;
  const fs::path checkpoint = arguments.output.file(kCheckpoint);
  const double begin = seconds_now();
  const std::int64_t first = ensemble.sums().samples;
  const std::int64_t enough = arguments.stop_after.value_or(run.options.samples);
  double saved = begin;
  int blocks = thread_count();
  while (!ensemble.done() && !Interrupt::came() && ensemble.sums().samples < enough) {
    const std::int64_t wanted = (enough - ensemble.sums().samples + kBlock - 1) / kBlock;
    ensemble.advance(static_cast<int>(std::min<std::int64_t>(blocks, wanted)));
    const double time = seconds_now();
    const std::int64_t samples = ensemble.sums().samples;
    const double rate = static_cast<double>(samples - first) / (time - begin);
    // So many that a turn takes about a fifth of a second.
    blocks = std::clamp(static_cast<int>(rate * 0.2 / kBlock), 1, kBlocksAtOnce * thread_count());
    progress.show(static_cast<double>(samples) / static_cast<double>(enough),
                  fmt::format("{} of {} paths", samples, run.options.samples));
    if (time - saved < kCheckpointSeconds) continue;
    saved = time;
    run.sums = ensemble.sums();
    write_file_atomically(checkpoint, ensemble_checkpoint(run));
  }
  run.sums = ensemble.sums();
  run.seconds = seconds_now() - begin;
  if (run.partial() || saved > begin) write_file_atomically(checkpoint, ensemble_checkpoint(run));
}

std::vector<std::string> warnings_of(const records::EnsembleRun& run) {
  std::vector<std::string> warnings;
  const ensemble::PathCounts& paths = run.sums.paths;
  if (run.partial())
    warnings.push_back(
        fmt::format("partial: {} of {} paths; continue with --resume", run.sums.samples, run.options.samples));
  if (const std::int64_t lost = paths.no_root + paths.momentum_bound; lost > 0)
    warnings.push_back(
        fmt::format("{} of {} paths are not clean; statistics at each time are over the paths clean up to then. A "
                    "smaller --dt may help",
                    lost, run.sums.samples));
  return warnings;
}

void write_results(const records::EnsembleRun& run, const std::vector<std::string>& notes,
                   const EnsembleArguments& arguments) {
  const OutputOptions& output = arguments.output;
  StagedFiles staged(output.out);
  staged.write("means.csv", ensemble_means_csv(run));
  staged.write("densities.csv", ensemble_densities_csv(run));
  const auto n = static_cast<std::size_t>(run.start.q.cols());
  const auto d = static_cast<std::size_t>(run.start.q.rows());
  const auto samples = static_cast<std::size_t>(run.sums.samples);
  const std::size_t records = run.options.keep == ensemble::KeepStates::kAll ? run.options.records.size() : 1;
  if (!arguments.save_paths.empty())
    formats::write_npy(arguments.save_paths, run.sums.states, {samples, records, 2, n, d});
  if (!arguments.save_final.empty()) {
    std::vector<double> last;
    for (std::size_t m = 0; m < samples; ++m) {
      const auto* const begin = run.sums.states.data() + (m * records + records - 1) * 2 * n * d;
      last.insert(last.end(), begin, begin + 2 * n * d);
    }
    formats::write_npy(arguments.save_final, last, {samples, 2, n, d});
  }
  const draw::EnsemblePicture shape = run.sums.paths.clean > 1 ? make_ensemble_picture(run) : draw::EnsemblePicture{};
  const bool draws = !output.no_picture && run.sums.paths.clean > 1;
  const fs::path picture = staged.file("ensemble");
  if (draws) write_ensemble_picture(run, shape, output.picture_files(picture));
  staged.write("report.html", html_report(ensemble_report(run, shape, warnings_of(run), notes,
                                                          draws ? output.shown_picture(picture) : "")));
  const std::string record = ensemble_json(run);
  staged.write("ensemble.json", record);
  output.write_json(record);
  staged.commit();
  if (!run.partial()) fs::remove(output.file(kCheckpoint));
}

void print_summary(const records::EnsembleRun& run) {
  const ensemble::EnsembleSums& sums = run.sums;
  const TimeGrid& grid = run.options.grid;
  fmt::print("{}{} paths of {} landmarks in {}D to t = {:.4g}: {} steps of {:.4g}, seed {}{}\n",
             run.partial() ? "PARTIAL: " : "", sums.samples, run.shape.count(), run.shape.dimension(), grid.time,
             grid.steps, grid.dt(), run.options.seed, run.options.antithetic ? ", antithetic" : "");
  fmt::print("model      {}, noise {}, integrator {}\n", run.system.kernel.spec(4),
             shortened_spec(run.system.noise->spec()), run.integrator);
  fmt::print("sampled    in {:.2f} s on {}, {}\n", run.seconds,
             counted(static_cast<std::size_t>(run.threads), "thread"), run.method);
  fmt::print("paths      {} clean, {} without a root, {} with momenta beyond {}, {} ties\n", sums.paths.clean,
             sums.paths.no_root, sums.paths.momentum_bound, short_number(run.options.momentum_bound), sums.paths.tie);
  if (run.shape.dimension() == 1 && run.shape.count() > 1 && sums.paths.clean > 0) {
    const Estimate crossing = sums.crossing_probability();
    fmt::print(
        "crossing   {:.4f} ± {:.4f} of the clean paths end in a different order; {:.4f} were in one at some step\n",
        crossing.value, crossing.standard_error,
        static_cast<double>(sums.crossing.ever) / static_cast<double>(sums.paths.clean));
  }
  const NoiseTraits traits = run.system.noise->traits();
  if (traits.translation_invariant && traits.hamiltonian)
    fmt::print("momentum   total {}\n", conservation(sums.momentum_error));
}

int run_ensemble(const EnsembleArguments& arguments) {
  const Start start = arguments.start.start();
  const TimeGrid grid = arguments.time.grid(start.default_time);
  const std::vector<int> densities = density_steps(arguments.densities, grid);
  const ensemble::EnsembleOptions options = ensemble_options(arguments, start, densities, grid);
  check_outputs(arguments);
  ensemble::Ensemble ensemble(start.system, arguments.integrator, start.state, options);
  records::EnsembleRun run{start.system,
                           arguments.integrator,
                           start.shape,
                           start.state,
                           ensemble.options(),
                           densities,
                           {},
                           ensemble.method(),
                           thread_count(),
                           0};
  const fs::path checkpoint = arguments.output.file(kCheckpoint);
  if (arguments.resume) ensemble.resume(read_ensemble_checkpoint(run, file_contents(checkpoint), checkpoint.string()));
  log_step(fmt::format("{} landmarks, {} steps, {}", start.shape.count(), grid.steps, run.method));
  sample(ensemble, run, arguments);
  log_step(fmt::format("sampled {} paths", run.sums.samples));
  write_results(run, start.notes, arguments);
  log_step("wrote the results");
  print_notes(start.notes);
  if (arguments.output.prints()) {
    print_summary(run);
    arguments.output.print_written(kEnsembleFiles, kEnsemblePictures);
  }
  const std::vector<std::string> warnings = warnings_of(run);
  for (const std::string& text : warnings) print_warning(text);
  return warnings.empty() ? kDone : kNotConverged;
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
  verb->add_option("--save-final", arguments->save_final, "write the final states: .npy, [sample][q,p][landmark][axis]")
      ->type_name("FILE");
  verb->add_option("--save-paths", arguments->save_paths,
                   "write the states at the records: .npy, [sample][record][q,p][landmark][axis]")
      ->type_name("FILE");
  verb->add_flag("--resume", arguments->resume, "continue from ensemble.partial in the folder");
  verb->add_option("--stop-after", arguments->stop_after, "stop after this many samples; continue with --resume");
  add_threads_option(*verb);
  arguments->output.add_to(*verb, "ensemble.png and .svg");
  verb->footer(
      "Examples:\n"
      "  pulson ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out\n"
      "  pulson ensemble --shape wings.tps#1 --noise ch-sd:beta=0.1 --samples 10000 -o out\n"
      "  pulson ensemble --from out/registration.json --samples 2000 --save-final ends.npy -o out\n"
      "Ctrl-C writes the results so far, marked partial; --resume continues to the same result, bit for bit.\n"
      "Exit codes: 0 done, 2 bad input, 3 partial, or not all paths are clean (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_ensemble(*arguments); });
}

}  // namespace pulson
