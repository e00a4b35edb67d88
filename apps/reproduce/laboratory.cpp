#include "laboratory.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/outputs.hpp"
#include "shell/probability_text.hpp"
#include "shell/tables.hpp"

namespace pulson {

PhaseState paper_start(double p1) { return {(Points(1, 2) << 0, 10).finished(), (Points(1, 2) << p1, 1).finished()}; }

Landmarks paper_shape() {
  Landmarks shape;
  shape.points = paper_start(1).q;
  return shape;
}

StochasticSystem paper_system(const PaperPair& pair) {
  return {make_kernel(pair.kernel.spec, {}), make_noise(pair.noise, paper_shape())};
}

const std::vector<Experiment>& experiments() {
  using Betas = OwnValuesTaken::Betas;
  static const std::vector<Experiment> kExperiments = {
      {"figure1", "sample paths, and whether pulsons cross (5.1)", figure1, {Betas::kOne, true}},
      {"figure2", "mean paths (5.1)", figure2, {Betas::kSeveral, true}},
      {"figure3", "crossing probability over beta (5.2)", figure3, {Betas::kSeveral, true}},
      {"figure4", "sample paths with noise screening (5.3)", figure4, {Betas::kOne, true}},
      {"section5.4", "parametric noise and noise in the momenta (5.4)", section54, {Betas::kSeveral, true}},
      {"fokker-planck", "densities (15) and (18), and crossing without sampling (3)", fokker_planck_equation}};
  return kExperiments;
}

ensemble::EnsembleOptions Laboratory::ensemble_options() const {
  ensemble::EnsembleOptions options;
  options.grid = options_.grid;
  options.seed = options_.seed;
  options.samples = options_.samples;
  return options;
}

ensemble::EnsembleSums Laboratory::sample(const PaperPair& pair, const std::string& what, std::vector<int> records,
                                          ensemble::KeepStates keep) const {
  ensemble::EnsembleOptions options = ensemble_options();
  options.records = std::move(records);
  options.keep = keep;
  return finish(paper_system(pair), "variational-paper", paper_start(pair.p1), options, what);
}

namespace {

records::EnsembleRun run_of(const StochasticSystem& system, const std::string& integrator, const PhaseState& start,
                            const ensemble::EnsembleOptions& options) {
  Landmarks shape;
  shape.points = start.q;
  return {system, integrator, std::move(shape), start, options, {}, {}, "", 1, 0};
}

nlohmann::ordered_json facts_of(const std::vector<fokker_planck::PairEquation>& pairs, int most_grids) {
  nlohmann::ordered_json facts{{"most_grids", most_grids}, {"pairs", nlohmann::ordered_json::array()}};
  for (const fokker_planck::PairEquation& pair : pairs)
    facts["pairs"].push_back({pair.kernel.spec(), pair.beta, pair.time, pair.q1, pair.q2, pair.p1, pair.p2});
  return facts;
}

}  // namespace

ensemble::EnsembleSums Laboratory::finish(const StochasticSystem& system, const std::string& integrator,
                                          const PhaseState& start, const ensemble::EnsembleOptions& options,
                                          const std::string& what) const {
  records::EnsembleRun run = run_of(system, integrator, start, options);
  saved_.sample(run, what, progress_);
  return run.sums;
}

std::vector<records::SweepPoint> Laboratory::sweep(const PaperPair& pair, const std::vector<double>& betas,
                                                   const std::string& what) const {
  const records::EnsembleRun base = run_of(paper_system({pair.kernel, noise_at(pair.noise, 1), pair.p1}),
                                           "variational-paper", paper_start(pair.p1), ensemble_options());
  return sample_sweep(base, {amplitude_name(pair.noise), betas}, saved_, what, progress_);
}

std::vector<GridCrossing> Laboratory::solve(const std::vector<fokker_planck::PairEquation>& pairs, int most_grids,
                                            const std::string& what) const {
  constexpr int kAtOnce = 8;  // between looks at the user
  records::UnitRun run;
  run.verb = "grids";
  run.facts = facts_of(pairs, most_grids);
  run.units = static_cast<int>(pairs.size());
  saved_.finish_units(run, kAtOnce, [&](int first, int last, records::UnitRun& units) {
    show(fmt::format("{}, grids {} of {}", what, first, pairs.size()));
    const std::vector<fokker_planck::PairCrossing> solved = fokker_planck::crossing_probabilities(
        {pairs.begin() + first, pairs.begin() + last}, {.most_grids = most_grids});
    for (int i = first; i < last; ++i) {
      const fokker_planck::PairCrossing& one = solved[static_cast<std::size_t>(i - first)];
      units.results[i] = {
          {"probability", one.probability}, {"error", one.error}, {"grids", one.grids}, {"seconds", one.seconds}};
    }
  });
  std::vector<GridCrossing> crossings;
  for (const auto& [unit, json] : run.results)
    crossings.push_back({json.at("probability").get<double>(), json.at("error").get<double>(),
                         json.at("grids").get<std::vector<double>>(), json.at("seconds").get<double>()});
  return crossings;
}

std::vector<ensemble::SamplePath> Laboratory::paths(const PaperPair& pair, int count) const {
  show("sample paths");
  ensemble::SamplePathsOptions options;
  options.grid = options_.grid;
  options.seed = options_.seed;
  options.samples = count;
  return sample_paths(paper_system(pair), *make_integrator("variational-paper"), paper_start(pair.p1), options);
}

void Laboratory::check_interrupt() {
  if (Interrupt::came()) throw Interrupted();
}

void Laboratory::show(const std::string& what) const {
  check_interrupt();
  progress_.show(what);
}

std::string Laboratory::write_csv(const std::string& name, const std::string& text) const {
  write_file_atomically(options_.out / name, as_table(text));
  return name;
}

void Laboratory::add_chart(html::ReportSection& section, const std::string& name, const charts::Chart& chart,
                           const std::string& caption) const {
  if (!options_.pictures) return;
  const std::filesystem::path svg = options_.out / (name + ".svg");
  try {
    std::string narrow;
    write_chart(chart, {.png = options_.out / (name + ".png"), .svg = svg, .narrow = &narrow});
    section.blocks.emplace_back(html::ReportPicture{
        .picture = svg, .caption = caption, .narrow = html::EncodedPicture{html::MediaType::kPng, std::move(narrow)}});
    note_missing_font();
  } catch (const Error& error) {
    print_warning(fmt::format("the picture {} was not made: {}; its numbers are in '{}'", name, error.what(),
                              options_.out.string()));
  }
}

std::string text_of(const Estimate& estimate) { return value_with_error(estimate.value, estimate.standard_error); }

void show_early_times(charts::ChartPanel& panel, const TimeGrid& grid) {
  constexpr double kFirst = 1, kLong = 20;
  if (grid.time < kLong) return;
  for (charts::Series& series : panel.series) {
    const auto later = std::find_if(series.x.begin(), series.x.end(), [](double t) { return t >= kFirst; });
    const auto dropped = later - series.x.begin();
    for (std::vector<double>* values : {&series.x, &series.y, &series.low, &series.high})
      if (!values->empty()) values->erase(values->begin(), values->begin() + dropped);
  }
  panel.log_x = true;
}

void add_own_results(html::ReportSection& section, const OwnValues& own,
                     const std::vector<std::pair<PaperPair, ensemble::EnsembleSums>>& ensembles) {
  section.blocks.emplace_back(html::ReportParagraph{
      fmt::format("These are not the paper's values ({}), so its claims are not judged.", own.text())});
  if (ensembles.empty()) return;
  html::ReportTable table{{"kernel", "noise", "p̄₁", "crossed at the end", "clean", "no root", "momenta beyond 1e8"},
                          {}};
  for (const auto& [pair, sums] : ensembles)
    table.rows.push_back({{pair.kernel.spec},
                          {pair.noise},
                          {fmt::format("{:g}", pair.p1)},
                          {probability_text(sums.crossing_probability(), sums.paths.clean)},
                          {fmt::to_string(sums.paths.clean)},
                          {fmt::to_string(sums.paths.no_root)},
                          {fmt::to_string(sums.paths.momentum_bound)}});
  section.blocks.emplace_back(std::move(table));
}

std::string text_of(double value) { return fmt::format("{:.4g}", value); }

double standard_errors_apart(const Estimate& a, const Estimate& b) {
  return (a.value - b.value) / std::hypot(a.standard_error, b.standard_error);
}

}  // namespace pulson
