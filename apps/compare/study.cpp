// The study of which model is chosen: its cohorts are units, shared out among threads, ranks and shards.

#include "study.hpp"

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "picture.hpp"
#include "record.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/ranks.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kStudyFiles = {"recovery.json", "report.html"};
const std::vector<std::string> kStudyPictures = {"recovery"};
constexpr const char* kCohorts = "cohorts";

// The models that are drawn from: what they leave open is fitted to the shapes.
std::vector<compare::TrueModel> true_models(const CompareArguments& arguments, const compare::Cohort& cohort,
                                            const compare::CohortSettings& settings) {
  std::vector<compare::TrueModel> models;
  compare::CohortSettings quick = settings;
  quick.upper_ends = false;
  if (arguments.true_lambda) quick.lambda = arguments.true_lambda;
  for (const NoiseChoice& noise : arguments.simulated()) {
    if (arguments.true_lambda && compare::is_complete(noise, cohort.source)) {
      models.push_back({noise, *arguments.true_lambda, arguments.true_kernel});
      continue;
    }
    const compare::CohortFit fit = fit_cohort(cohort, noise, quick);
    models.push_back({fit.noise, fit.lambda, fit.kernel, fit.sigma});
  }
  return models;
}

// What was computed once, and what the shapes are.
Json facts_of(const std::vector<compare::TrueModel>& models, const compare::CohortShapes& shapes) {
  Json rows = Json::array();
  for (const compare::TrueModel& model : models)
    rows.push_back(
        {{"noise", model.noise.spec()}, {"lambda", model.lambda}, {"kernel", model.kernel}, {"sigma", model.sigma}});
  return {{"models", std::move(rows)},
          {"has_source", shapes.source.has_value()},
          {"alignment", alignment_name(shapes.alignment)}};
}

std::vector<compare::TrueModel> models_of(const Json& facts) {
  std::vector<compare::TrueModel> models;
  for (const Json& model : facts.at("models"))
    models.push_back({model.at("noise").get<std::string>(), model.at("lambda").get<double>(),
                      model.at("kernel").get<std::string>(), model.at("sigma").get<double>()});
  return models;
}

compare::CohortShapes shapes_of(const records::UnitRun& run) {
  compare::CohortShapes shapes;
  shapes.targets = run.shapes;
  shapes.alignment = parse_alignment(run.facts.at("alignment").get<std::string>());
  if (run.facts.at("has_source").get<bool>()) {
    shapes.source = shapes.targets.front();
    shapes.targets.erase(shapes.targets.begin());
  }
  return shapes;
}

Json recovered_json(const compare::RecoveredCohort& cohort) {
  Json fits = Json::array();
  for (const compare::RecoveredFit& fit : cohort.fits) {
    Json numbers = Json::array();
    for (const compare::FittedNumber& n : fit.numbers)
      numbers.push_back({n.name, n.value, n.log_deviation, n.vanishes, n.correlation_with_sigma, n.low, n.high});
    fits.push_back({{"log_evidence", fit.log_evidence}, {"numbers", std::move(numbers)}});
  }
  return {{"chosen", cohort.chosen}, {"fits", std::move(fits)}};
}

compare::RecoveredCohort recovered_from(const Json& json) {
  compare::RecoveredCohort cohort;
  cohort.chosen = json.at("chosen").get<int>();
  for (const Json& fit : json.at("fits")) {
    compare::RecoveredFit& recovered = cohort.fits.emplace_back();
    recovered.log_evidence = fit.at("log_evidence").get<double>();
    for (const Json& n : fit.at("numbers"))
      recovered.numbers.push_back({n.at(0).get<std::string>(), n.at(1).get<double>(), n.at(2).get<double>(),
                                   n.at(3).get<bool>(), n.at(4).get<double>(), n.at(5).get<double>(),
                                   n.at(6).get<double>()});
  }
  return cohort;
}

/// What the options make of the shapes, but for the models that are drawn from.
struct StudyTask {
  compare::Cohort cohort;
  compare::CompareOptions options;
  compare::RecoveryOptions study;
  std::vector<std::string> candidates;
  std::vector<std::string> notes;

  StudyTask(const CompareArguments& arguments, const compare::CohortShapes& shapes, std::vector<std::string> read_notes)
      : cohort(shapes.cohort()),
        options(arguments.compare_options(shapes, read_notes)),
        study{options.settings,     arguments.count,       arguments.cohort_size.value_or(usual_size(shapes)),
              cohort.alignment,     options.settings.seed, {},
              cohort.about_own_mean},
        notes(std::move(read_notes)) {
    for (const NoiseChoice& noise : arguments.candidates()) {
      compare::is_complete(noise, cohort.source);  // refuses what cannot be made for these shapes
      candidates.push_back(noise.spec());
    }
  }

  compare::RecoveryStudy with(const Json& facts) const {
    return {cohort.source, models_of(facts), {candidates.begin(), candidates.end()}, study};
  }

 private:
  static int usual_size(const compare::CohortShapes& shapes) {
    constexpr int kUsual = 20;
    return shapes.targets.size() > 1 ? static_cast<int>(shapes.targets.size()) : kUsual;
  }
};

int write_study(const StudyTask& task, const records::UnitRun& run, const OutputOptions& output) {
  std::vector<compare::RecoveredCohort> cohorts;
  for (const auto& [unit, result] : run.results) cohorts.push_back(recovered_from(result));
  const std::vector<compare::RecoveryRow> rows = task.with(run.facts).rows(cohorts);
  const std::string record = recovery_json(rows, task.candidates, task.study, run.seconds);
  RunResults staged(output);
  staged.commit("recovery.json", record, {{"run", unit_fingerprint(run)}});
  staged.draw("recovery", [&](const draw::PictureFiles& files) {
    write_chart(recovery_chart(rows, task.candidates, task.study), files);
  });
  staged.add_page([&] {
    return recovery_report(rows, task.candidates, task.study, task.notes, run.seconds, staged.shown("recovery"));
  });
  staged.finish();
  print_notes(task.notes);
  if (output.prints()) {
    print_recovery(rows, task.candidates, task.study);
    staged.print_written();
  }
  return kDone;
}

}  // namespace

int run_study(const CompareArguments& arguments, const std::string& settings) {
  const OutputOptions& output = arguments.output;
  records::UnitRun run;
  const compare::CohortShapes shapes = arguments.read(run.notes);
  const StudyTask task(arguments, shapes, run.notes);
  UnitJob job("compare", arguments.units, output, "recovery.json", [&] { output.check(kStudyFiles, kStudyPictures); });
  run.settings = settings;
  run.shapes = shapes.targets;
  if (shapes.source) run.shapes.insert(run.shapes.begin(), *shapes.source);
  // Rank 0 alone fits the models.
  std::vector<std::uint8_t> facts;
  if (ranks::is_first())
    facts = Json::to_cbor(facts_of(true_models(arguments, task.cohort, task.options.settings), shapes));
  run.facts = Json::from_cbor(ranks::gather({reinterpret_cast<const char*>(facts.data()), facts.size()}));
  const compare::RecoveryStudy study = task.with(run.facts);
  run.units = study.cohorts();
  job.run(
      std::move(run), [&](int cohort) { return recovered_json(study.cohort(cohort)); }, kCohorts);
  if (!job.is_whole(output, kCohorts)) return job.exit_code();
  const int code = write_study(task, job.result(), output);
  job.remove_saved();
  return code;
}

int merge_study(const records::UnitRun& whole, const OutputOptions& output) {
  CLI::App verb("", whole.verb);
  CompareArguments arguments;
  arguments.add_to(verb);
  apply_settings(whole.settings, "settings of the parts", verb);
  const StudyTask task(arguments, shapes_of(whole), whole.notes);
  output.check(kStudyFiles, kStudyPictures);
  return write_study(task, whole, output);
}

}  // namespace pulson
