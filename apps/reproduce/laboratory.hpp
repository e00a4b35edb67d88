#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "charts/chart.hpp"
#include "html/html_report.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "shell/messages.hpp"

namespace pulson {

/// The user asked to stop.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

/// A kernel of §5 of the paper.
struct PaperKernel {
  std::string spec;
  std::string name;      ///< for csv and file names
  std::string particle;  ///< "Gaussian pulsons", "peakons"
};

const std::vector<PaperKernel>& paper_kernels();

/// Two pulsons as in §5: q = (0, 10), p₂ = 1.
struct PaperPair {
  PaperKernel kernel = paper_kernels().front();
  std::string noise = "none";
  double p1 = 4;
};

PhaseState paper_start(double p1);
StochasticSystem paper_system(const PaperPair& pair);

/// Sizes of the experiments; the defaults are the paper's.
struct ExperimentOptions {
  std::filesystem::path out;
  bool quick = false;
  std::int64_t samples = 50000;
  std::uint64_t seed = 1;
  TimeGrid grid{100, 5000};
  double beta_step = 0.25;
  bool pictures = true;
};

/// What all experiments need: ensembles with progress, and the places of their files.
class Laboratory {
 public:
  Laboratory(ExperimentOptions options, Progress& progress) : options_(std::move(options)), progress_(progress) {}

  const ExperimentOptions& options() const { return options_; }

  /// An ensemble of the pair by (20) as printed. `what` is shown. @throws Interrupted
  ensemble::EnsembleSums sample(const PaperPair& pair, const std::string& what, std::vector<int> records = {},
                                ensemble::KeepStates keep = ensemble::KeepStates::kNone) const;
  /// Any ensemble to its end. @throws Interrupted
  ensemble::EnsembleSums finish(ensemble::Ensemble ensemble, const std::string& what) const;
  /// Sample paths 0, 1, … of the pair. @throws Interrupted
  std::vector<ensemble::SamplePath> paths(const PaperPair& pair, int count) const;

  void show(const std::string& what) const;

  /// Writes a csv file. The result is its name.
  std::string write_csv(const std::string& name, const std::string& text) const;
  /// Draws NAME.png and .svg and puts the picture into the section.
  void add_chart(html::ReportSection& section, const std::string& name, const charts::Chart& chart,
                 const std::string& caption) const;

 private:
  static void check_interrupt();

  ExperimentOptions options_;
  Progress& progress_;
};

/// Puts the time of a panel on a logarithmic axis, from t = 1, where all that happens takes a few hundredths of it.
void show_early_times(charts::ChartPanel& panel, const TimeGrid& grid);

/// "0.7005 ± 0.0020"
std::string text_of(const Estimate& estimate);

/// "3e-15"
std::string text_of(double value);

/// The difference of two estimates in standard errors.
double standard_errors_apart(const Estimate& a, const Estimate& b);

using RunExperiment = html::ReportSection (*)(const Laboratory&);

/// One experiment of the paper.
struct Experiment {
  std::string name;  ///< `figure1`
  std::string help;
  RunExperiment run;
};

/// All experiments, in the order of the paper.
const std::vector<Experiment>& experiments();

html::ReportSection figure1(const Laboratory& laboratory);
html::ReportSection figure2(const Laboratory& laboratory);
html::ReportSection figure3(const Laboratory& laboratory);
html::ReportSection figure4(const Laboratory& laboratory);
html::ReportSection section54(const Laboratory& laboratory);
html::ReportSection fokker_planck_equation(const Laboratory& laboratory);

}  // namespace pulson
