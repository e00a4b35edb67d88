// `pulson atlas`: template, momenta, modes, regression.

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "arguments.hpp"
#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "core/text.hpp"
#include "match_rounds.hpp"
#include "pulson/core/errors.hpp"
#include "results.hpp"
#include "shell/audit_warnings.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/host.hpp"
#include "shell/path_options.hpp"
#include "shell/ranks.hpp"
#include "shell/run_results.hpp"
#include "shell/units.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

// The file of these shapes in the cohort's own format, or in csv where that is not written.
struct ShapeFile {
  std::string name;
  const formats::LandmarkFormat* format = nullptr;

  ShapeFile(const std::string& stem, const std::string& address) {
    const std::string path = address.substr(0, address.find('#'));
    const std::string extension = std::filesystem::path(path).extension().string();
    try {
      format = &formats::landmark_format_to_write(stem + extension);
      name = stem + extension;
    } catch (const InputError&) {
      name = stem + ".csv";
      format = &formats::landmark_format_to_write(name);
    }
  }

  std::string text(const std::vector<Landmarks>& shapes, std::vector<std::string>& notes) const {
    const auto write = [&](const formats::LandmarkFormat& as) {
      return as.write(name, {as.name, shapes, {}, shapes.front().units, shapes.front().axes});
    };
    const formats::WrittenLandmarks written = write(*format);
    for (const std::string& loss : written.losses) notes.push_back(name + ": " + loss);
    return written.text;
  }
};

struct Files {
  ShapeFile template_file, aligned, complete;
  std::vector<std::string> names;

  Files(const AtlasArguments& arguments, const std::vector<Landmarks>& shapes)
      : template_file("template", arguments.shapes.front()),
        aligned("aligned", "aligned.csv"),
        complete("complete", "complete.csv"),
        names{"atlas.json",    template_file.name, "momenta.npy",           "momenta.csv", aligned.name,
              "specimens.csv", "scores.csv",       "procrustes_scores.csv", "modes.csv"} {
    if (arguments.loss.chosen() || std::any_of(shapes.begin(), shapes.end(), misses_landmarks)) {
      names.emplace_back("predicted.csv");
      names.push_back(complete.name);
    }
    if (!arguments.covariate.empty()) names.emplace_back("regression.csv");
    if (arguments.has_models()) names.insert(names.end(), {"model.csv", "pairs.csv", "coefficients.csv"});
    names.emplace_back("report.html");
  }

  static bool misses_landmarks(const Landmarks& shape) { return !missing_landmarks(shape).empty(); }
};

// The values of the covariate that are drawn: those asked for, or least, mean and greatest.
std::vector<double> shown_values(const AtlasArguments& arguments, const Eigen::VectorXd& covariate) {
  if (!arguments.at.empty()) return arguments.at;
  std::vector<double> known;
  std::copy_if(covariate.begin(), covariate.end(), std::back_inserter(known),
               [](double x) { return std::isfinite(x); });
  if (known.empty()) return {};
  const auto [low, high] = std::minmax_element(known.begin(), known.end());
  return {*low, (*low + *high) / 2, *high};
}

Eigen::VectorXd numbers_of_fields(const std::vector<std::string>& fields) {
  Eigen::VectorXd numbers(std::ssize(fields));
  for (std::size_t i = 0; i < fields.size(); ++i)
    numbers[static_cast<Eigen::Index>(i)] = text::is_missing(fields[i]) ? text::kMissing : std::stod(fields[i]);
  return numbers;
}

// With suspects missing.
std::vector<Landmarks> without_suspects(const cohort::Atlas& atlas, std::vector<Landmarks> shapes) {
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (const int a : atlas.specimens[i].suspects()) shapes[i].points.col(a).setConstant(text::kMissing);
  return shapes;
}

void predict_missing(AtlasResults& results, const std::vector<Landmarks>& shapes) {
  if (std::none_of(shapes.begin(), shapes.end(), Files::misses_landmarks)) return;
  results.predicted = pulson::cohort::predict_missing(results.atlas, shapes);
  results.complete = shapes;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (std::size_t k = 0; k < results.predicted[i].landmarks.size(); ++k)
      results.complete[i].points.col(results.predicted[i].landmarks[k]) =
          results.predicted[i].positions.col(static_cast<Eigen::Index>(k));
}

void find_statistics(AtlasResults& results, const AtlasArguments& arguments, const std::vector<Landmarks>& shapes,
                     const std::vector<ShapeModelInput>& models) {
  results.modes = momentum_modes(results.atlas);
  if (results.modes.eigenvalues.size() == 0)
    throw InputError("the shapes are all the same once they are aligned: there is no variation");
  predict_missing(results, shapes);
  std::vector<Points> complete;
  for (const Landmarks& shape : results.complete.empty() ? shapes : results.complete) complete.push_back(shape.points);
  results.procrustes = cohort::procrustes_modes(complete);
  if (const auto left_out = results.atlas.template_shape.count() - std::ssize(results.procrustes.landmarks);
      left_out > 0)
    results.notes.push_back(fmt::format("Procrustes coordinates are of the {} that all specimens have; {} absent",
                                        counted(std::ssize(results.procrustes.landmarks), "landmark"),
                                        left_out == 1 ? "1 is" : fmt::format("{} are", left_out)));
  for (const ShapeModelInput& input : models)
    results.models.push_back(fit_shape_model(input, results, complete, arguments.permutations, results.notes));
  if (!results.predicted.empty() && !models.empty())
    results.notes.emplace_back("the tests take predicted landmarks as observed ones, which makes p somewhat too small");
  if (!arguments.covariate.empty()) {
    const Eigen::VectorXd covariate = numbers_of_fields(models.front().data.columns.begin()->second);
    results.covariate.assign(covariate.begin(), covariate.end());
    results.covariate_name = models.front().formula.text();
    results.shown_values = shown_values(arguments, covariate);
    results.regression = regress_momenta(results.atlas, covariate);
  }
  if (!arguments.groups.empty()) results.means = group_means(results.atlas, results.groups);
}

Landmarks written_template(const AtlasResults& results) {
  Landmarks shape = results.atlas.template_shape;
  shape.image.clear();
  shape.properties.clear();
  shape.curves.clear();
  shape.outlines.clear();
  return shape;
}

void write_results(const AtlasResults& found, const AtlasArguments& arguments, const Files& files,
                   const std::string& fingerprint, RunResults& staged) {
  AtlasResults results = found;
  staged.add(files.template_file.name, files.template_file.text({written_template(results)}, results.notes));
  std::vector<Landmarks> aligned;
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    aligned.push_back(results.atlas.specimens[i].shape);
    aligned.back().name = results.names[i];
  }
  std::vector<std::string> of_csv;  // images and the like, which csv does not hold
  staged.add(files.aligned.name, files.aligned.text(aligned, of_csv));
  staged.add("momenta.npy", momenta_npy(results));
  staged.add("momenta.csv", momenta_csv(results));
  staged.add("specimens.csv", specimens_csv(results));
  staged.add("scores.csv", scores_csv(results, results.modes.scores));
  staged.add("procrustes_scores.csv", scores_csv(results, results.procrustes.modes.scores));
  staged.add("modes.csv", modes_csv(results));
  if (!results.predicted.empty()) {
    staged.add("predicted.csv", predicted_csv(results));
    std::vector<Landmarks> complete = results.complete;
    for (std::size_t i = 0; i < complete.size(); ++i) complete[i].name = results.names[i];
    staged.add(files.complete.name, files.complete.text(complete, of_csv));
  }
  if (results.regression) staged.add("regression.csv", regression_csv(results));
  if (!results.models.empty()) {
    staged.add("model.csv", facts_csv(term_facts(), term_rows(results.models)));
    staged.add("pairs.csv", facts_csv(pair_facts(), pair_rows(results.models)));
    staged.add("coefficients.csv", coefficients_csv(results));
  }
  staged.commit("atlas.json", atlas_json(results), {{"run", fingerprint}});
  draw_atlas(results, arguments.modes, staged);
  staged.add_page([&] { return atlas_report(results, arguments.modes, staged); });
  staged.finish();
}

double middle_length(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

// Above the median m by more than 5 · 1.4826 · median |length − m|: for normal numbers, five standard deviations.
std::vector<int> outlying_lengths(const Eigen::VectorXd& lengths) {
  constexpr double kDeviations = 5, kNormalScale = 1.4826;
  std::vector<double> all(lengths.begin(), lengths.end());
  const double middle = middle_length(all);
  for (double& length : all) length = std::abs(length - middle);
  const double least = middle + kDeviations * kNormalScale * middle_length(all);
  std::vector<int> outliers;
  for (int i = 0; i < lengths.size(); ++i)
    if (lengths[i] > least) outliers.push_back(i);
  return outliers;
}

// Shapes much further away from the template than most, by the length of their geodesics.
void note_outliers(AtlasResults& results) {
  const Eigen::MatrixXd metric = results.atlas.metric();
  Eigen::VectorXd lengths(std::ssize(results.names));
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    const Points& p = results.atlas.specimens[i].momenta;
    lengths[static_cast<Eigen::Index>(i)] = std::sqrt(p.cwiseProduct(p * metric).sum());
  }
  std::vector<std::string> far;
  for (const int i : outlying_lengths(lengths)) far.push_back(results.names[static_cast<std::size_t>(i)]);
  if (far.empty()) return;
  const std::size_t count = far.size();
  far.resize(std::min<std::size_t>(count, 5));
  results.notes.push_back(fmt::format("{}{} much further from the template than the others, which the modes may follow",
                                      fmt::join(far, ", "),
                                      count > far.size() ? fmt::format(" and {} more are", count - far.size())
                                      : count == 1       ? std::string(" is")
                                                         : std::string(" are")));
}

void warn(const AtlasResults& results) {
  // A flow alone may not reach every shape exactly.
  const bool exact_flow = results.atlas.sigma == 0 && results.atlas.beta == 0;
  if (!results.atlas.converged)
    print_warning(fmt::format("the template did not converge: it still moved by {:.2g} diameters; try {}",
                              results.atlas.movement,
                              exact_flow ? "--noise ch-sd:beta=10%, which moves each landmark individually as well"
                                         : "more --max-iterations or a larger --sigma"));
  std::vector<std::string> unmatched;
  for (std::size_t i = 0; i < results.names.size(); ++i)
    if (!results.atlas.specimens[i].converged) unmatched.push_back(results.names[i]);
  if (unmatched.empty()) return;
  const std::size_t more = unmatched.size() > 5 ? unmatched.size() - 5 : 0;
  unmatched.resize(unmatched.size() - more);
  print_warning(fmt::format("no geodesic to {}{} was found; try a larger --sigma, or --noise ch-sd:beta=10%",
                            fmt::join(unmatched, ", "), more > 0 ? fmt::format(" and {} more", more) : std::string()));
}

// Checks the outputs and the checkpoint, on rank 0. @return whether that is there
bool check_outputs(const AtlasArguments& arguments, const Files& files, const std::vector<std::string>& stems,
                   const std::filesystem::path& checkpoint) {
  if (!ranks::is_first()) return false;
  arguments.output.check(files.names, stems);
  check_result_file(checkpoint, "--out");
  return saved_before(checkpoint, arguments.resume);
}

int run_atlas(const AtlasArguments& arguments, const std::string& settings) {
  std::vector<std::string> notes;
  const std::vector<Landmarks> shapes = arguments.read(notes);
  log_step(fmt::format("read {}", counted(std::ssize(shapes), "shape")));
  cohort::AtlasOptions options = arguments.atlas_options();
  const std::vector<ShapeModelInput> models = read_shape_models(arguments, shapes, notes);
  AtlasResults results;
  if (!arguments.groups.empty())
    results.groups = models.back().data.columns.begin()->second;
  else if (!arguments.model.empty())
    results.groups = groups_of_model(models.front());
  const Files files(arguments, shapes);
  const std::vector<std::string> stems = AtlasPictures{shapes.front().dimension(), !arguments.covariate.empty(),
                                                       !arguments.groups.empty(), arguments.has_models()}
                                             .stems();
  const std::filesystem::path checkpoint = arguments.output.file("atlas.partial");
  const bool saved = check_outputs(arguments, files, stems, checkpoint);
  records::UnitRun run;
  run.verb = "atlas";
  run.settings = settings;
  run.shapes = shapes;
  run.units = options.max_iterations + 2;  // the last round measures the matches
  const std::string fingerprint = unit_fingerprint(run);
  if (arguments.resume) {
    const bool is_done =
        ranks::is_first() && !saved && is_done_before(arguments.output.file("atlas.json"), fingerprint);
    if (ranks::gather(is_done ? "1" : "") == "1") return kDone;
  }
  const double start = seconds_now();
  Progress progress;
  options.on_iteration = [&](int iteration, double movement) {
    const std::string done = fmt::format("iteration {}: the template moved by {:.2g} diameters", iteration, movement);
    progress.show(done);
    log_step(done);
  };
  try {
    MatchRounds rounds(std::move(run), checkpoint, saved);
    options.share = [&](int count, const auto& match, const auto& store) { rounds.share(count, match, store); };
    results.atlas = make_atlas(shapes, options);
  } catch (const ranks::Interrupted&) {
    progress.clear();
    print_warning(fmt::format("interrupted: the iterations so far are saved in '{}'; continue with --resume",
                              checkpoint.string()));
    return kNotConverged;
  }
  if (!ranks::is_first()) return kDone;
  RunResults output(arguments.output);
  for (const Landmarks& shape : shapes) results.names.push_back(shape.name);
  for (const std::string& note : notes_of_names(shapes))
    notes.push_back(note + "; landmark tables number them, as in NAME#3");
  log_step("matched the shapes");
  find_statistics(results, arguments, without_suspects(results.atlas, shapes), models);
  progress.clear();
  log_step("found modes and statistics");
  results.seconds = seconds_now() - start;
  notes.insert(notes.end(), results.atlas.notes.begin(), results.atlas.notes.end());
  notes.insert(notes.end(), results.notes.begin(), results.notes.end());  // of the statistics
  results.notes = without_repeats(notes);
  note_outliers(results);
  results.given = shapes;
  results.accused = audit::audit_cohort(shapes);
  if (!makes_numbers_only() && !arguments.output.no_picture)
    results.pictures = cohort_pictures(results.atlas, shapes, results.notes);
  write_results(results, arguments, files, fingerprint, output);
  print_notes(in_option_words(results.notes));
  if (arguments.output.prints()) {
    print_atlas(results);
    output.print_written();
  }
  warn_of_findings(shapes, results.accused);
  warn(results);
  remove_saved(checkpoint);
  return results.converged() ? kDone : kNotConverged;
}

}  // namespace

void add_atlas_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("atlas", "Estimate the template of a cohort, its modes and their covariates");
  auto arguments = std::make_shared<AtlasArguments>();
  arguments->add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson atlas skulls.tps -o out\n"
      "  pulson atlas skulls.csv -o out --model 'log(size) + species * site' --data specimens.csv\n"
      "  pulson atlas skulls.tps -o out --sigma 0 --kernel matern52:alpha=30\n"
      "Exit codes: 0 done, 2 bad input, 3 did not converge (results are written).");
  verb->callback([arguments, verb, &exit_code] { exit_code = run_atlas(*arguments, settings_of(*verb)); });
}

}  // namespace pulson
