// `pulson simulate`: one or a few sample paths.

#include <algorithm>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/step_watch.hpp"
#include "core/undefined.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/records/records.hpp"
#include "report.hpp"
#include "shell/field_files.hpp"
#include "shell/help_groups.hpp"
#include "shell/host.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/report_parts.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "start_options.hpp"

namespace pulson {
namespace {

constexpr int kMostPaths = 1000;
constexpr std::int64_t kMostNumbers = 400'000'000;  // of states in memory: 3.2 GB
constexpr int kPrintedSamples = 5;

struct SimulateArguments {
  StartOptions start;
  TimeOptions time = TimeOptions::of(matching::path_defaults());
  ensemble::SamplePathsOptions options;
  std::string integrator = matching::path_defaults().integrator.value;
  OutputOptions output;
  FieldOptions field;
  int every = 1;
};

const std::vector<std::string> kSimulationFiles = {"simulation.json", "paths.csv", "report.html"};
const std::vector<std::string> kSimulationPictures = {"paths"};

void check_size(const Start& start, const SimulateArguments& arguments, const TimeGrid& grid) {
  const int samples = arguments.options.samples;
  if (samples < 1 || samples > kMostPaths)
    throw InputError(
        fmt::format("--samples is {}; it must be from 1 to {} (more: pulson ensemble)", samples, kMostPaths));
  if (arguments.every < 1) throw InputError(fmt::format("--every is {}; it must be at least 1", arguments.every));
  const std::int64_t numbers = 2 * start.state.q.size() * (std::int64_t{grid.steps} + 1) * samples;
  if (numbers > kMostNumbers)
    throw InputError(fmt::format("{} paths of {} landmarks and {} steps are {} numbers; at most {} fit, take fewer",
                                 samples, start.shape.count(), grid.steps, numbers, kMostNumbers));
}

std::string setting(const records::Simulation& simulation) {
  return fmt::format("{}  ·  {}  ·  {}, dt = {:.3g}  ·  seed {}", shortened_spec(simulation.system.noise->spec()),
                     simulation.system.kernel.spec(3), simulation.integrator, simulation.options.grid.dt(),
                     simulation.options.seed);
}

// All paths as far as each goes; a path that ended early is drawn to its end and stays there.
draw::PathPicture make_picture(const records::Simulation& simulation) {
  draw::PathPicture picture;
  picture.start = simulation.shape;
  const TimeGrid& grid = simulation.options.grid;
  for (int k = 0; k <= grid.steps; ++k) picture.times.push_back(grid.at(k));
  for (const ensemble::SamplePath& sample : simulation.samples) {
    std::vector<Points> q;
    std::vector<Points> p;
    for (std::size_t k = 0; k < picture.times.size(); ++k) {
      const PhaseState& state = sample.path.states[std::min(k, sample.path.states.size() - 1)];
      q.push_back(state.q);
      p.push_back(state.p);
    }
    picture.positions.push_back(std::move(q));
    picture.momenta.push_back(std::move(p));
  }
  const int n = simulation.shape.count();
  picture.title =
      fmt::format("{} of {} landmark{}",
                  simulation.options.samples == 1 ? std::string("A sample path")
                                                  : fmt::format("{} sample paths", simulation.options.samples),
                  n, n == 1 ? "" : "s");
  picture.subtitle = setting(simulation);
  return picture;
}

// Of paths that are not clean: one text or none.
std::vector<std::string> warnings_of(const records::Simulation& simulation) {
  std::size_t unclean = 0;
  std::string first;
  for (std::size_t m = 0; m < simulation.samples.size(); ++m) {
    const ensemble::SamplePath& sample = simulation.samples[m];
    if (sample.status == ensemble::PathStatus::kClean) continue;
    if (unclean++ == 0) first = fmt::format("path {}: {}", m + 1, sample.reason);
  }
  if (unclean == 0) return {};
  return {fmt::format("{} of {} paths did not reach their end cleanly; {}", unclean, simulation.samples.size(), first)};
}

void write_field_of_first(const records::Simulation& simulation, const FieldOptions& options,
                          const std::optional<warp::VelocityField>& field, RunResults& results) {
  if (!field) return;
  draw::FieldPicture picture = make_field_picture(*field, simulation.samples.front().path, simulation.shape);
  picture.title =
      "Velocity field of " + (simulation.samples.size() == 1 ? std::string("a sample path") : "sample path 1");
  picture.subtitle = setting(simulation);
  write_field(options, *field, picture, results);
}

void write_results(const records::Simulation& simulation, const std::vector<std::string>& notes,
                   const SimulateArguments& arguments, const std::optional<warp::VelocityField>& field,
                   RunResults& results) {
  results.add("paths.csv", sample_paths_csv(simulation, arguments.every));
  results.commit("simulation.json", simulation_json(simulation), field_json(field));
  write_field_of_first(simulation, arguments.field, field, results);
  const auto picture = results.draw(
      "paths", [&](const draw::PictureFiles& files) { write_path_picture(make_picture(simulation), files); });
  results.add_page([&] { return simulation_report(simulation, warnings_of(simulation), notes, picture); });
  results.finish();
}

std::string numbers_text(const Points& points) {
  std::string text;
  for (const auto& column : points.colwise()) {
    std::string one;
    for (const double x : column) one += fmt::format("{}{:.5g}", one.empty() ? "" : "/", x);
    text += (text.empty() ? "" : ", ") + one;
  }
  return text;
}

void print_summary(const records::Simulation& simulation) {
  const TimeGrid& grid = simulation.options.grid;
  print_text("{} path{} of {} landmarks in {}D to t = {:.4g}: {} steps of {:.4g}, seed {}\n",
             simulation.options.samples, simulation.options.samples == 1 ? "" : "s", simulation.shape.count(),
             simulation.shape.dimension(), grid.time, grid.steps, grid.dt(), simulation.options.seed);
  print_text("model      {}, noise {}, integrator {}\n", simulation.system.kernel.spec(4),
             shortened_spec(simulation.system.noise->spec()), simulation.integrator);
  double kappa = 0;
  double momentum = 0;
  double error = 0;
  for (const ensemble::SamplePath& sample : simulation.samples) {
    kappa = max_or_undefined(kappa, sample.contraction_bound);
    momentum = max_or_undefined(momentum, sample.largest_momentum);
    error = max_or_undefined(error, sample.momentum_error);
  }
  const NoiseTraits traits = simulation.system.noise->traits();
  print_text("steps      largest kappa {} ({}), largest momentum {}\n", report_number(kappa, 3),
             kappa < 1 ? "below 1: each step has one root" : "1 and more: roots were followed from dt = 0",
             report_number(momentum));
  const bool moved = std::any_of(simulation.samples.begin(), simulation.samples.end(),
                                 [](const ensemble::SamplePath& sample) { return sample.path.states.size() > 1; });
  if (traits.translation_invariant && traits.hamiltonian && moved)
    print_text("momentum   total {}\n", conservation(error));
  if (simulation.start.q.size() > 6) return;
  for (std::size_t m = 0; m < simulation.samples.size() && m < kPrintedSamples; ++m)
    print_text("path {:<5} q(T) = {}   p(T) = {}\n", m + 1, numbers_text(simulation.samples[m].path.final().q),
               numbers_text(simulation.samples[m].path.final().p));
}

// Nothing is written yet.
void end_with_host() {
  if (host() != nullptr && host()->interrupted()) throw HostStopped();
}

int run_simulate(const SimulateArguments& arguments) {
  const double begin = seconds_now();
  const Start start = arguments.start.start();
  ensemble::SamplePathsOptions options = arguments.options;
  options.grid = arguments.time.grid(start.default_time);
  check_size(start, arguments, options.grid);
  const auto integrator = make_integrator(arguments.integrator);
  arguments.field.check(start.shape.dimension(), options.grid.steps / arguments.every + 2);
  arguments.output.check(kSimulationFiles, kSimulationPictures);
  records::Simulation simulation{start.system, arguments.integrator, start.shape, start.state, options, {}, 0};
  {
    const StepWatch watch(end_with_host);
    simulation.samples = sample_paths(start.system, *integrator, start.state, options);
  }
  for (ensemble::SamplePath& sample : simulation.samples) sample.reason = in_option_words(sample.reason);
  simulation.seconds = seconds_now() - begin;
  log_step(fmt::format("drew {} paths of {} steps", options.samples, options.grid.steps));
  const auto field =
      arguments.field.field_of(simulation.system.kernel, simulation.samples.front().path, arguments.every);
  RunResults results(arguments.output);
  write_results(simulation, start.notes, arguments, field, results);
  print_notes(start.notes);
  if (arguments.output.prints()) {
    print_summary(simulation);
    print_field(arguments.field, field);
    results.print_written();
  }
  const std::vector<std::string> warnings = warnings_of(simulation);
  for (const std::string& text : warnings) print_warning(text);
  return warnings.empty() ? kDone : kNotConverged;
}

}  // namespace

void add_simulate_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("simulate", "Draw one or a few sample paths of the stochastic system");
  auto arguments = std::make_shared<SimulateArguments>();
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
  add_seed_option(*verb, arguments->options.seed);
  verb->add_option("--every", arguments->every, "write every n-th step to paths.csv and --field")
      ->capture_default_str();
  arguments->field.add_to(*verb, "path 1", "paths.csv");
  begin_group(*verb, more(kSamplingGroup));
  add_threads_option(*verb);
  arguments->output.add_to(*verb, "paths.png and .svg");
  verb->footer(
      "Examples:\n"
      "  pulson simulate --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out\n"
      "  pulson simulate --shape wings.tps#1 --noise p-sd:beta=0.1,fields=grid --samples 5 -o out\n"
      "  pulson simulate --q 0,2 --p 2,1 --kernel peakon:alpha=1 --time 5 --field u.png --field u.npy -o out\n"
      "  pulson simulate --from out/registration.json --noise ch-sd:beta=0.05 --samples 20 -o paths\n"
      "Exit codes: 0 done, 2 bad input, 3 a path could not be followed to its end (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_simulate(*arguments); });
}

}  // namespace pulson
