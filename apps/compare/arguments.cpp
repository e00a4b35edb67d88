#include "arguments.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "core/determined.hpp"
#include "core/open_numbers.hpp"
#include "matching/defaults.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/help_groups.hpp"
#include "shell/open_model.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "weights.hpp"

namespace pulson {
namespace {

// Where σ is fitted from, per cent of the diameter: landmarks that are placed by hand.
constexpr double kUsualError = 1;

// A comparison finds starting values by itself, and has no priors of numbers.
void require_plain(const OpenSpec& spec, const std::string& given, const std::string& option) {
  for (const OpenNumber& number : spec.open)
    if (!number.start.empty() || number.log_deviation)
      throw InputError(
          fmt::format("{} {}: numbers are fitted from their own starting values and without priors here: "
                      "{}=fit",
                      option, quoted_line(given), number.name));
}

}  // namespace

std::vector<std::string> usual_noises() {
  return {"none", "ch-sd:beta=fit", "p-sd:beta=fit,fields=grid,count=3", "trouve-vialard:sigma=fit"};
}

std::vector<NoiseChoice> CompareArguments::candidates() const {
  std::vector<NoiseChoice> all;
  for (const std::string& noise : noises.empty() ? usual_noises() : noises) all.emplace_back(open_noise(noise));
  return all;
}

std::vector<NoiseChoice> CompareArguments::simulated() const {
  if (simulate == std::vector<std::string>{"all"}) return candidates();
  std::vector<NoiseChoice> all;
  for (const std::string& noise : simulate) all.emplace_back(open_noise(noise));
  return all;
}

// fit_cohort() fits what has no default and is left out.
std::string CompareArguments::open_noise(const std::string& noise) {
  const OpenSpec spec = OpenSpec::parse(noise, "noise");
  require_plain(spec, noise, "--noise");
  require_numbers(spec, noise_table());
  const std::vector<MissingNumber> missing = missing_numbers(spec.text, noise_table());
  const auto is_missing = [&](const std::string& name) {
    return std::any_of(missing.begin(), missing.end(),
                       [&](const MissingNumber& number) { return number.name == name; });
  };
  for (const OpenNumber& number : spec.open)
    if (!is_missing(number.name))
      throw InputError(
          fmt::format("--noise {}: compare does not fit {}; give a number, or leave it out", noise, number.name));
  return spec.text;
}

void CompareArguments::add_to(CLI::App& verb) {
  options.settings.integrator = matching::compare_defaults().integrator.value;
  reads_shape(verb.add_option("SHAPES", shapes,
                              "SOURCE TARGET [TARGET ...]; or one file with several shapes, compared with their mean"))
      ->required();
  begin_group(verb, kModelGroup);
  verb.add_option("--noise", noises,
                  fmt::format("a noise model; beta=fit: that number is fitted [{}]", fmt::join(usual_noises(), ", ")))
      ->type_name("SPEC");
  begin_group(verb, kInputGroup);
  reads_shape(
      verb.add_option("--source", source, "shape that the others are compared with, or mean: their Procrustes mean"));
  add_read_options(verb, reading);
  add_flip_option(verb, reading);
  add_order_option(verb, by_order);
  begin_group(verb, more(kInputGroup));
  verb.add_flag("--merge-coincident", merge_coincident,
                "merge landmarks at the same position in the source, and take the mean of theirs in each target");
  output.add_to(verb, "comparison.png and .svg");
  begin_group(verb, kModelGroup);
  verb.add_option(
          "--sigma", sigma,
          fmt::format(
              "digitising error: a length, or per cent of the source's diameter; fit: fitted in each model [{}]",
              matching::compare_defaults().sigma.value))
      ->type_name("LENGTH");
  loss.add_to(
      verb,
      "of each landmark's distance from its prediction by the others, in place of least squares: weights that are "
      "the same in all models");
  begin_group(verb, kModelGroup);
  only_known(verb.add_option("--align", align,
                             "transformation removed from each target: none, translation, rigid, similarity, affine; "
                             "auto: similarity about a mean, else none")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "alignment", {"auto"});
  verb.add_option("--kernel", kernel, "kernel, see pulson info kernels; alpha=fit: its width is fitted in each model")
      ->type_name("SPEC")
      ->capture_default_str();
  verb.add_option("--lambda", lambda, "inverse variance of the momenta; fit: fitted in each model")
      ->type_name("NUMBER")
      ->capture_default_str();
  begin_group(verb, more(kModelGroup));
  verb.add_option("--integrator", options.settings.integrator, "see pulson info integrators")
      ->type_name("NAME")
      ->capture_default_str();
  begin_group(verb, kSearchGroup);
  verb.add_option("--folds", options.folds, "cross-validation folds for predicting held-out shapes; 0: none")
      ->capture_default_str();
  begin_group(verb, more(kSearchGroup));
  verb.add_option("--forward-samples", options.forward_samples,
                  "shapes drawn from each model to predict held-out shapes")
      ->capture_default_str();
  verb.add_option("--evidence", evidence,
                  "by which models are ranked: importance, that of the importance samples with which numbers are "
                  "fitted; sampled: of Markov chains with these numbers, by bridge sampling, and slower")
      ->type_name("NAME")
      ->capture_default_str();
  verb.add_option("--importance", options.settings.importance_samples,
                  "importance samples per shape, at most, for its evidence; 0: Laplace's approximation")
      ->capture_default_str();
  verb.add_option("--bootstrap", options.bootstrap,
                  "cohorts drawn without noise, for the p-values; 0: from their limit for many shapes")
      ->capture_default_str();
  verb.add_flag("--no-maps", no_maps, "do not measure folded areas");
  begin_group(verb, kManyGroup);
  verb.add_option("--simulate", simulate,
                  "draw cohorts from this model instead and count which model is chosen; beta=fit: fitted to the "
                  "shapes; all: every --noise")
      ->type_name("SPEC");
  begin_group(verb, more(kManyGroup));
  verb.add_option("--true-lambda", true_lambda,
                  "inverse variance of the momenta in the generating models [fitted to the shapes]");
  verb.add_option("--true-kernel", true_kernel,
                  "kernel of the generating models, with --true-lambda [that of --kernel, of automatic width where its "
                  "width is fitted]")
      ->type_name("SPEC");
  begin_group(verb, kManyGroup);
  verb.add_option("--count", count, "cohorts drawn from each model")->capture_default_str();
  verb.add_option("--cohort-size", cohort_size,
                  "shapes in each cohort drawn [as many as are given, or 20 if one is given]");
  units.add_to(verb, "cohorts of --simulate");
  begin_group(verb, more(kSearchGroup));
  add_seed_option(verb, options.settings.seed);
  time.add_to(verb, "1");
  add_threads_option(verb);
}

compare::CohortShapes CompareArguments::read(std::vector<std::string>& notes) const {
  if (simulate.empty() && (!units.shard.empty() || units.resume))
    throw InputError(fmt::format("{} is for the cohorts of --simulate", units.resume ? "--resume" : "--shard"));
  std::vector<Landmarks> all = read_shapes(shapes, reading, notes);
  compare::CohortShapes cohort;
  if (source && *source != "mean")
    cohort.source = read_landmarks(*source, &notes, reading);
  else if (!source && shapes.size() > 1) {
    cohort.source = read_landmarks(shapes.front(), nullptr, reading);
    all.erase(all.begin());
  }
  if (cohort.source) require_digitised(*cohort.source);
  leave_out_undigitised(all);
  cohort.targets = std::move(all);
  if (!cohort.targets.empty())
    put_in_order_of(cohort.source.value_or(cohort.targets.front()), cohort.targets, by_order, notes);
  if (!cohort.source && cohort.targets.size() == 1 && !simulate.empty() && true_lambda) {
    cohort.source = cohort.targets.front();  // nothing is fitted to it
    cohort.alignment = align == "auto" ? AlignmentKind::kNone : parse_alignment(align);
    pulson::compare::merge_coincident(cohort, merge_coincident, notes);
    return cohort;
  }
  if (cohort.targets.empty()) throw InputError("there is no target besides the source");
  if (!cohort.source && cohort.targets.size() < 2)
    throw InputError(
        "a single shape cannot be compared with its mean; give a source and a target, or a file with several shapes");
  cohort.alignment = align != "auto" ? parse_alignment(align)
                     : cohort.source ? AlignmentKind::kNone
                                     : AlignmentKind::kSimilarity;
  if (align == "auto" && cohort.source && cohort.source->dimension() > 1)
    if (const double of_pose = part_of_pose(cohort.source->points, cohort.targets); of_pose > kMostlyPose)
      notes.push_back(
          fmt::format("{:.0f} % of the squared distances from the source are position, orientation and size of the "
                      "shapes, and count as deformation; --align similarity removes them",
                      100 * of_pose));
  pulson::compare::merge_coincident(cohort, merge_coincident, notes);
  if (const auto chosen = loss.chosen(); chosen && !simulate.empty())
    throw InputError("--loss is for shapes as they are, and --simulate draws them: leave it out");
  else if (chosen)
    weigh(*chosen, cohort, notes);
  return cohort;
}

compare::CompareOptions CompareArguments::compare_options(const compare::CohortShapes& cohort,
                                                          std::vector<std::string>& notes) const {
  const compare::Cohort about = cohort.cohort();
  compare::CompareOptions asked = options_about(about.source);
  if (constexpr std::size_t kFewest = 3;
      (asked.settings.fit_width || asked.settings.fit_sigma) && cohort.targets.size() < kFewest && simulate.empty()) {
    if (std::exchange(asked.settings.fit_sigma, false))
      notes.push_back(fmt::format("sigma is {:.4g}, {} % of the diameter: so few shapes do not determine it",
                                  asked.settings.sigma.in(0), kUsualError));
    if (std::exchange(asked.settings.fit_width, false))
      notes.push_back(
          fmt::format("the kernel's width is chosen by the spacing of landmarks, {:.4g}: so few shapes do not "
                      "determine it",
                      asked.settings.kernel.make(about.source.points).terms().front().alpha));
  }
  if (time.is_automatic()) asked.settings.grid.steps = sufficient_steps(about, asked.settings);
  return asked;
}

compare::CompareOptions CompareArguments::options_about(const Landmarks& about) const {
  compare::CompareOptions asked = options;
  check_at_least(asked.folds, 0, "--folds");
  check_at_least(asked.forward_samples, 2, "--forward-samples");
  check_at_least(asked.settings.importance_samples, 0, "--importance");
  check_at_least(asked.bootstrap, 0, "--bootstrap");
  if (evidence != "importance" && evidence != "sampled")
    throw InputError(fmt::format("--evidence is '{}'; it must be importance or sampled", evidence));
  asked.sampled_evidence = evidence == "sampled";
  if (asked.sampled_evidence && asked.bootstrap > 0)
    throw InputError("--bootstrap compares evidences by importance sampling; leave out --evidence sampled");
  check_at_least(count, 1, "--count");
  if (cohort_size) check_at_least(*cohort_size, 1, "--cohort-size");
  if (true_lambda && !(*true_lambda > 0))
    throw InputError(fmt::format("--true-lambda is {}; it must be greater than 0", *true_lambda));
  asked.settings.grid = time.grid();
  const OpenSpec width = OpenSpec::parse(kernel, "kernel");
  require_plain(width, kernel, "--kernel");
  asked.settings.fit_width = !width.open.empty();
  const std::size_t terms = parse_spec_sum(kernel, "kernel").size();
  for (const OpenNumber& number : width.open)
    if (!number.name.ends_with("alpha") || width.open.size() != terms)
      throw InputError(fmt::format("--kernel {}: compare fits the widths alpha, of a sum all by one factor", kernel));
  asked.settings.kernel = make_kernel(width.text, about.points).spec();
  if (!true_kernel.empty()) static_cast<void>(make_kernel(true_kernel, about.points));
  asked.maps = !no_maps;
  if (!is_fitted("--lambda", lambda)) asked.settings.lambda = parse_number(lambda, "--lambda");
  const std::string of_sigma = sigma.value_or(matching::compare_defaults().sigma.value);
  const std::optional<OpenNumber> open_sigma = OpenNumber::parse(of_sigma, "--sigma");
  if (open_sigma && open_sigma->log_deviation)
    throw InputError(fmt::format("--sigma {}: numbers have no priors here: fit, or 2%:fit to begin there", of_sigma));
  asked.settings.fit_sigma = open_sigma.has_value();
  const std::string start = open_sigma ? open_sigma->start : of_sigma;
  asked.settings.sigma = start.empty() ? Length::percent(kUsualError).in(diameter(about.points))
                                       : Length::parse(start, "--sigma").in(diameter(about.points));
  return asked;
}

}  // namespace pulson
