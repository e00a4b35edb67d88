// The approximate posterior by an ensemble Kalman smoother.

#include "ensemble_kalman.hpp"

#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "picture.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kEnsembleFiles = {"summary.json", "momenta.npy", "paths.npy", "report.html"};
const std::vector<std::string> kEnsemblePictures = {"paths"};

// |r|²/n above which the members do not have the data within their errors.
constexpr double kHighMisfit = 4;

std::vector<std::string> warnings_of(const inference::EnsembleDraws& ensemble) {
  std::vector<std::string> warnings;
  if (ensemble.lost > 0)
    warnings.push_back(
        fmt::format("{} of {} members have no path and were dropped; take more --steps, or a larger --lambda",
                    ensemble.lost, ensemble.lost + ensemble.draws.draws));
  if (ensemble.misfit > kHighMisfit)
    warnings.push_back(
        fmt::format("the members are {:.2g} sigma from the target (root mean square), where draws of the posterior are "
                    "about 1 or less; take more --members, or a larger --lambda",
                    std::sqrt(ensemble.misfit)));
  return warnings;
}

void print_summary(const inference::PosteriorProblem& problem, const inference::EnsembleDraws& ensemble,
                   const PosteriorSummary& summary) {
  const auto rms_sd = [](const std::vector<std::vector<inference::DrawSummary>>& specimens) {
    double sum = 0, count = 0;
    for (const auto& specimen : specimens)
      for (const inference::DrawSummary& numbers : specimen) {
        sum += numbers.sd * numbers.sd;
        ++count;
      }
    return std::sqrt(sum / count);
  };
  const Landmarks& source = problem.sources.front();
  print_text("{}: {} of {} in {}D\n", source.source.empty() ? "source" : source.source,
             counted(static_cast<std::int64_t>(problem.targets.size()), "target"), counted(source.count(), "landmark"),
             source.dimension());
  print_text("model      {}\n", model_words(problem));
  print_text("sampled    {} members, {} paths in {:.1f} s, {}\n", ensemble.draws.draws, ensemble.draws.path_evaluations,
             ensemble.draws.seconds, localisation_words(ensemble));
  print_text("misfit     {:.3g} sigma (root mean square)\n", std::sqrt(ensemble.misfit));
  print_text("sd         {:.3g} of a coordinate of p0, {:.3g} of q(T/2), {:.3g} of q(T) (root mean squares)\n",
             rms_sd(summary.momenta), rms_sd(summary.middles), rms_sd(summary.ends));
}

}  // namespace

int run_ensemble_kalman(const SampleArguments& arguments, const CLI::App& /*verb*/) {
  std::vector<std::string> notes;
  const SampleShapes shapes = arguments.read(notes);
  const inference::PosteriorProblem problem = arguments.problem(shapes, notes);
  const OutputOptions& output = arguments.output;
  output.check(kEnsembleFiles, kEnsemblePictures);
  Progress progress;
  std::mutex turn;
  inference::EnsembleKalmanOptions options = arguments.ensemble_kalman(problem);
  options.on_progress = [&](double fraction) {
    const std::lock_guard lock(turn);
    progress.show(fraction, "sampling");
  };
  const inference::EnsembleDraws ensemble = sample_ensemble(problem, options);
  progress.clear();
  const PosteriorSummary summary = summarise_posterior(ensemble.draws);
  const std::vector<std::string> warnings = warnings_of(ensemble);
  const std::string record = ensemble_json(problem, options, ensemble, summary, notes);
  RunResults files(output);
  files.add("momenta.npy", momenta_npy(problem, ensemble.draws));
  files.add("paths.npy", paths_npy(problem, ensemble.draws));
  files.commit("summary.json", record);
  files.draw("paths", [&](const draw::PictureFiles& drawn) { write_paths_picture(problem, ensemble.draws, 0, drawn); });
  files.add_page([&] { return ensemble_report(problem, ensemble, summary, warnings, notes, files.shown("paths")); });
  files.finish();
  print_notes(notes);
  if (output.prints()) {
    print_summary(problem, ensemble, summary);
    files.print_written();
  }
  for (const std::string& text : warnings) print_warning(text);
  return ensemble.misfit > kHighMisfit ? kNotConverged : kDone;
}

}  // namespace pulson
