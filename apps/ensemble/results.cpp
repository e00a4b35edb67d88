#include "results.hpp"

#include <cmath>

#include <fmt/format.h>

#include "picture.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "records/ensemble_facts.hpp"
#include "report.hpp"
#include "shell/help_groups.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/probability_text.hpp"
#include "shell/report_parts.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kEnsembleFiles = {"ensemble.json", "means.csv", "densities.csv", "report.html"};
const std::vector<std::string> kEnsemblePictures = {"ensemble"};

std::vector<std::string> warnings_of(const records::EnsembleRun& run) {
  std::vector<std::string> warnings;
  const ensemble::PathCounts& paths = run.sums.paths;
  if (run.partial())
    warnings.push_back(
        fmt::format("partial: {} of {} paths; continue with --resume", run.sums.samples, run.options.samples));
  if (run.sums.samples > 0 && paths.clean == 0)
    warnings.push_back(fmt::format(
        "{} of {} paths are not clean; no probability and no mean is determined. A smaller --dt, or a smaller "
        "amplitude of the noise may help",
        run.sums.samples, run.sums.samples));
  else if (const std::int64_t lost = paths.no_root + paths.momentum_bound; lost > 0)
    warnings.push_back(
        fmt::format("{} of {} paths are not clean; statistics at each time are over the paths clean up to then. A "
                    "smaller --dt may help",
                    lost, run.sums.samples));
  return warnings;
}

// The states that were kept, outside the folder.
void write_states(const records::EnsembleRun& run, const EnsembleOutput& arguments, RunResults& results) {
  const auto n = static_cast<std::size_t>(run.start.q.cols());
  const auto d = static_cast<std::size_t>(run.start.q.rows());
  const auto samples = static_cast<std::size_t>(run.sums.samples);
  const std::size_t records = run.options.keep == ensemble::KeepStates::kAll ? run.options.records.size() : 1;
  if (!arguments.save_paths.empty())
    results.write_outside([&] {
      formats::write_npy(arguments.save_paths, run.sums.states, {samples, records, 2, n, d});
    });
  if (!arguments.save_final.empty()) {
    std::vector<double> last;
    for (std::size_t m = 0; m < samples; ++m) {
      const auto* const begin = run.sums.states.data() + (m * records + records - 1) * 2 * n * d;
      last.insert(last.end(), begin, begin + 2 * n * d);
    }
    results.write_outside([&] { formats::write_npy(arguments.save_final, last, {samples, 2, n, d}); });
  }
}

void write_results(const records::EnsembleRun& run, const EnsembleOutput& arguments, RunResults& results) {
  results.add("means.csv", ensemble_means_csv(run));
  results.add("densities.csv", ensemble_densities_csv(run));
  Json more = Json::object();
  if (!run.partial()) more["run"] = ensemble_fingerprint(run);
  results.commit("ensemble.json", ensemble_json(run), more);
  write_states(run, arguments, results);
  const draw::EnsemblePicture shape = run.sums.paths.clean > 1 ? make_ensemble_picture(run) : draw::EnsemblePicture{};
  if (run.sums.paths.clean > 1)
    results.draw("ensemble", [&](const draw::PictureFiles& files) { write_ensemble_picture(run, shape, files); });
  results.add_page([&] { return ensemble_report(run, shape, warnings_of(run), run.notes, results.shown("ensemble")); });
  results.finish();
}

void print_summary(const records::EnsembleRun& run) {
  const ensemble::EnsembleSums& sums = run.sums;
  const auto text = [&](std::string_view key) { return text_of(records::ensemble_facts(), key, run); };
  print_text("{}{} paths of {} landmarks in {}D to t = {}: {} steps of {}, seed {}{}\n",
             run.partial() ? "PARTIAL: " : "", text("samples"), run.shape.count(), run.shape.dimension(), text("time"),
             text("steps"), text("dt"), text("seed"), run.options.antithetic ? ", antithetic" : "");
  print_text("model      {}, noise {}, integrator {}\n", text("kernel"), text("noise"), text("integrator"));
  print_text("sampled    in {} s on {}, {}\n", text("seconds"), counted(run.threads, "thread"), text("method"));
  print_text("paths      {} clean, {} without a root, {} with momenta beyond {}, {} ties\n", text("paths.clean"),
             text("paths.no_root"), text("paths.momentum_bound"), short_number(run.options.momentum_bound),
             text("paths.tie"));
  if (run.has_crossing())
    print_text("crossing   {} of the clean paths end in a different order; {} were in one at some step\n",
               probability_text(sums.crossing_probability(), sums.paths.clean), text("crossing.ever"));
  const NoiseTraits traits = run.system.noise->traits();
  if (traits.translation_invariant && traits.hamiltonian && sums.paths.clean > 0)
    print_text("momentum   total {}\n", conservation(sums.momentum_error));
}

}  // namespace

void EnsembleOutput::add_to(CLI::App& verb) {
  begin_group(verb, more(kInputGroup));
  writes_file(
      verb.add_option("--save-final", save_final, "write the final states: .npy, [sample][q,p][landmark][axis]"));
  writes_file(verb.add_option("--save-paths", save_paths,
                              "write the states at the records: .npy, [sample][record][q,p][landmark][axis]"));
  output.add_to(verb, "ensemble.png and .svg");
}

void EnsembleOutput::check() const {
  output.check(kEnsembleFiles, kEnsemblePictures);
  for (const std::string& file : {save_final, save_paths})
    if (!file.empty()) check_output_file(file);
}

int EnsembleOutput::finish(const records::EnsembleRun& run) const {
  RunResults results(output);
  write_results(run, *this, results);
  print_notes(run.notes);
  if (output.prints()) {
    print_summary(run);
    results.print_written();
  }
  const std::vector<std::string> warnings = warnings_of(run);
  for (const std::string& text : warnings) print_warning(text);
  return warnings.empty() ? kDone : kNotConverged;
}

}  // namespace pulson
