// `pulson sample`: the posterior of momenta, paths and parameters.

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "arguments.hpp"
#include "calibration.hpp"
#include "core/atomic_file.hpp"
#include "core/determined.hpp"
#include "core/paths.hpp"
#include "facts.hpp"
#include "picture.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/ranks.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kSampleFiles = {"summary.json", "draws.csv", "momenta.npy", "paths.npy", "report.html"};
const std::vector<std::string> kTreeFiles = {"summary.json", "draws.csv", "nodes.csv", "nodes.npy", "report.html"};
const std::vector<std::string> kSamplePictures = {"paths", "chains"};

// Exchanges so rare do not bring points of the prior to the posterior.
constexpr double kRareExchange = 0.2;

// What leads out of tails and to other minima.
constexpr const char* kTempering = "--method pcn --temperatures 8";

// Radians of a step of hmc: 0.003 for 77 dense landmarks that move by themselves, 0.048 where directions of their
// momenta fade that move them by less than √3 deviations.
constexpr double kShortStep = 0.05;
constexpr const char* kSmooth = ", or --momenta smooth --method rto";

// Whether momenta of high frequency are what bends the paths.
bool needs_smooth_momenta(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  return problem.momenta == inference::MomentumPrior::kKernel && problem.tree.empty() &&
         problem.specimens.front().system.noise->traits().displacement.has_landmarks() && draws.step_angle < kShortStep;
}

std::string remedy_for(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  if (needs_smooth_momenta(problem, draws)) return kSmooth;
  if (draws.exchanged.empty()) return fmt::format(", or {}", kTempering);
  const double least = *std::min_element(draws.exchanged.begin(), draws.exchanged.end());
  return least < kRareExchange
             ? fmt::format(", and more --temperatures: exchanges are accepted as rarely as {:.2g}", least)
             : "";
}

std::string refuted_warning(const inference::PosteriorDraws& draws) {
  const inference::Confirmation& by = draws.confirmation;
  return fmt::format(
      "the chains have missed a part of the posterior, or were too short: {} of {} are {:.1f} standard errors from "
      "theirs, and log p(y) is {:.3f} ± {:.2g} by them; take {}",
      by.furthest_of, confirmed_by_words(by), by.furthest, by.log_evidence.value, by.log_evidence.standard_error,
      draws.exchanged.empty() ? kTempering : "more --draws and more --temperatures");
}

std::string tail_warning(const inference::PosteriorDraws& draws) {
  return fmt::format(
      "the chains may have missed a part of the posterior: Pareto k of the weights is {}, and has to be at most {}, "
      "and "
      "nothing else determines the posterior; take {}",
      pareto_text(draws), inference::kHighParetoK, kTempering);
}

// Chains that did not move, or are too short for their diagnostics.
std::string undefined_warning(const inference::PosteriorProblem& problem, const PosteriorSummary& summary,
                              const inference::PosteriorDraws& draws) {
  return fmt::format("the chains have not converged: R-hat or effective sample sizes of {} are undefined, as {}{}",
                     summary.undefined,
                     draws.acceptance > 0
                         ? "draws hardly change, or are too few; take more --draws and --warmup"
                         : "no move was accepted; take more --warmup, in which the steps are adapted, or --method hmc",
                     needs_smooth_momenta(problem, draws) ? kSmooth : "");
}

std::vector<std::string> warnings_of(const inference::PosteriorProblem& problem, const PosteriorSummary& summary,
                                     const inference::PosteriorDraws& draws) {
  constexpr double kFewEffective = 400;
  std::vector<std::string> warnings;
  if (!summary.undefined.empty())
    warnings.push_back(undefined_warning(problem, summary, draws));
  else if (!(summary.worst_rhat <= inference::kHighRhat))
    warnings.push_back(fmt::format(
        "the chains have not converged: R-hat of {} is {:.4f}, more than {}; take more --draws and --warmup{}",
        summary.worst, summary.worst_rhat, inference::kHighRhat, remedy_for(problem, draws)));
  else if (summary.refuted)
    warnings.push_back(refuted_warning(draws));
  else if (summary.heavy_tail)
    warnings.push_back(tail_warning(draws));
  const Estimate& finer = draws.of_finer_steps;
  if (std::abs(finer.value) - 2 * finer.standard_error > inference::kStepError)
    warnings.push_back(
        fmt::format("the steps are long: with twice as many log p(y) is {:+.3f} ± {:.2g} from here; take --steps {}",
                    finer.value, finer.standard_error, 2 * problem.specimens.front().grid.steps));
  double least = summary.ess_min;
  for (const NamedSummary& parameter : summary.parameters)
    least = std::fmin(least, std::fmin(parameter.numbers.ess_bulk, parameter.numbers.ess_tail));
  if (summary.converged && least < kFewEffective)
    warnings.push_back(
        fmt::format("the least effective sample size is {:.0f}; for R-hat and quantiles to be reliable take more "
                    "--draws ({:.0f} are usual)",
                    least, kFewEffective));
  return warnings;
}

void print_parameters(const PosteriorSummary& summary) {
  std::vector<inference::DrawSummary> rows;
  for (const NamedSummary& parameter : summary.parameters) rows.push_back(parameter.numbers);
  auto table = text_table(chosen(draw_facts(), {"mean", "sd", "q05", "q95", "rhat", "ess_bulk"}), rows);
  table.front().insert(table.front().begin(), "");
  for (std::size_t j = 0; j < rows.size(); ++j) table[j + 1].insert(table[j + 1].begin(), summary.parameters[j].name);
  print_table(table);
}

void print_summary(const PosteriorResults& results) {
  const auto& [problem, options, draws, summary, notes, warnings] = results;
  const auto text = [&](std::string_view key) { return text_of(posterior_facts(), key, results.draws); };
  print_text(
      "{}: {} of {} in {}D\n", problem.sources.front().source.empty() ? "source" : problem.sources.front().source,
      problem.tree.empty()
          ? counted(static_cast<std::int64_t>(problem.targets.size()), "target")
          : fmt::format("a tree of {} branches, with {} observed nodes", problem.tree.size(), problem.targets.size()),
      counted(problem.sources.front().count(), "landmark"), problem.sources.front().dimension());
  print_text("model      {}\n", model_words(problem));
  print_text("sampled    {} chains of {} draws in {} s, acceptance {}\n", text("chains"), text("draws"),
             text("seconds"), text("acceptance"));
  print_parameters(summary);
  print_text("paths      R-hat at most {}, ESS at least {}", rhat_text(summary.rhat_max), ess_text(summary.ess_min));
  if (problem.tree.empty())
    print_text("; momenta {}, {}", rhat_text(summary.momenta_rhat_max), ess_text(summary.momenta_ess_min));
  print_text("\n");
  if (draws.modes > 1) print_text("modes      {} found\n", draws.modes);
  if (!draws.exchanged.empty())
    print_text("tempering  {} temperatures, exchanges accepted {:.2f} to {:.2f}\n", draws.powers.size(),
               *std::min_element(draws.exchanged.begin(), draws.exchanged.end()),
               *std::max_element(draws.exchanged.begin(), draws.exchanged.end()));
  print_text("evidence   log p(y) = {} by bridge sampling, {} by Laplace's approximation\n",
             std::isnan(draws.log_evidence.value) ? "undetermined" : text("log_evidence.value"),
             text("log_evidence.laplace"));
  print_text("confirmed  {}\n", confirmation_text(draws));
  if (!std::isnan(draws.of_finer_steps.value))
    print_text("steps      with twice as many log p(y) changes by {}\n", text("log_evidence.of_finer_steps.value"));
}

// The chains so far, as the first of the two units of a run of which nothing else is done.
class SavedChains {
 public:
  SavedChains(const SampleArguments& arguments, const SampleShapes& shapes, std::string settings)
      : file_(arguments.output.file("sample.partial")) {
    check_result_file(file_, "--out");
    run_.verb = "sample";
    run_.settings = std::move(settings);
    run_.shapes = shapes.targets;
    run_.shapes.insert(run_.shapes.begin(), shapes.source);
    run_.facts["tree"] = tree_facts(shapes.tree);
    run_.units = 2;
    if (saved_before(file_, arguments.units.resume))
      resume_units(run_, read_saved(file_), file_.string());
    else if (arguments.units.resume)
      done_before_ = is_done_before(arguments.output.file("summary.json"), fingerprint());
  }

  std::string fingerprint() const { return unit_fingerprint(run_); }
  /// Whether the results are there, as --resume found.
  bool done_before() const { return done_before_; }

  std::string state() const {
    if (!run_.results.contains(0)) return {};
    const auto& bytes = run_.results.at(0).get_binary();
    return {bytes.begin(), bytes.end()};
  }

  // Every so often, and where a signal came. @return whether none did
  bool keep(const std::function<std::string()>& state) {
    const bool stops = Interrupt::came();
    if (stops || pace_.is_due())
      pace_.save([&] {
        const std::string bytes = state();
        run_.results[0] = nlohmann::ordered_json::binary({bytes.begin(), bytes.end()});
        write_file_atomically(file_, unit_part(run_));
      });
    return !stops;
  }

  const std::filesystem::path& file() const { return file_; }
  void remove() const { remove_saved(file_); }

 private:
  std::filesystem::path file_;
  records::UnitRun run_;
  bool done_before_ = false;
  SavingPace pace_;
};

// θ have priors, which would be all that is seen of them where data are fewer.
void require_determined_theta(const inference::PosteriorProblem& problem) {
  Eigen::Index coordinates = 0;
  for (const Landmarks& target : problem.targets) coordinates += target.points.array().isFinite().count();
  require_determined_parameters("the parameters are", std::ssize(problem.parameters), coordinates,
                                "give numbers in place of fit, or more shapes");
}

int write_results(const PosteriorResults& results, const SavedChains& saved, const OutputOptions& output) {
  const auto& [problem, options, draws, summary, notes, warnings] = results;
  const std::string record = summary_json(results);
  RunResults files(output);
  files.add("draws.csv", draws_csv(draws));
  if (problem.tree.empty()) {
    files.add("momenta.npy", momenta_npy(problem, draws));
    files.add("paths.npy", paths_npy(problem, draws));
  } else {
    files.add("nodes.csv", nodes_csv(results));
    files.add("nodes.npy", nodes_npy(problem, draws));
  }
  files.commit("summary.json", record, {{"run", saved.fingerprint()}});
  files.draw("paths", [&](const draw::PictureFiles& drawn) {
    write_paths_picture(results.problem, results.draws, shown_path(results.problem), drawn);
  });
  files.draw("chains", [&](const draw::PictureFiles& drawn) {
    write_chart(chains_chart(results.problem, results.draws, results.summary), drawn);
  });
  files.add_page([&] { return sample_report(results, files.shown("paths"), files.shown("chains")); });
  files.finish();
  saved.remove();
  print_notes(notes);
  if (output.prints()) {
    print_summary(results);
    files.print_written();
  }
  for (const std::string& text : warnings) print_warning(text);
  return summary.converged ? kDone : kNotConverged;
}

int run_posterior(const SampleArguments& arguments, const SampleShapes& shapes, const std::string& settings,
                  std::vector<std::string> notes) {
  const OutputOptions& output = arguments.output;
  output.check(shapes.tree.empty() ? kSampleFiles : kTreeFiles, kSamplePictures);
  SavedChains saved(arguments, shapes, settings);
  if (saved.done_before()) return kDone;
  inference::PosteriorProblem problem = arguments.problem(shapes, notes);
  require_determined_theta(problem);
  Progress progress;
  std::mutex turn;
  inference::SamplerOptions options = arguments.sampler;
  options.on_progress = [&](double fraction) {
    const std::lock_guard lock(turn);
    progress.show(fraction, "sampling");
  };
  const Interrupt interrupt;
  options.on_state = [&](const std::function<std::string()>& state) { return saved.keep(state); };
  options.state = saved.state();
  inference::PosteriorDraws sampled = sample_posterior(problem, options);
  progress.clear();
  if (sampled.partial) {
    print_warning(
        fmt::format("interrupted: the chains are saved in '{}'; continue with --resume", saved.file().string()));
    return kNotConverged;
  }
  log_step(fmt::format("sampled and confirmed, {:.1f} s of it warm-up", sampled.warmup_seconds));
  PosteriorSummary found = summarise_posterior(sampled);
  std::vector<std::string> doubts = warnings_of(problem, found, sampled);
  const PosteriorResults results{std::move(problem), std::move(options), std::move(sampled),
                                 std::move(found),   std::move(notes),   std::move(doubts)};
  return write_results(results, saved, output);
}

int run_sample(const SampleArguments& arguments, const CLI::App& verb) {
  if (arguments.calibrate > 0) return run_calibration(arguments, settings_of(verb));
  if (ranks::size() > 1)
    throw InputError(
        fmt::format("there are {} ranks; the chains of one posterior are for one process, and with "
                    "--calibrate simulations are shared",
                    ranks::size()));
  std::vector<std::string> notes;
  const SampleShapes shapes = arguments.read(notes);
  log_step(fmt::format("read {}", counted(std::ssize(shapes.targets), "target")));
  return run_posterior(arguments, shapes, settings_of(verb), notes);
}

}  // namespace

void add_sample_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("sample", "Sample the posterior of momenta, paths and parameters");
  auto arguments = std::make_shared<SampleArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson sample source.csv target.csv --noise ch-sd:beta=2% -o out\n"
      "  pulson sample wings.tps#1 wings.tps#2 wings.tps#3 --noise ch-sd:beta=fit --lambda fit -o out\n"
      "  pulson sample root.csv leaves.tps --tree phylogeny.nwk --noise kunita:beta=5%,width=20% -o out\n"
      "  pulson sample source.csv target.csv --noise ch-sd:beta=2% --calibrate 200 -o out\n"
      "  pulson sample source.csv target.csv --noise ch-sd:beta=2% --calibrate 200 --shard 3/8 -o parts\n"
      "Exit codes: 0 done, 2 bad input, 3 the chains have not converged (results are written), or were"
      " interrupted (--resume continues).");
  verb->callback([arguments, verb, &exit_code] { exit_code = run_sample(*arguments, *verb); });
}

}  // namespace pulson
