#include "cohort.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>

#include <fmt/core.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "pair.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/core/errors.hpp"
#include "registration_warnings.hpp"
#include "shell/audit_warnings.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/picture_sizes.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "summary.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kShapes = "shapes";
constexpr const char* kRecord = "registration.json";  // of a specimen
const std::vector<std::string> kCohortFiles = {"cohort.csv", "cohort.json", "report.html"};

struct CohortInput {
  Landmarks source;
  std::vector<Landmarks> targets;
};

void refuse_options_of_pairs(const RegisterArguments& arguments) {
  for (const auto& [is_given, option] :
       {std::pair(arguments.homotopy, "--homotopy"), std::pair(!arguments.field.files.empty(), "--field"),
        std::pair(!arguments.image.empty(), "--image"), std::pair(arguments.pixel_size.has_value(), "--pixel-size"),
        std::pair(!arguments.origin.empty(), "--origin"), std::pair(!arguments.mesh.empty(), "--mesh")})
    if (is_given) throw InputError(fmt::format("{} is for one target; there are several shapes here", option));
}

CohortInput read_input(const RegisterArguments& arguments, std::vector<std::string>& notes) {
  const bool from_mean = arguments.from == "mean" || (arguments.from.empty() && arguments.targets.empty());
  std::vector<std::string> addresses = arguments.targets;
  if (from_mean || !arguments.from.empty()) addresses.insert(addresses.begin(), arguments.source);
  CohortInput input{{}, read_shapes(addresses, arguments.reading, notes)};
  leave_out_undigitised(input.targets);
  if (!from_mean) {
    input.source =
        read_landmarks(arguments.from.empty() ? arguments.source : arguments.from, &notes, arguments.reading);
    require_digitised(input.source);
    find_picture_size(input.source);
    if (input.targets.empty()) throw InputError("no TARGET is left");
    return input;
  }
  if (input.targets.size() < 2)
    throw InputError(
        fmt::format("there is no TARGET besides '{}'; give one, or a file with several shapes", arguments.source));
  put_in_order_of(Landmarks(input.targets.front()), input.targets, arguments.options.data.by_order, notes);
  const AlignmentKind kind = arguments.align != "auto"                ? parse_alignment(arguments.align)
                             : input.targets.front().dimension() == 1 ? AlignmentKind::kNone
                                                                      : AlignmentKind::kSimilarity;
  input.source = procrustes_mean(input.targets, kind);
  return input;
}

/// A match as it is saved: the texts of its files, or why it failed.
Json match(const Landmarks& source, const Landmarks& target, const matching::RegistrationOptions& options,
           const std::optional<inference::FittedParameters>& fitted) {
  try {
    matching::Registration registration = register_shapes(source, target, options);
    records::RegistrationFacts facts = judged_facts(registration, fitted);
    facts.counts = topology_counts(registration);
    if (std::string note = prediction_note(facts); !note.empty()) registration.notes.push_back(std::move(note));
    return {{"registration.json", registration_json(registration, facts)},
            {"residuals.csv", records::residuals_csv(registration, facts)},
            {"trajectory.csv", records::trajectory_csv(registration, replay(registration))}};
  } catch (const Error& error) {
    return {{"error", error.what()}};
  }
}

SpecimenMatch specimen_of(const Json& match, const Landmarks& target, const std::string& folder) {
  SpecimenMatch specimen{
      .name = target.name, .folder = folder, .source = target.source, .centroid_size = centroid_size(target.points)};
  if (match.contains("error")) {
    match.at("error").get_to(specimen.error);
    return specimen;
  }
  for (const auto& [file, text] : match.items()) specimen.files.emplace_back(file, text.get<std::string>());
  specimen.registration = records::registration_of(specimen.files.front().second, folder);
  specimen.prediction = predict_match(*specimen.registration);
  return specimen;
}

/// @param run a whole one, whose first shape is the source
CohortMatches matches_in(const records::UnitRun& run) {
  CohortMatches cohort{run.shapes.front(), {}, run.notes, run.seconds};
  const std::vector<Landmarks> targets(run.shapes.begin() + 1, run.shapes.end());
  std::vector<std::string> others = kCohortFiles;
  others.emplace_back("register.partial");
  const std::vector<std::string> folders = folder_names(targets, others);
  CohortNotes notes;
  for (const auto& [unit, match] : run.results) {
    const auto s = static_cast<std::size_t>(unit);
    cohort.specimens.push_back(specimen_of(match, targets.at(s), folders[s]));
    const auto& registration = cohort.specimens.back().registration;
    if (!registration) continue;
    notes.add(registration->notes);
    if (const std::string suspects = suspects_text(*registration); !suspects.empty())
      cohort.notes.push_back(fmt::format("{}: suspects: {}", cohort.specimens.back().name, suspects));
  }
  const std::vector<std::string> of_matches = std::move(notes).lines();
  cohort.notes.insert(cohort.notes.end(), of_matches.begin(), of_matches.end());
  for (std::string& note : notes_of_names(targets)) cohort.notes.push_back(std::move(note));
  cohort.notes = without_repeats(cohort.notes);
  return cohort;
}

std::string all_failed(const CohortMatches& cohort) {
  const SpecimenMatch& first = cohort.specimens.front();
  return fmt::format(
      "{}: {}{}", first.name, first.error,
      cohort.specimens.size() > 1 ? fmt::format("; all {} shapes failed", cohort.specimens.size()) : std::string());
}

void write_cohort(const CohortMatches& cohort, const std::string& fingerprint, RunResults& results) {
  const OutputOptions& output = results.output();
  std::vector<std::unique_ptr<RecordFiles>> specimens;
  std::vector<StagedFiles*> folders;
  for (const SpecimenMatch& specimen : cohort.specimens) {
    if (!specimen.registration) continue;
    const std::filesystem::path folder = output.file(specimen.folder);
    create_output_directory(folder);
    RecordFiles& files = *specimens.emplace_back(std::make_unique<RecordFiles>(folder));
    for (const auto& [name, text] : specimen.files)
      if (name != kRecord) files.add(name, text);
    files.add_record(kRecord, specimen.files.front().second);  // the record, as matches are saved
    folders.push_back(&files.staged());
  }
  results.add("cohort.csv", cohort_csv(cohort));
  results.commit("cohort.json", cohort_json(cohort), {{"run", fingerprint}}, folders);
  results.name_written({"FOLDER/registration.json", "FOLDER/residuals.csv", "FOLDER/trajectory.csv"});
  results.add_page([&] { return cohort_report(cohort); });
  results.finish();
}

void print_cohort(const CohortMatches& cohort) {
  std::vector<double> rms;
  for (const SpecimenMatch& specimen : cohort.specimens)
    if (specimen.registration) rms.push_back(specimen.registration->rms());
  std::sort(rms.begin(), rms.end());
  print_text("{} → {}: {} in {}D\n", cohort.source.source, counted(std::ssize(cohort.specimens), "shape"),
             counted(cohort.source.count(), "landmark"), cohort.source.dimension());
  print_text("rms        median {:.4g}, largest {:.4g}\n", rms[rms.size() / 2], rms.back());
  print_text("matched    {} of {}\n", cohort.matched(), cohort.specimens.size());
  print_text("converged  {} of {}{} in {:.2f} s\n", rms.size() - static_cast<std::size_t>(cohort.unconverged()),
             cohort.specimens.size(), cohort.failed() > 0 ? fmt::format(", {} FAILED", cohort.failed()) : std::string(),
             cohort.seconds);
}

void print_failures(const CohortMatches& cohort) {
  for (const SpecimenMatch& specimen : cohort.specimens) {
    if (!specimen.registration) print_warning(fmt::format("{}: {}", specimen.name, in_option_words(specimen.error)));
    if (specimen.registration && !specimen.registration->converged)
      print_warning(fmt::format("{}: {}", specimen.name, path_warnings(*specimen.registration).front()));
  }
}

// The targets as they were matched, where landmarks correspond.
std::vector<Landmarks> alike_targets(const CohortMatches& cohort) {
  std::vector<Landmarks> targets;
  for (const SpecimenMatch& specimen : cohort.specimens)
    if (specimen.registration && specimen.registration->data.kind == matching::DataKind::kLandmarks) {
      targets.push_back(specimen.registration->target);
      targets.back().name = specimen.name;
    }
  return targets;
}

int finish_cohort(const records::UnitRun& run, const OutputOptions& output) {
  RunResults results(output);
  const CohortMatches cohort = matches_in(run);
  print_notes(cohort.notes);
  if (cohort.failed() == std::ssize(cohort.specimens)) throw InputError(all_failed(cohort));
  write_cohort(cohort, unit_fingerprint(run), results);
  if (output.prints()) {
    print_cohort(cohort);
    results.print_written();
  }
  warn_of_cohort(alike_targets(cohort));
  print_failures(cohort);
  return cohort.failed() + cohort.unconverged() > 0 ? kNotConverged : kDone;
}

OutputOptions without_pictures(OutputOptions output) {
  output.no_picture = true;  // the page has a thumbnail of each
  return output;
}

// The files of each specimen, whose folders are made when there is something to write.
void add_files_of(const std::vector<Landmarks>& targets, const OutputOptions& output) {
  for (const std::string& name : folder_names(targets, kCohortFiles))
    for (const char* file : {"registration.json", "residuals.csv", "trajectory.csv"})
      run_paths().writes(output.file(name) / file, "--out");
}

/// Of what is not among the options themselves.
Json facts_of(const RegisterArguments& arguments) {
  Json facts = Json::object();
  for (const std::string& file : {arguments.weights, arguments.covariances})
    if (!file.empty()) facts[file] = text::read_text_file(file);
  return facts;
}

}  // namespace

int CohortMatches::failed() const {
  return static_cast<int>(std::count_if(specimens.begin(), specimens.end(),
                                        [](const SpecimenMatch& specimen) { return !specimen.registration; }));
}

int CohortMatches::matched() const {
  return static_cast<int>(std::count_if(specimens.begin(), specimens.end(), [](const SpecimenMatch& specimen) {
    return specimen.registration && specimen.registration->matched();
  }));
}

int CohortMatches::unconverged() const {
  return static_cast<int>(std::count_if(specimens.begin(), specimens.end(), [](const SpecimenMatch& specimen) {
    return specimen.registration && !specimen.registration->converged;
  }));
}

int run_register_cohort(const RegisterArguments& arguments, const std::string& settings) {
  refuse_options_of_pairs(arguments);
  records::UnitRun run;
  const CohortInput input = read_input(arguments, run.notes);
  matching::RegistrationOptions options = arguments.registration_options(input.source, run.notes);
  const OpenModel model = arguments.model();
  model.set_noise(input.source, input.targets, options);
  const OutputOptions output = without_pictures(arguments.output);
  UnitJob job("register", arguments.units, output, "cohort.json", [&] {
    output.check(kCohortFiles, {});
    add_files_of(input.targets, output);
  });
  run.settings = settings;
  run.shapes = input.targets;
  run.shapes.insert(run.shapes.begin(), input.source);
  run.facts = facts_of(arguments);
  run.units = static_cast<int>(input.targets.size());
  std::optional<inference::FittedParameters> fitted;
  {
    Progress progress;
    const LossNotice lost(fmt::format("interrupted: the search is lost, and nothing was written to '{}'", output.out));
    fitted = fit_first(input.source, input.targets, model.names(), options, progress);
  }
  job.run(
      std::move(run),
      [&](int i) { return match(input.source, input.targets[static_cast<std::size_t>(i)], options, fitted); }, kShapes);
  if (!job.is_whole(output, kShapes)) return job.exit_code();
  const int code = finish_cohort(job.result(), output);
  job.remove_saved();
  return code;
}

int merge_cohort(const records::UnitRun& whole, const OutputOptions& given) {
  const OutputOptions output = without_pictures(given);
  output.check(kCohortFiles, {});
  return finish_cohort(whole, output);
}

}  // namespace pulson
