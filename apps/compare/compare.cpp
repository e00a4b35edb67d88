// `pulson compare`: which noise do these shapes call for?

#include <algorithm>
#include <memory>
#include <mutex>

#include <fmt/core.h>

#include "arguments.hpp"
#include "noise_map.hpp"
#include "picture.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "record.hpp"
#include "report.hpp"
#include "sentences.hpp"
#include "shell/audit_warnings.hpp"
#include "shell/messages.hpp"
#include "shell/ranks.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "study.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kComparisonFiles = {"comparison.json", "models.csv", "shapes.csv",  "spectrum.csv",
                                                   "landmarks.csv",   "source.csv", "aligned.csv", "specimens.csv",
                                                   "checks.csv",      "sigma.csv",  "report.html"};
const std::vector<std::string> kComparisonPictures = {"comparison", "noise_map", "sigma"};

std::string csv_of(const std::string& name, const std::vector<Landmarks>& shapes) {
  return formats::landmark_format_to_write(name).write(name, {"csv", shapes, {}, {}, {}}).text;
}

void write_comparison(const compare::Comparison& comparison, const compare::CohortShapes& shapes,
                      const std::vector<std::string>& notes, double seconds, RunResults& staged) {
  staged.add("models.csv", models_csv(comparison));
  staged.add("shapes.csv", shapes_csv(comparison));
  staged.add("spectrum.csv", spectrum_csv(comparison));
  staged.add("landmarks.csv", landmarks_csv(comparison));
  staged.add("source.csv", formats::landmarks_csv(comparison.cohort.source));
  staged.add("aligned.csv", csv_of("aligned.csv", comparison.cohort.targets));
  staged.add("specimens.csv", specimens_csv(shapes));
  if (comparison.models[comparison.best].checks) staged.add("checks.csv", checks_csv(comparison));
  if (comparison.profile) staged.add("sigma.csv", sigma_csv(comparison));
  staged.commit("comparison.json", comparison_json(comparison, seconds));
  staged.draw("comparison", [&](const draw::PictureFiles& files) { write_chart(comparison_chart(comparison), files); });
  if (has_noise_map(comparison))
    staged.draw("noise_map", [&](const draw::PictureFiles& files) { write_noise_map(comparison, files); });
  if (comparison.profile)
    staged.draw("sigma", [&](const draw::PictureFiles& files) { write_chart(sigma_chart(comparison), files); });
  std::vector<std::filesystem::path> shown;
  for (const char* stem : {"comparison", "sigma", "noise_map"})
    if (std::filesystem::path file = staged.shown(stem); !file.empty()) shown.push_back(std::move(file));
  staged.add_page([&] { return comparison_report(comparison, notes, seconds, shown); });
  staged.finish();
}

int run_comparison(const CompareArguments& arguments, const compare::CohortShapes& shapes,
                   compare::CompareOptions options, std::vector<std::string> notes) {
  const double start = seconds_now();
  Progress progress;
  const std::vector<NoiseChoice> noises = arguments.candidates();
  std::size_t begun = 0;
  int matches = 0;
  std::mutex turn;
  const auto show = [&] {
    progress.show(
        (static_cast<double>(begun) - 1) / static_cast<double>(noises.size()),
        fmt::format("model {}/{}: {} matches of {} shapes", begun, noises.size(), matches, shapes.targets.size()));
  };
  options.settings.on_match = [&] {
    const std::lock_guard lock(turn);
    ++matches;
    show();
  };
  options.on_model = [&](int model, const std::string& noise) {
    const std::lock_guard lock(turn);
    ++begun;
    show();
    log_step(fmt::format("model {} of {}: {}", model + 1, noises.size(), noise));
  };
  arguments.output.check(kComparisonFiles, kComparisonPictures);
  const compare::Comparison comparison = compare_models(shapes, noises, options);
  progress.clear();
  log_step("compared the models");
  const double seconds = seconds_now() - start;
  notes.insert(notes.end(), comparison.notes.begin(), comparison.notes.end());
  RunResults results(arguments.output);
  const std::string wrong = shapes.source && shapes.targets.size() == 1
                                ? pair_warning(*shapes.source, shapes.targets.front(), notes)
                                : std::string();
  write_comparison(comparison, shapes, notes, seconds, results);
  print_notes(notes);
  if (arguments.output.prints()) {
    print_comparison(comparison);
    results.print_written();
  }
  if (!wrong.empty()) print_warning(wrong);
  if (const std::string steps = steps_warning(comparison); !steps.empty()) print_warning(steps);
  if (shapes.targets.size() > 1) warn_of_cohort(shapes.targets);
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
  log_step(fmt::format("read {}", counted(std::ssize(shapes.targets), "shape")));
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
      "  pulson compare a.csv b.csv -o out --noise none --noise ch-sd:beta=fit --noise ch-sd:beta=0.3 --sigma 0.02\n"
      "  pulson compare skulls.tps -o out --source skulls.tps#1 --align similarity --sigma 0.5\n"
      "  pulson compare skulls.tps -o out --sigma 0.5 --simulate all --count 50\n"
      "  pulson compare skulls.tps --sigma 0.5 --simulate all --count 50 --shard 3/8 -o parts\n"
      "Exit codes: 0 done, 2 bad input, 3 a fit did not converge (results are written).");
  verb->callback([arguments, verb, &exit_code] { exit_code = run_compare(*arguments, *verb); });
}

}  // namespace pulson
