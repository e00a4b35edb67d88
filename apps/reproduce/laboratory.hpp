#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "charts/chart.hpp"
#include "ensemble/saved_ensembles.hpp"
#include "ensemble/sweep.hpp"
#include "html/html_report.hpp"
#include "own_values.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"
#include "shell/messages.hpp"

namespace pulson {

/// Two pulsons as in §5: q = (0, 10), p₂ = 1.
struct PaperPair {
  PaperKernel kernel = paper_kernels().front();
  std::string noise = "none";
  double p1 = 4;
};

PhaseState paper_start(double p1);
Landmarks paper_shape();
StochasticSystem paper_system(const PaperPair& pair);

/// Sizes of the experiments; the defaults are the paper's.
struct ExperimentOptions {
  std::filesystem::path out;
  bool quick = false;
  std::int64_t samples = 50000;
  std::uint64_t seed = 1;
  TimeGrid grid{kPaperTime, 5000};
  bool pictures = true;
  OwnValues own{};
};

/// What is known of a crossing on a grid.
struct GridCrossing {
  double probability = 0;
  double error = 0;
  std::vector<double> grids{};
  double seconds = 0;
};

/// What all experiments need: ensembles and grids with progress, saved as they are finished, and the places of their
/// files.
class Laboratory {
 public:
  Laboratory(ExperimentOptions options, const SavedEnsembles& saved, Progress& progress)
      : options_(std::move(options)), saved_(saved), progress_(progress) {}

  const ExperimentOptions& options() const { return options_; }
  const OwnValues& own() const { return options_.own; }

  /// An ensemble of the pair by (20) as printed. `what` is shown. @throws Interrupted
  ensemble::EnsembleSums sample(const PaperPair& pair, const std::string& what, std::vector<int> records = {},
                                ensemble::KeepStates keep = ensemble::KeepStates::kNone) const;
  /// Any ensemble of a start and a system to its end. @throws Interrupted
  ensemble::EnsembleSums finish(const StochasticSystem& system, const std::string& integrator, const PhaseState& start,
                                const ensemble::EnsembleOptions& options, const std::string& what) const;
  /// An ensemble of the pair for each amplitude of its noise. @throws Interrupted
  std::vector<records::SweepPoint> sweep(const PaperPair& pair, const std::vector<double>& betas,
                                         const std::string& what) const;
  /// Crossing probabilities without sampling. @throws Interrupted
  std::vector<GridCrossing> solve(const std::vector<fokker_planck::PairEquation>& pairs, int most_grids,
                                  const std::string& what) const;
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

  ensemble::EnsembleOptions ensemble_options() const;

  ExperimentOptions options_;
  const SavedEnsembles& saved_;
  Progress& progress_;
};

/// Puts the time of a panel on a logarithmic axis, from t = 1, where all that happens takes a few hundredths of it.
void show_early_times(charts::ChartPanel& panel, const TimeGrid& grid);

/// "0.7005 ± 0.0020"
std::string text_of(const Estimate& estimate);

/// "3e-15"
std::string text_of(double value);

/// In place of claims: that the values are not the paper's, and the crossings that were counted with them.
void add_own_results(html::ReportSection& section, const OwnValues& own,
                     const std::vector<std::pair<PaperPair, ensemble::EnsembleSums>>& ensembles);

/// The difference of two estimates in standard errors.
double standard_errors_apart(const Estimate& a, const Estimate& b);

using RunExperiment = html::ReportSection (*)(const Laboratory&);

/// One experiment of the paper.
struct Experiment {
  std::string name;  ///< `figure1`
  std::string help;
  RunExperiment run;
  OwnValuesTaken takes{};
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
