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

const std::vector<PaperKernel>& paper_kernels() {
  static const std::vector<PaperKernel> kKernels = {{"gaussian:alpha=1", "gaussian", "Gaussian pulsons"},
                                                    {"peakon:alpha=0.5", "peakon", "peakons"}};
  return kKernels;
}

PhaseState paper_start(double p1) { return {(Points(1, 2) << 0, 10).finished(), (Points(1, 2) << p1, 1).finished()}; }

StochasticSystem paper_system(const PaperPair& pair) {
  return {make_kernel(pair.kernel.spec, {}), make_noise(pair.noise)};
}

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> kExperiments = {
      {"figure1", "sample paths, and whether pulsons cross (5.1)", figure1},
      {"figure2", "mean paths (5.1)", figure2},
      {"figure3", "crossing probability over beta (5.2)", figure3},
      {"figure4", "sample paths with noise screening (5.3)", figure4},
      {"section5.4", "parametric noise and noise in the momenta (5.4)", section54},
      {"fokker-planck", "densities (15) and (18), and crossing without sampling (3)", fokker_planck_equation}};
  return kExperiments;
}

ensemble::EnsembleSums Laboratory::sample(const PaperPair& pair, const std::string& what, std::vector<int> records,
                                          ensemble::KeepStates keep) const {
  ensemble::EnsembleOptions options;
  options.grid = options_.grid;
  options.seed = options_.seed;
  options.samples = options_.samples;
  options.records = std::move(records);
  options.keep = keep;
  return finish(ensemble::Ensemble(paper_system(pair), "variational-paper", paper_start(pair.p1), std::move(options)),
                what);
}

ensemble::EnsembleSums Laboratory::finish(ensemble::Ensemble ensemble, const std::string& what) const {
  while (!ensemble.done()) {
    check_interrupt();
    progress_.show(static_cast<double>(ensemble.sums().samples) / static_cast<double>(ensemble.options().samples),
                   what);
    ensemble.advance(4 * thread_count());
  }
  return ensemble.sums();
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
    write_chart(chart, {options_.out / (name + ".png"), svg});
    section.blocks.emplace_back(html::ReportPicture{svg, caption});
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

std::string text_of(double value) { return fmt::format("{:.4g}", value); }

double standard_errors_apart(const Estimate& a, const Estimate& b) {
  return (a.value - b.value) / std::hypot(a.standard_error, b.standard_error);
}

}  // namespace pulson
