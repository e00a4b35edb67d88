#include "cohort.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <mutex>

#include <fmt/core.h>

#include "core/atomic_file.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "registration_warnings.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kCohortFiles = {"cohort.csv", "cohort.json", "report.html"};

struct CohortInput {
  Landmarks source;
  std::vector<Landmarks> targets;
};

void refuse_options_of_pairs(const RegisterArguments& arguments) {
  for (const auto& [is_given, option] :
       {std::pair(arguments.homotopy, "--homotopy"), std::pair(!arguments.image.empty(), "--image"),
        std::pair(arguments.pixel_size.has_value(), "--pixel-size"), std::pair(!arguments.origin.empty(), "--origin"),
        std::pair(!arguments.mesh.empty(), "--mesh")})
    if (is_given) throw InputError(fmt::format("{} is for one target; there are several shapes here", option));
}

CohortInput read_input(const RegisterArguments& arguments, std::vector<std::string>& notes) {
  const bool from_mean = arguments.from == "mean" || (arguments.from.empty() && arguments.targets.empty());
  std::vector<std::string> addresses = arguments.targets;
  if (from_mean || !arguments.from.empty()) addresses.insert(addresses.begin(), arguments.source);
  CohortInput input{{}, read_shapes(addresses, arguments.reading, notes)};
  if (!from_mean) {
    input.source =
        read_landmarks(arguments.from.empty() ? arguments.source : arguments.from, &notes, arguments.reading);
    return input;
  }
  if (input.targets.size() < 2)
    throw InputError(
        fmt::format("there is no TARGET besides '{}'; give one, or a file with several shapes", arguments.source));
  put_in_order_of(Landmarks(input.targets.front()), input.targets, notes);
  const AlignmentKind kind = arguments.align != "auto"                ? parse_alignment(arguments.align)
                             : input.targets.front().dimension() == 1 ? AlignmentKind::kNone
                                                                      : AlignmentKind::kSimilarity;
  input.source = procrustes_mean(input.targets, kind);
  return input;
}

SpecimenMatch match(const Landmarks& source, const Landmarks& target, const matching::RegistrationOptions& options,
                    const std::optional<inference::FittedParameters>& fitted) {
  SpecimenMatch specimen{.name = {}, .source = target.source, .centroid_size = centroid_size(target.points)};
  try {
    specimen.registration = register_shapes(source, target, options);
    specimen.facts = registration_facts(*specimen.registration, fitted);
  } catch (const Error& error) {
    specimen.registration.reset();
    specimen.error = error.what();
  }
  return specimen;
}

CohortMatches match_all(const CohortInput& input, const matching::RegistrationOptions& options,
                        const std::optional<inference::FittedParameters>& fitted, Progress& progress) {
  CohortMatches cohort{input.source, std::vector<SpecimenMatch>(input.targets.size()), {}, 0};
  const std::vector<std::string> names = folder_names(input.targets, kCohortFiles);
  std::mutex turn;
  int done = 0;
  parallel_for(static_cast<int>(input.targets.size()), [&](int i) {
    const auto s = static_cast<std::size_t>(i);
    cohort.specimens[s] = match(input.source, input.targets[s], options, fitted);
    cohort.specimens[s].name = names[s];
    const std::lock_guard lock(turn);
    ++done;
    progress.show(static_cast<double>(done) / static_cast<double>(names.size()),
                  fmt::format("{} of {} shapes", done, names.size()));
  });
  CohortNotes notes;
  for (const SpecimenMatch& specimen : cohort.specimens)
    if (specimen.registration) notes.add(specimen.registration->notes);
  cohort.notes = std::move(notes).lines();
  return cohort;
}

std::string all_failed(const CohortMatches& cohort) {
  const SpecimenMatch& first = cohort.specimens.front();
  return fmt::format(
      "{}: {}{}", first.name, first.error,
      cohort.specimens.size() > 1 ? fmt::format("; all {} shapes failed", cohort.specimens.size()) : std::string());
}

// Either all files are put in place, or none.
void write_cohort(const CohortMatches& cohort, const OutputOptions& output) {
  const Interrupt until_written;
  const std::string record = cohort_json(cohort);
  std::vector<std::unique_ptr<StagedFiles>> folders;
  for (const SpecimenMatch& specimen : cohort.specimens) {
    if (!specimen.registration) continue;
    const std::filesystem::path folder = output.file(specimen.name);
    create_output_directory(folder);
    const StagedFiles& files = *folders.emplace_back(std::make_unique<StagedFiles>(folder));
    files.write("registration.json", registration_json(*specimen.registration, specimen.facts));
    files.write("residuals.csv", records::residuals_csv(*specimen.registration, specimen.facts.shares));
    files.write("trajectory.csv", records::trajectory_csv(*specimen.registration, replay(*specimen.registration)));
  }
  StagedFiles& merged = *folders.emplace_back(std::make_unique<StagedFiles>(output.out));
  merged.write("cohort.csv", cohort_csv(cohort));
  merged.write("cohort.json", record);
  merged.write("report.html", html_report(cohort_report(cohort)));
  output.write_json(record);
  for (const auto& folder : folders) folder->commit();
}

void print_cohort(const CohortMatches& cohort, const OutputOptions& output) {
  std::vector<double> rms;
  for (const SpecimenMatch& specimen : cohort.specimens)
    if (specimen.registration) rms.push_back(specimen.registration->rms());
  std::sort(rms.begin(), rms.end());
  fmt::print("{} → {}: {} in {}D\n", cohort.source.source, counted(std::ssize(cohort.specimens), "shape"),
             counted(cohort.source.count(), "landmark"), cohort.source.dimension());
  fmt::print("rms        median {:.4g}, largest {:.4g}\n", rms[rms.size() / 2], rms.back());
  fmt::print("converged  {} of {}{} in {:.2f} s\n", rms.size() - static_cast<std::size_t>(cohort.unconverged()),
             cohort.specimens.size(), cohort.failed() > 0 ? fmt::format(", {} FAILED", cohort.failed()) : std::string(),
             cohort.seconds);
  std::vector<std::string> files = kCohortFiles;
  files.emplace_back("SPECIMEN/registration.json");
  files.emplace_back("SPECIMEN/residuals.csv");
  files.emplace_back("SPECIMEN/trajectory.csv");
  output.print_written(files, {});
}

void print_failures(const CohortMatches& cohort) {
  for (const SpecimenMatch& specimen : cohort.specimens) {
    if (!specimen.registration) print_warning(fmt::format("{}: {}", specimen.name, in_option_words(specimen.error)));
    if (specimen.registration && !specimen.registration->converged)
      print_warning(fmt::format("{}: {}", specimen.name, path_warnings(*specimen.registration).front()));
  }
}

}  // namespace

int CohortMatches::failed() const {
  return static_cast<int>(std::count_if(specimens.begin(), specimens.end(),
                                        [](const SpecimenMatch& specimen) { return !specimen.registration; }));
}

int CohortMatches::unconverged() const {
  return static_cast<int>(std::count_if(specimens.begin(), specimens.end(), [](const SpecimenMatch& specimen) {
    return specimen.registration && !specimen.registration->converged;
  }));
}

int run_register_cohort(const RegisterArguments& arguments) {
  refuse_options_of_pairs(arguments);
  std::vector<std::string> notes;
  const CohortInput input = read_input(arguments, notes);
  matching::RegistrationOptions options = arguments.registration_options(input.source);
  OutputOptions output = arguments.output;
  output.no_picture = true;  // the page has a thumbnail of each
  output.check(kCohortFiles, {});
  const double start = seconds_now();
  Progress progress;
  const LossNotice lost(fmt::format("interrupted: the search is lost, and nothing was written to '{}'", output.out));
  const auto fitted = fit_first(input.source, input.targets, arguments.fit, options, progress);
  CohortMatches cohort = match_all(input, options, fitted, progress);
  progress.clear();
  cohort.seconds = seconds_now() - start;
  notes.insert(notes.end(), cohort.notes.begin(), cohort.notes.end());
  cohort.notes = without_repeats(notes);
  print_notes(notes);
  if (cohort.failed() == std::ssize(cohort.specimens)) throw InputError(all_failed(cohort));
  write_cohort(cohort, output);
  if (output.prints()) print_cohort(cohort, output);
  print_failures(cohort);
  return cohort.failed() + cohort.unconverged() > 0 ? kNotConverged : kDone;
}

}  // namespace pulson
