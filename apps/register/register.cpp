// `pulson register`: fits momenta, and noise, so that a source flows to a target.

#include <memory>

#include <fmt/core.h>

#include "arguments.hpp"
#include "cohort.hpp"
#include "core/staged_files.hpp"
#include "homotopy.hpp"
#include "pair.hpp"
#include "picture.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/records/records.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "registration_warnings.hpp"
#include "report.hpp"
#include "shell/audit_warnings.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/picture_sizes.hpp"
#include "shell/ranks.hpp"
#include "shell/run_results.hpp"
#include "shell/verbs.hpp"
#include "summary.hpp"
#include "surface.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

const std::vector<std::string> kRegistrationFiles = {"registration.json", "residuals.csv", "trajectory.csv",
                                                     "report.html"};
const std::vector<std::string> kRegistrationPictures = {"registration"};

template <class... More>
std::vector<std::string> with(std::vector<std::string> names, bool wanted, const More&... more) {
  if (wanted) (names.emplace_back(more), ...);
  return names;
}

}  // namespace

records::TopologyCounts topology_counts(const matching::Registration& registration) {
  records::TopologyCounts counts;
  const Points& source = registration.source.points;
  const Points &target = registration.target.points, &result = registration.result;
  const bool corresponds = registration.data.kind == matching::DataKind::kLandmarks;
  if (source.rows() == 1) counts.order_inversions = matching::order_inversions(source, result);
  if (source.rows() == 1 && corresponds) {
    counts.target_inversions = matching::order_inversions(source, target);
    counts.exchanged_as_target = matching::exchanged_as_asked(source, target, result);
  }
  if (source.rows() == 2) {
    const auto triangles = warp::delaunay_triangles(source);
    counts.flipped_triangles = static_cast<int>(std::ssize(warp::flipped_of(triangles, result)));
    if (corresponds) counts.target_flips = warp::flipped_of(triangles, target);
  }
  return counts;
}

records::RegistrationFacts judged_facts(const matching::Registration& registration,
                                        const std::optional<inference::FittedParameters>& fitted) {
  const matching::LandmarkShares shares = landmark_shares(registration);
  return {{}, shares, judge_landmarks(registration, shares), {}, fitted};
}

namespace {

// What lies below the landmarks.
struct Background {
  SourceImage image;
  std::optional<formats::Surface> surface;
};

void write_field_of(const matching::Registration& registration, const Trajectory& path,
                    const draw::RegistrationPicture& still, const FieldOptions& options,
                    const std::optional<warp::VelocityField>& field, RunResults& results) {
  if (!field) return;
  draw::FieldPicture picture = make_field_picture(*field, path, registration.source);
  picture.title = "Velocity field of " + still.title;
  picture.subtitle = still.subtitle;
  write_field(options, *field, picture, results);
}

// The field of --field.
std::optional<warp::VelocityField> write_results(const matching::Registration& registration,
                                                 const records::RegistrationFacts& facts, const Background& background,
                                                 const FieldOptions& field_options, std::vector<std::string>& notes,
                                                 RunResults& results) {
  const Trajectory path = replay(registration);
  std::optional<warp::VelocityField> field = field_options.field_of(registration_system(registration).kernel, path);
  // Before the record is printed: Qhull flushes all streams, and hides why one of them could not be written.
  draw::RegistrationPicture still = make_registration_picture(registration, path);
  add_verdicts(facts, still);
  results.add("residuals.csv", records::residuals_csv(registration, facts));
  results.add("trajectory.csv", records::trajectory_csv(registration, path));
  if (!facts.homotopy.empty()) results.add("homotopy.csv", homotopy_csv(facts.homotopy));
  results.commit("registration.json", registration_json(registration, facts), field_json(field));

  write_field_of(registration, path, still, field_options, field, results);
  const std::optional<PageImage> underlay = add_underlay(background.image, registration, still, notes);
  add_surface(background.surface, registration, path, still, notes);
  const auto picture =
      results.draw("registration", [&](const draw::PictureFiles& files) { write_registration_picture(still, files); });
  if (!facts.homotopy.empty())
    results.draw("homotopy",
                 [&](const draw::PictureFiles& files) { write_homotopy_picture(facts.homotopy, registration, files); });
  results.add_page([&] {
    return registration_report(registration, path, facts, without_repeats(notes), picture, {underlay, still});
  });
  results.finish();
  return field;
}

}  // namespace

std::optional<inference::FittedParameters> fit_first(const Landmarks& source, const std::vector<Landmarks>& targets,
                                                     const std::vector<std::string>& names,
                                                     matching::RegistrationOptions& options, Progress& progress) {
  if (names.empty()) return std::nullopt;
  inference::FitOptions fit{.names = names};
  fit.on_evaluation = [&](int evaluation, const Eigen::VectorXd& values, double log_evidence) {
    progress.show(fmt::format("evaluation {}: {} = {:.4g}{}, log evidence {:.6g}", evaluation, names.front(), values[0],
                              names.size() > 1 ? ", …" : "", log_evidence));
  };
  matching::RegistrationOptions quiet = options;
  quiet.minimise.on_iteration = {};
  inference::FittedParameters fitted = fit_parameters(source, targets, quiet, fit);
  options.kernel = fitted.kernel;
  options.noise = fitted.noise;
  options.sigma = fitted.sigma;
  options.lambda = fitted.lambda;
  if (!options.mode && options.noise.spec() != "none")
    options.mode = matching::MatchingMode::kMap;  // that of the evidence
  return fitted;
}

namespace {

// What was noted of the files may be why they do not fit together.
matching::Registration register_or_tell(const Landmarks& source, const Landmarks& target,
                                        const matching::RegistrationOptions& options,
                                        const std::vector<std::string>& notes) {
  try {
    return register_shapes(source, target, options);
  } catch (const Error&) {
    print_notes(notes);
    throw;
  }
}

// Nothing after a signal, so that the registration is written.
std::vector<matching::HomotopyStep> followed(const Landmarks& source, const Landmarks& target,
                                             matching::RegistrationOptions options,
                                             const matching::Registration& registration) {
  struct Stopped {};
  const std::string_view left_out = "interrupted: J(beta) was not followed to its end, and is left out";
  if (registration.stop_reason == matching::kInterrupted) {
    print_warning(left_out);
    return {};
  }
  options.minimise.on_iteration = [show = options.minimise.on_iteration](int iteration, double cost, double gradient) {
    if (Interrupt::came()) throw Stopped();
    show(iteration, cost, gradient);
  };
  try {
    auto steps = follow_homotopy(source, target, options, registration);
    log_step("followed J(beta)");
    return steps;
  } catch (const Stopped&) {
    print_warning(left_out);
    return {};
  }
}

void refuse_options_of_cohorts(const RegisterArguments& arguments) {
  if (!arguments.units.shard.empty() || arguments.units.resume)
    throw InputError(fmt::format("{} is for several shapes; there is one TARGET here",
                                 arguments.units.resume ? "--resume" : "--shard"));
  if (ranks::size() > 1)
    throw InputError(
        fmt::format("there are {} ranks, and one TARGET; the shapes of a cohort are shared", ranks::size()));
}

// Prediction judges landmarks in their order, and so clears none where the audit doubts that.
void audit_order(matching::Registration& registration, records::RegistrationFacts& facts,
                 std::vector<std::string>& notes) {
  notes.insert(notes.end(), registration.notes.begin(), registration.notes.end());
  if (registration.data.kind == matching::DataKind::kLandmarks)
    facts.finding = pair_warning(registration.original, registration.target, notes);
  const std::string note = prediction_note(facts);
  if (note.empty()) return;
  registration.notes.push_back(note);
  notes.push_back(note);
}

}  // namespace

PairTask pair_task(const RegisterArguments& arguments, Landmarks source, Landmarks target,
                   std::vector<std::string> notes, Progress& progress) {
  for (const Landmarks* shape : {&source, &target}) require_digitised(*shape);
  find_picture_sizes({&source, &target});
  PairTask task{std::move(source), std::move(target), {}, {}, std::move(notes)};
  task.image = arguments.source_image(task.source, task.notes);
  task.options = arguments.registration_options(task.source, task.notes);
  arguments.model().set_noise(task.source, {task.target}, task.options);
  task.options.minimise.interrupted = Interrupt::came;
  task.options.minimise.on_iteration = [&progress](int iteration, double cost, double gradient) {
    progress.show(fmt::format("iteration {}: cost {:.6g}, relative gradient {:.1e}", iteration, cost, gradient));
  };
  if (arguments.homotopy) require_homotopy(task.source, task.target, task.options);
  return task;
}

std::optional<inference::FittedParameters> fit_first(const RegisterArguments& arguments, PairTask& task,
                                                     Progress& progress) {
  const LossNotice lost(
      fmt::format("interrupted: the fit is lost, and nothing was written to '{}'", arguments.output.out));
  return fit_first(task.source, {task.target}, arguments.model().names(), task.options, progress);
}

PairMatch match_pair(const RegisterArguments& arguments, PairTask& task,
                     const std::optional<inference::FittedParameters>& fitted, Progress& progress) {
  PairMatch match{register_or_tell(task.source, task.target, task.options, task.notes), {}};
  progress.clear();
  log_step(fmt::format("fitted: kernel {}", registration_system(match.registration).kernel.spec(4)));
  match.facts = judged_facts(match.registration, fitted);
  if (arguments.homotopy) {
    match.facts.homotopy = followed(task.source, task.target, task.options, match.registration);
    progress.clear();
  }
  audit_order(match.registration, match.facts, task.notes);
  return match;
}

namespace {

int run_register(const RegisterArguments& arguments, const CLI::App& verb) {
  if (arguments.asks_for_cohort()) return run_register_cohort(arguments, settings_of(verb));
  refuse_options_of_cohorts(arguments);
  std::vector<std::string> read_notes;
  Landmarks source = read_landmarks(arguments.source, &read_notes, arguments.reading);
  Landmarks target = read_landmarks(arguments.targets.front(), &read_notes, arguments.reading);
  log_step(fmt::format("read {} and {}: {} and {} landmarks in {}D", arguments.source, arguments.targets.front(),
                       source.count(), target.count(), source.dimension()));
  Progress progress;
  PairTask task = pair_task(arguments, std::move(source), std::move(target), std::move(read_notes), progress);
  std::vector<std::string>& notes = task.notes;
  const Background background{std::move(task.image), surface_of(task.source, arguments.mesh, notes)};
  const auto files = with(kRegistrationFiles, arguments.homotopy, "homotopy.csv");
  const auto pictures = with(kRegistrationPictures, arguments.homotopy, "homotopy");
  arguments.field.check(task.source.dimension(), task.options.grid.steps + 1);
  arguments.output.check(files, pictures);
  const auto fitted = fit_first(arguments, task, progress);
  const Interrupt keep_what_is_found;
  PairMatch match = match_pair(arguments, task, fitted, progress);
  match.facts.counts = topology_counts(match.registration);
  const matching::Registration& registration = match.registration;
  const records::RegistrationFacts& facts = match.facts;
  RunResults results(arguments.output);
  const auto field = write_results(registration, facts, background, arguments.field, notes, results);
  print_notes(notes);
  if (arguments.output.prints()) {
    print_registration(registration, facts, arguments.kernel);
    if (!facts.homotopy.empty()) print_text("homotopy   {}\n", homotopy_line(facts.homotopy, registration));
    print_field(arguments.field, field);
    results.print_written();
  }
  if (registration.noise == "none" && task.options.noise.spec() != "none")
    print_note(fmt::format("mode deterministic does not use the noise '{}'", task.options.noise.spec()));
  if (!facts.finding.empty()) print_warning(facts.finding);
  for (const std::string& text : result_warnings(registration)) print_warning(text);
  return registration.converged ? kDone : kNotConverged;
}

}  // namespace

void add_register_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand(
      "register", "Fit momenta, and noise, so that SOURCE flows to TARGET, or a template to many");
  auto arguments = std::make_shared<RegisterArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson register a.csv b.csv -o out\n"
      "  pulson register skulls.tps#1 skulls.tps#2 -o out --sigma 1%\n"
      "  pulson register skulls.tps -o out --template mean\n"
      "  pulson register skulls.tps --template mean --shard 3/8 -o parts\n"
      "  pulson register a.csv b.csv -o out --noise ch-sd:beta=10%\n"
      "  pulson register a.csv b.csv -o out --kernel gaussian:alpha=30% --align none\n"
      "  pulson register outline_a.csv outline_b.csv -o out --data varifold\n"
      "  pulson register a.csv b.csv -o out --kernel gaussian:alpha=fit --noise ch-sd:beta=fit --uncertainty\n"
      "Exit codes: 0 done, 2 bad input, 3 not converged, or some of several shapes failed (results are written).");
  verb->callback([arguments, verb, &exit_code] { exit_code = run_register(*arguments, *verb); });
}

}  // namespace pulson
