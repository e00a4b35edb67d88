// `pulson reproduce`: the paper's experiments.

#include <algorithm>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "laboratory.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/tables.hpp"
#include "shell/units.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

struct ReproduceArguments {
  std::string what;
  std::string out;
  bool quick = false;
  std::optional<std::int64_t> samples;
  std::optional<double> dt;
  std::string beta;
  std::string kernel;
  std::string noise;
  std::optional<double> time;
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

/// That all experiments that are to run take an option. @throws InputError
void require_taken(const ReproduceArguments& arguments, std::string_view option, bool is_given,
                   bool (*takes)(const Experiment&)) {
  if (!is_given) return;
  std::vector<std::string> names;
  for (const Experiment& experiment : experiments())
    if (takes(experiment)) names.push_back(experiment.name);
  if (std::find(names.begin(), names.end(), arguments.what) == names.end())
    throw InputError(fmt::format("{} is not for '{}'; the experiments that take it, one at a time: {}", option,
                                 arguments.what, fmt::join(names, ", ")));
}

OwnValues own_values(const ReproduceArguments& arguments) {
  const auto takes_others = [](const Experiment& experiment) { return experiment.takes.others; };
  require_taken(arguments, "--beta", !arguments.beta.empty(),
                [](const Experiment& experiment) { return experiment.takes.betas != OwnValuesTaken::Betas::kNone; });
  require_taken(arguments, "--kernel", !arguments.kernel.empty(), takes_others);
  require_taken(arguments, "--noise", !arguments.noise.empty(), takes_others);
  require_taken(arguments, "--time", arguments.time.has_value(), takes_others);
  OwnValues own;
  if (!arguments.beta.empty()) own.betas = parse_values(arguments.beta, "--beta");
  if (own.betas.size() > 1 && chosen(arguments.what).front().takes.betas == OwnValuesTaken::Betas::kOne)
    throw InputError(fmt::format("--beta has {} values; '{}' takes one", own.betas.size(), arguments.what));
  if (!arguments.kernel.empty()) own.kernel = own_kernel(arguments.kernel);
  own.noise = arguments.noise;
  if (!own.noise.empty())
    for (const double beta : own.betas_or({1})) make_noise(noise_at(own.noise, beta), paper_shape())->check(1, 2);
  own.time = arguments.time;
  return own;
}

ExperimentOptions experiment_options(const ReproduceArguments& arguments) {
  constexpr double kLongest = 1e4;  // a hundred times the paper's
  ExperimentOptions options;
  options.out = arguments.out;
  options.quick = arguments.quick;
  options.seed = arguments.seed;
  options.pictures = !arguments.no_picture;
  if (arguments.quick) options.samples = 2048;
  options.samples = arguments.samples.value_or(options.samples);
  if (options.samples < 64 || options.samples > 100'000'000)
    throw InputError(fmt::format("--samples is {}; it must be from 64 to 100000000", options.samples));
  const double dt = arguments.dt.value_or(options.grid.dt());
  if (!(dt >= 1e-5 && dt <= 1)) throw InputError(fmt::format("--dt is {}; it must be from 1e-5 to 1", dt));
  options.own = own_values(arguments);
  options.grid.time = arguments.time.value_or(kPaperTime);
  if (!(options.grid.time >= dt && options.grid.time <= kLongest))
    throw InputError(fmt::format("--time is {}; it must be from --dt, {}, to {}", options.grid.time, dt, kLongest));
  options.grid.steps = static_cast<int>(std::ceil(options.grid.time / dt * (1 - 1e-12)));
  return options;
}

std::string command_of(const ReproduceArguments& arguments) {
  std::string command = fmt::format("pulson reproduce {} -o {}", arguments.what, arguments.out);
  if (arguments.quick) command += " --quick";
  if (arguments.samples) command += fmt::format(" --samples {}", *arguments.samples);
  if (arguments.dt) command += fmt::format(" --dt {}", *arguments.dt);
  if (!arguments.beta.empty()) command += " --beta " + arguments.beta;
  if (!arguments.kernel.empty()) command += " --kernel " + arguments.kernel;
  if (!arguments.noise.empty()) command += " --noise " + arguments.noise;
  if (arguments.time) command += fmt::format(" --time {}", *arguments.time);
  return command + fmt::format(" --seed {}", arguments.seed);
}

records::UnitRun identity_of(const CLI::App& verb) {
  records::UnitRun run;
  run.verb = "reproduce";
  run.settings = settings_of(verb);
  run.units = 1;
  return run;
}

void print_claims(const html::ReportSection& section) {
  print_text("{}\n", section.heading);
  if (std::none_of(section.blocks.begin(), section.blocks.end(),
                   [](const html::ReportBlock& block) { return std::holds_alternative<html::ReportClaims>(block); }))
    print_text("  not judged     these are not the paper's values; the numbers are in report.html\n");
  for (const html::ReportBlock& block : section.blocks)
    if (const auto* claims = std::get_if<html::ReportClaims>(&block))
      for (const html::ReportClaim& claim : *claims)
        print_text("  {:<14} {}\n                 {}\n",
                   claim.verdict == html::Verdict::kHolds         ? "holds"
                   : claim.verdict == html::Verdict::kDoesNotHold ? "does not hold"
                                                                  : "not tested",
                   claim.claim, claim.measured);
}

int run_reproduce(const ReproduceArguments& arguments, const CLI::App& verb) {
  const std::vector<Experiment> chosen_experiments = chosen(arguments.what);
  const ExperimentOptions options = experiment_options(arguments);
  create_output_directory(arguments.out);
  const FolderLock lock(arguments.out);
  check_output_file(options.out / "report.html");
  const SavedEnsembles saved(options.out / "reproduce.partial", identity_of(verb));
  if (saved.is_resumed()) print_note(fmt::format("continuing the run that '{}' has begun", arguments.out));
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
      report.sections.push_back(experiment.run(Laboratory(options, saved, progress)));
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
    print_warning(fmt::format("interrupted: {} of {} experiments are done and written; the same command continues",
                              report.sections.size(), chosen_experiments.size()));
    return kNotConverged;
  }
  saved.remove();
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
  verb->add_option("--beta", arguments->beta, "amplitudes of the noise in place of the paper's: 0:6.5:0.25 or 0,1.5,3")
      ->type_name("NUMBERS");
  verb->add_option("--kernel", arguments->kernel, "in place of the paper's; see pulson info kernels")
      ->type_name("SPEC");
  verb->add_option("--noise", arguments->noise, "in place of the paper's; see pulson info noises")->type_name("SPEC");
  verb->add_option("--time", arguments->time, "end of the paths [100]")->type_name("NUMBER");
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
      "  pulson reproduce figure3 --kernel matern32:alpha=1 --beta 0:4:0.5 -o out\n"
      "Where a run ended early, the same command continues it, to the same bits. Claims are judged with the paper's "
      "kernel, noise, beta and time alone.\n"
      "Exit codes: 0 done (whether or not the claims hold), 2 bad input, 3 interrupted (finished experiments are "
      "written).");
  verb->callback([arguments, verb, &exit_code] { exit_code = run_reproduce(*arguments, *verb); });
}

}  // namespace pulson
