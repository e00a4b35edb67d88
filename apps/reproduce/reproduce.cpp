// `pulson reproduce`: the paper's experiments.

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "laboratory.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/tables.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

struct ReproduceArguments {
  std::string what;
  std::string out;
  bool quick = false;
  std::optional<std::int64_t> samples;
  std::optional<double> dt;
  std::uint64_t seed = 1;
  bool no_picture = false;
};

std::vector<Experiment> chosen(const std::string& name) {
  if (name == "all") return experiments();
  for (const Experiment& experiment : experiments())
    if (experiment.name == name) return {experiment};
  std::vector<std::string> names = {"all"};
  for (const Experiment& experiment : experiments()) names.push_back(experiment.name);
  throw InputError(fmt::format("unknown experiment '{}'{}", name, advice_on_name(name, names)));
}

ExperimentOptions experiment_options(const ReproduceArguments& arguments) {
  ExperimentOptions options;
  options.out = arguments.out;
  options.quick = arguments.quick;
  options.seed = arguments.seed;
  options.pictures = !arguments.no_picture;
  if (arguments.quick) {
    options.samples = 2048;
    options.beta_step = 0.5;
  }
  options.samples = arguments.samples.value_or(options.samples);
  if (options.samples < 64 || options.samples > 100'000'000)
    throw InputError(fmt::format("--samples is {}; it must be from 64 to 100000000", options.samples));
  const double dt = arguments.dt.value_or(options.grid.dt());
  if (!(dt >= 1e-5 && dt <= 1)) throw InputError(fmt::format("--dt is {}; it must be from 1e-5 to 1", dt));
  options.grid.steps = static_cast<int>(std::ceil(options.grid.time / dt * (1 - 1e-12)));
  return options;
}

std::string command_of(const ReproduceArguments& arguments) {
  std::string command = fmt::format("pulson reproduce {} -o {}", arguments.what, arguments.out);
  if (arguments.quick) command += " --quick";
  if (arguments.samples) command += fmt::format(" --samples {}", *arguments.samples);
  if (arguments.dt) command += fmt::format(" --dt {}", *arguments.dt);
  return command + fmt::format(" --seed {}", arguments.seed);
}

void print_claims(const html::ReportSection& section) {
  print_text("{}\n", section.heading);
  for (const html::ReportBlock& block : section.blocks)
    if (const auto* claims = std::get_if<html::ReportClaims>(&block))
      for (const html::ReportClaim& claim : *claims)
        print_text("  {:<14} {}\n                 {}\n",
                   claim.verdict == html::Verdict::kHolds         ? "holds"
                   : claim.verdict == html::Verdict::kDoesNotHold ? "does not hold"
                                                                  : "not tested",
                   claim.claim, claim.measured);
}

int run_reproduce(const ReproduceArguments& arguments) {
  const std::vector<Experiment> chosen_experiments = chosen(arguments.what);
  const ExperimentOptions options = experiment_options(arguments);
  create_output_directory(arguments.out);
  const FolderLock lock(arguments.out);
  check_output_file(options.out / "report.html");
  const double begin = seconds_now();
  const Interrupt interrupt;
  html::HtmlReport report{
      "The experiments of Holm and Tyranowski",
      fmt::format("Stochastic EPDiff landmark dynamics, sections 3 and 5, recomputed: {} sample paths, "
                  "dt = {:.3g}, t = {:.3g}, by (20) as printed. Errors are standard errors.{}",
                  options.samples, options.grid.dt(), options.grid.time,
                  arguments.quick ? " A quick look: fewer paths than the paper's 50,000." : ""),
      {},
      command_of(arguments),
      "pulson " + version()};
  bool interrupted = false;
  for (const Experiment& experiment : chosen_experiments) {
    Progress progress;
    try {
      report.sections.push_back(experiment.run(Laboratory(options, progress)));
    } catch (const Interrupted&) {
      interrupted = true;
      break;
    }
    progress.clear();
    log_step(experiment.name);
    write_file_atomically(options.out / "report.html", html_report(report));
    if (verbosity() != Verbosity::kQuiet) print_claims(report.sections.back());
  }
  const double seconds = seconds_now() - begin;
  if (interrupted) {
    print_warning(fmt::format("interrupted: {} of {} experiments are done and written", report.sections.size(),
                              chosen_experiments.size()));
    return kNotConverged;
  }
  if (verbosity() != Verbosity::kQuiet)
    print_text("wrote      {}: report.html{}, csv, in {:.1f} s\n", arguments.out,
               options.pictures ? ", pictures (.png, .svg)" : "", seconds);
  return kDone;
}

}  // namespace

void add_reproduce_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("reproduce", "Repeat the experiments of the paper and check which of its claims hold");
  auto arguments = std::make_shared<ReproduceArguments>();
  std::string help = "all, or one of:";
  for (const Experiment& experiment : experiments()) help += fmt::format("\n{}: {}", experiment.name, experiment.help);
  verb->add_option("EXPERIMENT", arguments->what, help)->type_name("NAME")->required();
  writes_folder(verb->add_option("-o,--out", arguments->out, "folder for report.html, pictures and csv"))->required();
  verb->add_flag("--quick", arguments->quick, "quick run: 2048 paths, beta in steps of 0.5");
  verb->add_option("--samples", arguments->samples, "paths of each ensemble [50000]");
  verb->add_option("--dt", arguments->dt, "time step [0.02]");
  add_seed_option(*verb, arguments->seed);
  add_threads_option(*verb);
  verb->add_flag("--no-picture", arguments->no_picture, "do not draw");
  add_table_option(*verb);
  add_quiet_option(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson reproduce figure3 -o out\n"
      "  pulson reproduce all --quick -o look\n"
      "Exit codes: 0 done (whether or not the claims hold), 2 bad input, 3 interrupted (finished experiments are "
      "written).");
  verb->callback([arguments, &exit_code] { exit_code = run_reproduce(*arguments); });
}

}  // namespace pulson
