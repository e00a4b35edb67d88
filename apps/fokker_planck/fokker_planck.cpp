// `pulson fokker-planck`: the densities of free pulsons, and a pair's crossing probability on a grid.

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "charts/chart.hpp"
#include "core/atomic_file.hpp"
#include "core/csv_table.hpp"
#include "pair_noise.hpp"
#include "pulson/core/version.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"
#include "records/record_text.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/probability_text.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "simulate/start_options.hpp"

namespace pulson {
namespace {

struct FokkerPlanckArguments {
  StartOptions start;
  double time = 100;
  fokker_planck::PairEquationOptions options;
  std::int64_t samples = 0;
  double dt = 0.02;
  std::uint64_t seed = 1;
  OutputOptions output;
};

const std::vector<std::string> kPairEquationFiles = {"fokker_planck.json", "crossing.csv", "densities.csv",
                                                     "report.html"};
const std::vector<std::string> kPairEquationPictures = {"fokker_planck"};

/// The pair and its noise amplitudes β₁, β₂.
struct Problem {
  Start start;
  fokker_planck::PairEquation equation;
  std::array<double, 2> betas{};
};

Problem problem_of(const FokkerPlanckArguments& arguments) {
  Start start = arguments.start.start();
  const PhaseState& state = start.state;
  if (state.q.rows() != 1 || state.q.cols() != 2)
    throw InputError(fmt::format("{}: two landmarks on a line are needed; there are {} in {}D", start.shape.source,
                                 state.q.cols(), state.q.rows()));
  const NoiseModel& noise = *start.system.noise;
  const std::optional<std::array<double, 2>> amplitudes = independent_amplitudes(noise, state);
  if (!amplitudes)
    throw InputError(
        fmt::format("noise '{}': the pair equation is for independent noise of constant size in the "
                    "positions: ch-sd:beta=B, or ch-sd:beta=B,on=2",
                    noise.spec()));
  const std::array<double, 2>& betas = *amplitudes;
  fokker_planck::PairEquation equation{
      start.system.kernel, std::hypot(betas[0], betas[1]), arguments.time, state.q(0), state.q(1), state.p(0),
      state.p(1)};
  return {std::move(start), std::move(equation), betas};
}

/// Monte Carlo at the same times, over the paths that are clean up to each, where it was asked for.
std::vector<SampledProbability> sampled_crossing(const Problem& problem, const FokkerPlanckArguments& arguments,
                                                 const std::vector<double>& times, const TimeGrid& grid) {
  std::vector<SampledProbability> estimates;
  if (arguments.samples == 0) return estimates;
  ensemble::EnsembleOptions options;
  options.grid = grid;
  options.seed = arguments.seed;
  options.samples = arguments.samples;
  options.keep = ensemble::KeepStates::kAll;
  for (const double time : times) options.records.push_back(static_cast<int>(std::lround(time / grid.dt())));
  ensemble::Ensemble ensemble(problem.start.system, "variational", problem.start.state, options);
  Progress progress;
  while (!ensemble.done()) {
    progress.show(static_cast<double>(ensemble.sums().samples) / static_cast<double>(arguments.samples),
                  fmt::format("{} of {} paths", ensemble.sums().samples, arguments.samples));
    ensemble.advance(32);
  }
  const double side = problem.equation.q2 > problem.equation.q1 ? 1 : -1;
  const std::vector<double>& states = ensemble.sums().states;
  for (std::size_t record = 0; record < times.size(); ++record) {
    double crossed = 0, clean = 0;
    for (std::size_t m = 0; m < static_cast<std::size_t>(arguments.samples); ++m) {
      const double* const q = states.data() + (m * times.size() + record) * 4;
      if (!std::isfinite(q[0]) || !std::isfinite(q[1])) continue;
      ++clean;
      if ((q[1] - q[0]) * side < 0) ++crossed;
    }
    const double p = crossed / clean;
    estimates.push_back({{p, std::sqrt(p * (1 - p) / clean)}, static_cast<std::int64_t>(clean)});
  }
  return estimates;
}

std::string crossing_csv(const fokker_planck::PairCrossing& crossing, const std::vector<SampledProbability>& sampled) {
  text::CsvTable table;
  table.words({"time", "probability"});
  if (!sampled.empty()) table.words({"sampled", "standard_error"});
  table.end_row();
  for (std::size_t i = 0; i < crossing.times.size(); ++i) {
    table.numbers(crossing.times[i], crossing.curve[i]);
    if (!sampled.empty()) table.numbers(sampled[i].value, sampled[i].known_error());
    table.end_row();
  }
  return std::move(table).take();
}

/// The marginals of (18) at a tenth, a half and the whole of the time, where there is noise.
std::string densities_csv(const Problem& problem) {
  text::CsvTable table{"landmark", "time", "q", "density"};
  const PhaseState& state = problem.start.state;
  for (std::size_t a = 0; a < 2; ++a) {
    if (problem.betas.at(a) == 0) continue;
    const auto column = static_cast<Eigen::Index>(a);
    const fokker_planck::FreePulson pulson{state.q(column), state.p(column), problem.betas.at(a),
                                           problem.equation.kernel.at_zero()};
    for (const double part : {0.1, 0.5, 1.0}) {
      const double time = part * problem.equation.time;
      const fokker_planck::NormalLaw law = position_law(pulson, time);
      for (int i = -50; i <= 50; ++i) {
        const double x = law.mean + std::sqrt(law.variance) * i / 10;
        table.numbers(a + 1, time, x, law.density(x)).end_row();
      }
    }
  }
  return std::move(table).take();
}

/// Whether nearly all of the rise is in the first sixth of the time, which a logarithmic axis shows.
bool happens_early(const fokker_planck::PairCrossing& crossing) {
  constexpr double kNearlyAll = 0.95, kEarly = 1.0 / 6;
  const auto early = static_cast<std::size_t>(kEarly * static_cast<double>(crossing.times.size()));
  return early > 0 && crossing.curve[early] > kNearlyAll * crossing.curve.back();
}

/// The curve after each step of the finest grid: at the times of the table alone it would have corners where it rises.
charts::Series curve_of(const fokker_planck::PairCrossing& crossing) {
  charts::Series series{.name = "pair equation on a grid", .x = crossing.times, .y = crossing.curve};
  if (crossing.fine_curve.empty()) return series;
  series.y = crossing.fine_curve;
  series.x.clear();
  for (std::size_t step = 0; step < series.y.size(); ++step)
    series.x.push_back(crossing.times.back() * static_cast<double>(step) / static_cast<double>(series.y.size() - 1));
  return series;
}

/// What a logarithmic axis shows of a series: nothing at t = 0, and points with errors no nearer than a tenth.
charts::Series on_log_axis(const charts::Series& series) {
  constexpr double kStep = 1.1;
  charts::Series kept = series;
  kept.x = kept.y = kept.error = {};
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool is_near = !kept.x.empty() && !series.error.empty() && series.x[i] < kStep * kept.x.back();
    if (series.x[i] <= 0 || is_near) continue;
    kept.x.push_back(series.x[i]);
    kept.y.push_back(series.y[i]);
    if (!series.error.empty()) kept.error.push_back(series.error[i]);
  }
  return kept;
}

charts::Chart chart_of(const Problem& problem, const fokker_planck::PairCrossing& crossing,
                       const std::vector<SampledProbability>& sampled) {
  charts::ChartPanel panel{.heading = "Probability that the order has changed, over time t"};
  panel.series.push_back(curve_of(crossing));
  if (!sampled.empty()) {
    constexpr std::size_t kEvery = 2;  // so that they can be distinguished
    charts::Series points{
        .name = "Monte Carlo, two standard errors", .x = {}, .y = {}, .style = charts::SeriesStyle::kPoints};
    for (std::size_t i = 0; i < sampled.size(); i += kEvery) {
      if (sampled[i].paths == 0) continue;
      points.x.push_back(crossing.times[i]);
      points.y.push_back(sampled[i].value);
      points.error.push_back(2 * sampled[i].standard_error);
    }
    panel.series.push_back(std::move(points));
  }
  if (happens_early(crossing)) {
    panel.log_x = true;
    for (charts::Series& series : panel.series) series = on_log_axis(series);
  }
  return {.title = fmt::format("The pair crosses with probability {:.3g}", crossing.probability),
          .subtitle = fmt::format("{}  ·  {}  ·  q = {:g}, {:g}, p = {:g}, {:g}", problem.start.system.noise->spec(),
                                  problem.equation.kernel.spec(3), problem.equation.q1, problem.equation.q2,
                                  problem.equation.p1, problem.equation.p2),
          .rows = {{std::move(panel)}}};
}

std::string record_json(const PairRun& run) {
  nlohmann::ordered_json json;
  json["format"] = "pulson fokker-planck 1";
  json["version"] = version();
  add_facts(json, pair_equation_facts(), run);
  json["q"] = {run.equation.q1, run.equation.q2};
  json["p"] = {run.equation.p1, run.equation.p2};
  json["grids"] = run.crossing.grids;
  if (!run.sampled.empty()) add_facts(json, sampled_pair_facts(), run);
  return records::record_text(json);
}

std::vector<std::string> warnings_of(const fokker_planck::PairCrossing& crossing,
                                     const std::vector<SampledProbability>& sampled,
                                     const FokkerPlanckArguments& arguments) {
  std::vector<std::string> warnings;
  if (!crossing.converged)
    warnings.push_back(
        fmt::format("the stated error {:.1e} is above --tolerance {:g} times the probability {:.3g}; more "
                    "--grids may help",
                    crossing.error, arguments.options.tolerance, crossing.probability));
  if (!sampled.empty() && sampled.back().paths < arguments.samples)
    warnings.push_back(fmt::format("{} of {} sample paths are not clean and do not count; a smaller --dt may help",
                                   arguments.samples - sampled.back().paths, arguments.samples));
  return warnings;
}

int run_fokker_planck(const FokkerPlanckArguments& arguments) {
  const Problem problem = problem_of(arguments);
  if (arguments.samples < 0 || arguments.samples > 1'000'000)
    throw InputError(fmt::format("--samples is {}; it must be from 0 to 1000000", arguments.samples));
  if (!(arguments.dt > 0 && arguments.dt <= arguments.time))
    throw InputError(fmt::format("--dt is {}; it must be greater than 0 and at most --time", arguments.dt));
  arguments.output.check(kPairEquationFiles, kPairEquationPictures);
  const fokker_planck::PairCrossing crossing = crossing_probability(problem.equation, arguments.options);
  log_step(fmt::format("solved the pair equation on {} grids", crossing.grids.size()));
  const TimeGrid grid{arguments.time, static_cast<int>(std::ceil(arguments.time / arguments.dt * (1 - 1e-12)))};
  const std::vector<SampledProbability> sampled = sampled_crossing(problem, arguments, crossing.times, grid);
  log_step(fmt::format("sampled {} paths", arguments.samples));
  const PairRun run{problem.equation,
                    problem.start.system.noise->spec(),
                    arguments.options.tolerance,
                    crossing,
                    sampled,
                    arguments.samples,
                    arguments.dt};
  RunResults results(arguments.output);
  results.add("crossing.csv", crossing_csv(crossing, sampled));
  results.add("densities.csv", densities_csv(problem));
  results.commit("fokker_planck.json", record_json(run));
  const auto picture = results.draw("fokker_planck", [&](const draw::PictureFiles& files) {
    write_chart(chart_of(problem, crossing, sampled), files);
  });
  const std::vector<std::string> warnings = warnings_of(crossing, sampled, arguments);
  results.add_page([&] { return pair_report(run, warnings, problem.start.notes, picture); });
  results.finish();
  print_notes(problem.start.notes);
  if (arguments.output.prints()) {
    print_text("crossing   {} at t = {:.4g}, on a grid of {} gaps and {} momenta, {} steps, {:.2f} s\n",
               value_with_error(crossing.probability, crossing.error), arguments.time, crossing.gap_points,
               crossing.momentum_lines, crossing.steps, crossing.seconds);
    if (!sampled.empty())
      print_text("sampled    {}, {} paths, dt = {:.4g}\n", sampled.back().text(), arguments.samples, grid.dt());
    results.print_written();
  }
  for (const std::string& text : warnings) print_warning(text);
  return warnings.empty() ? kDone : kNotConverged;
}

}  // namespace

void add_fokker_planck_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("fokker-planck", "Compute densities, and a pair's crossing probability on a grid");
  auto arguments = std::make_shared<FokkerPlanckArguments>();
  arguments->start.add_to(*verb);
  verb->add_option("--time", arguments->time, "length T of the time interval")->capture_default_str();
  verb->add_option("--tolerance", arguments->options.tolerance,
                   "grids are refined until the stated error is below this part of the probability")
      ->capture_default_str();
  verb->add_option("--grids", arguments->options.most_grids, "refine no further than this, at least 2")
      ->capture_default_str();
  verb->add_option("--samples", arguments->samples, "number of sample paths to compare with")->capture_default_str();
  verb->add_option("--dt", arguments->dt, "time step of the paths")->capture_default_str();
  add_seed_option(*verb, arguments->seed);
  add_threads_option(*verb);
  arguments->output.add_to(*verb, "fokker_planck.png and .svg");
  verb->footer(
      "Example:\n"
      "  pulson fokker-planck --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out\n"
      "Exit codes: 0 done, 2 bad input, 3 the tolerance was not reached (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_fokker_planck(*arguments); });
}

}  // namespace pulson
