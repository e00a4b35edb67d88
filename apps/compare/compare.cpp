// `pulson compare`: which noise do these shapes call for?

#include <algorithm>
#include <memory>
#include <mutex>

#include <fmt/core.h>

#include "arguments.hpp"
#include "core/atomic_file.hpp"
#include "noise_map.hpp"
#include "picture.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "record.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/ranks.hpp"
#include "shell/tables.hpp"
#include "shell/verbs.hpp"
#include "study.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kComparisonFiles = {"comparison.json", "models.csv",    "shapes.csv",
                                                   "spectrum.csv",    "landmarks.csv", "source.csv",
                                                   "aligned.csv",     "specimens.csv", "report.html"};
const std::vector<std::string> kComparisonPictures = {"comparison", "noise_map"};

// All files of a comparison, or none of them. @return stems of the pictures drawn
std::vector<std::string> write_comparison(const compare::Comparison& comparison, const compare::CohortShapes& shapes,
                                          const std::vector<std::string>& notes, double seconds,
                                          const OutputOptions& output) {
  StagedFiles staged(output.out);
  const std::string record = comparison_json(comparison, seconds);
  staged.write("comparison.json", record);
  staged.write("models.csv", as_table(models_csv(comparison)));
  staged.write("shapes.csv", as_table(shapes_csv(comparison)));
  staged.write("spectrum.csv", as_table(spectrum_csv(comparison)));
  staged.write("landmarks.csv", as_table(landmarks_csv(comparison)));
  staged.write("source.csv", as_table(formats::landmarks_csv(comparison.cohort.source)));
  write_landmarks(staged.file("aligned.csv"), {"csv", comparison.cohort.targets, {}, {}, {}});
  staged.write("specimens.csv", as_table(specimens_csv(shapes)));
  std::vector<std::string> pictures{"comparison"};
  if (has_noise_map(comparison)) pictures.emplace_back("noise_map");
  if (!output.no_picture) {
    write_chart(comparison_chart(comparison), output.picture_files(staged.file("comparison")));
    if (has_noise_map(comparison)) write_noise_map(comparison, output.picture_files(staged.file("noise_map")));
  }
  std::vector<std::filesystem::path> shown;
  for (const std::string& picture : pictures)
    if (std::filesystem::path file = output.shown_picture(staged.file(picture)); !file.empty())
      shown.push_back(std::move(file));
  staged.write("report.html", html_report(comparison_report(comparison, notes, seconds, shown)));
  output.write_json(record);
  staged.commit();
  return pictures;
}

int run_comparison(const CompareArguments& arguments, const compare::CohortShapes& shapes,
                   compare::CompareOptions options, std::vector<std::string> notes) {
  const double start = seconds_now();
  Progress progress;
  double part = 0;
  std::string name;
  int matches = 0;
  std::mutex turn;
  options.settings.on_match = [&] {
    const std::lock_guard lock(turn);
    progress.show(part, fmt::format("{}: {} matches of {} shapes", name, ++matches, shapes.targets.size()));
  };
  options.on_model = [&](int model, const std::string& noise) {
    const std::lock_guard lock(turn);
    part = static_cast<double>(model) / static_cast<double>(arguments.noises.size());
    name = noise;
    matches = 0;
    progress.show(part, noise);
    log_step(fmt::format("model {} of {}: {}", model + 1, arguments.noises.size(), noise));
  };
  arguments.output.check(kComparisonFiles, kComparisonPictures);
  const compare::Comparison comparison =
      compare_models(shapes, {arguments.noises.begin(), arguments.noises.end()}, options);
  progress.clear();
  const double seconds = seconds_now() - start;
  notes.insert(notes.end(), comparison.notes.begin(), comparison.notes.end());
  const std::vector<std::string> pictures = write_comparison(comparison, shapes, notes, seconds, arguments.output);
  print_notes(notes);
  if (arguments.output.prints()) {
    print_comparison(comparison);
    arguments.output.print_written(kComparisonFiles, pictures);
  }
  const bool converged = std::all_of(comparison.models.begin(), comparison.models.end(),
                                     [](const compare::ComparedModel& model) { return model.fit.converged; });
  return converged ? kDone : kNotConverged;
}

int run_compare(const CompareArguments& arguments, const CLI::App& verb) {
  if (!arguments.simulate.empty()) return run_study(arguments, settings_of(verb));
  if (ranks::size() > 1)
    throw InputError(
        fmt::format("there are {} ranks; a comparison is for one process, and with --simulate cohorts are "
                    "shared",
                    ranks::size()));
  std::vector<std::string> notes;
  const compare::CohortShapes shapes = arguments.read(notes);
  const compare::CompareOptions options = arguments.compare_options(shapes, notes);
  return run_comparison(arguments, shapes, options, notes);
}

}  // namespace

void add_compare_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("compare", "Fit noise models to shapes, and rank them");
  auto arguments = std::make_shared<CompareArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson compare skulls.tps -o out --sigma 0.5\n"
      "  pulson compare a.csv b.csv -o out --noise none --noise ch-sd --noise ch-sd:beta=0.3 --sigma 0.02\n"
      "  pulson compare skulls.tps -o out --source skulls.tps#1 --align similarity --sigma 0.5\n"
      "  pulson compare skulls.tps -o out --sigma 0.5 --simulate all --count 50\n"
      "  pulson compare skulls.tps --sigma 0.5 --simulate all --count 50 --shard 3/8 -o parts\n"
      "Exit codes: 0 done, 2 bad input, 3 a fit did not converge (results are written).");
  verb->callback([arguments, verb, &exit_code] {
    if (arguments->noises.empty()) arguments->noises = usual_noises();
    exit_code = run_compare(*arguments, *verb);
  });
}

}  // namespace pulson
