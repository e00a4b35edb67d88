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
#include "shell/verbs.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kComparisonFiles = {"comparison.json", "models.csv",    "shapes.csv",
                                                   "spectrum.csv",    "landmarks.csv", "source.csv",
                                                   "aligned.csv",     "specimens.csv", "report.html"};
const std::vector<std::string> kComparisonPictures = {"comparison", "noise_map"};
const std::vector<std::string> kStudyFiles = {"recovery.json", "report.html"};
const std::vector<std::string> kStudyPictures = {"recovery"};

std::vector<NoiseChoice> choices(const std::vector<std::string>& noises) { return {noises.begin(), noises.end()}; }

// All files of a comparison, or none of them. @return stems of the pictures drawn
std::vector<std::string> write_comparison(const compare::Comparison& comparison, const compare::CohortShapes& shapes,
                                          const std::vector<std::string>& notes, double seconds,
                                          const OutputOptions& output) {
  StagedFiles staged(output.out);
  const std::string record = comparison_json(comparison, seconds);
  staged.write("comparison.json", record);
  staged.write("models.csv", models_csv(comparison));
  staged.write("shapes.csv", shapes_csv(comparison));
  staged.write("spectrum.csv", spectrum_csv(comparison));
  staged.write("landmarks.csv", landmarks_csv(comparison));
  formats::write_landmarks_csv(staged.file("source.csv"), comparison.cohort.source);
  formats::write_landmark_file(staged.file("aligned.csv"), {"csv", comparison.cohort.targets, {}, {}, {}});
  staged.write("specimens.csv", specimens_csv(shapes));
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
  const compare::Comparison comparison = compare_models(shapes, choices(arguments.noises), options);
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

// The models that are drawn from: what they leave open is fitted to the shapes.
std::vector<compare::TrueModel> true_models(const CompareArguments& arguments, const compare::Cohort& cohort,
                                            const compare::CohortSettings& settings) {
  std::vector<std::string> asked = arguments.simulate;
  if (asked == std::vector<std::string>{"all"}) asked = arguments.noises;
  std::vector<compare::TrueModel> models;
  compare::CohortSettings quick = settings;
  if (arguments.true_lambda) quick.lambda = arguments.true_lambda;
  for (const std::string& noise : asked) {
    if (arguments.true_lambda && compare::is_complete(noise, cohort.source)) {
      models.push_back({noise, *arguments.true_lambda, arguments.true_kernel});
      continue;
    }
    const compare::CohortFit fit = fit_cohort(cohort, noise, quick);
    models.push_back({fit.noise, fit.lambda, fit.kernel});
  }
  return models;
}

int run_study(const CompareArguments& arguments, const compare::CohortShapes& shapes,
              const compare::CompareOptions& options, const std::vector<std::string>& notes) {
  const double start = seconds_now();
  const compare::Cohort cohort = shapes.cohort();
  const int given = static_cast<int>(shapes.targets.size());
  Progress progress;
  compare::RecoveryOptions study{
      options.settings, arguments.count,       arguments.cohort_size.value_or(given > 1 ? given : 20),
      cohort.alignment, options.settings.seed, {}};
  study.on_cohort = [&](int done, int all) {
    progress.show(static_cast<double>(done) / all, fmt::format("cohort {} of {}", done, all));
  };
  arguments.output.check(kStudyFiles, kStudyPictures);
  const auto rows =
      study_recovery(cohort.source, true_models(arguments, cohort, options.settings), choices(arguments.noises), study);
  progress.clear();
  const double seconds = seconds_now() - start;
  const std::string record = recovery_json(rows, arguments.noises, study, seconds);
  StagedFiles staged(arguments.output.out);
  staged.write("recovery.json", record);
  if (!arguments.output.no_picture)
    write_chart(recovery_chart(rows, arguments.noises, study), arguments.output.picture_files(staged.file("recovery")));
  staged.write("report.html", html_report(recovery_report(rows, arguments.noises, study, notes, seconds,
                                                          arguments.output.shown_picture(staged.file("recovery")))));
  arguments.output.write_json(record);
  staged.commit();
  print_notes(notes);
  if (arguments.output.prints()) {
    print_recovery(rows, arguments.noises, study);
    arguments.output.print_written(kStudyFiles, kStudyPictures);
  }
  return kDone;
}

int run_compare(const CompareArguments& arguments) {
  std::vector<std::string> notes;
  const compare::CohortShapes shapes = arguments.read(notes);
  compare::CompareOptions options = arguments.compare_options(shapes.cohort().source, notes);
  if (constexpr std::size_t kFewest = 3;
      options.settings.fit_width && shapes.targets.size() < kFewest && arguments.simulate.empty()) {
    options.settings.fit_width = false;
    notes.push_back(
        fmt::format("the kernel's width is chosen by the spacing of landmarks, {:.4g}: so few shapes do not "
                    "determine it",
                    options.settings.kernel.make(shapes.cohort().source.points).terms().front().alpha));
  }
  if (!arguments.time.chosen) options.settings.grid.steps = sufficient_steps(shapes.cohort(), options.settings);
  if (arguments.simulate.empty()) return run_comparison(arguments, shapes, options, notes);
  return run_study(arguments, shapes, options, notes);
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
      "Exit codes: 0 done, 2 bad input, 3 a fit did not converge (results are written).");
  verb->callback([arguments, &exit_code] {
    if (arguments->noises.empty()) arguments->noises = usual_noises();
    exit_code = run_compare(*arguments);
  });
}

}  // namespace pulson
