// Simulation-based calibration: its simulations are units, shared out among threads, ranks and shards.

#include "calibration.hpp"

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "picture.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kCalibrationFiles = {"calibration.json", "report.html"};
const std::vector<std::string> kCalibrationPictures = {"calibration"};
constexpr const char* kSimulations = "simulations";

/// All that is computed from, but for what is saved.
struct CalibrationTask {
  inference::PosteriorProblem problem;
  inference::CalibrationOptions options;
  std::vector<std::string> notes;

  CalibrationTask(const SampleArguments& arguments, const SampleShapes& shapes, std::vector<std::string> read_notes)
      : problem(arguments.problem(shapes, read_notes)),
        options(arguments.calibration()),
        notes(std::move(read_notes)) {}
};

std::vector<std::vector<int>> ranks_in(const records::UnitRun& run) {
  std::vector<std::vector<int>> ranks;
  for (const auto& [unit, result] : run.results) ranks.push_back(result.get<std::vector<int>>());
  return ranks;
}

SampleShapes shapes_of(const records::UnitRun& run) {
  SampleShapes shapes{run.shapes.front(), {run.shapes.begin() + 1, run.shapes.end()}, {}};
  for (const Json& node : run.facts.at("tree"))
    shapes.tree.push_back({node.at(0).get<std::string>(), node.at(1).get<int>(), node.at(2).get<double>()});
  return shapes;
}

int write_calibration(const CalibrationTask& task, const records::UnitRun& run, const OutputOptions& output) {
  const auto& [problem, options, notes] = task;
  inference::Calibration calibration = inference::CalibrationStudy(problem, options).summarise(ranks_in(run));
  calibration.seconds = run.seconds;
  const std::string record = calibration_json(problem, options, calibration);
  RunResults files(output);
  files.commit("calibration.json", record, {{"run", unit_fingerprint(run)}});
  files.draw("calibration", [&](const draw::PictureFiles& drawn) {
    write_chart(calibration_chart(calibration,
                                  fmt::format("{} simulations  ·  {}", calibration.simulations, model_words(problem))),
                drawn);
  });
  files.add_page([&] { return calibration_report(problem, calibration, notes, files.shown("calibration")); });
  files.finish();
  print_notes(notes);
  if (!output.prints()) return kDone;
  print_text("{} simulations in {:.1f} s, {} without a result: {}\n", calibration.simulations, calibration.seconds,
             calibration.failed, model_words(problem));
  for (const inference::CalibratedQuantity& quantity : calibration.quantities)
    print_text("{:<16} p = {:<8.3g} {}\n", quantity.name, quantity.deviation,
               quantity.inside_band ? "within the band of 95 %" : "LEAVES THE BAND OF 95 %");
  files.print_written();
  return kDone;
}

}  // namespace

int run_calibration(const SampleArguments& arguments, const std::string& settings) {
  const OutputOptions& output = arguments.output;
  std::vector<std::string> notes;
  const SampleShapes shapes = arguments.read(notes);
  UnitJob job("sample", arguments.units, output, "calibration.json",
              [&] { output.check(kCalibrationFiles, kCalibrationPictures); });
  records::UnitRun run;
  run.settings = settings;
  run.shapes = shapes.targets;
  run.shapes.insert(run.shapes.begin(), shapes.source);
  run.facts["tree"] = tree_facts(shapes.tree);
  run.notes = notes;
  run.units = arguments.calibrate;
  const CalibrationTask task(arguments, shapes, notes);
  const inference::CalibrationStudy study(task.problem, task.options);
  job.run(
      std::move(run), [&](int simulation) { return Json(study.ranks(simulation)); }, kSimulations);
  if (!job.is_whole(output, kSimulations)) return job.exit_code();
  const int code = write_calibration(task, job.result(), output);
  job.remove_saved();
  return code;
}

int merge_calibration(const records::UnitRun& whole, const OutputOptions& output) {
  CLI::App verb("", whole.verb);
  SampleArguments arguments;
  arguments.add_to(verb);
  apply_settings(whole.settings, "settings of the parts", verb);
  const CalibrationTask task(arguments, shapes_of(whole), whole.notes);
  output.check(kCalibrationFiles, kCalibrationPictures);
  return write_calibration(task, whole, output);
}

}  // namespace pulson
