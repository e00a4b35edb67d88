#include "arguments.hpp"

#include <string_view>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"

namespace pulson {
namespace {

constexpr double kUsualSigma = 0.01;  // of the diameter
constexpr std::string_view kFittedWidth = "alpha=fit";

}  // namespace

std::vector<std::string> usual_noises() { return {"none", "ch-sd", "p-sd:fields=grid,count=3", "trouve-vialard"}; }

void CompareArguments::add_to(CLI::App& verb) {
  reads_shape(verb.add_option("SHAPES", shapes,
                              "SOURCE TARGET [TARGET ...]; or one file with several shapes, compared with their mean"))
      ->required();
  verb.add_option("--noise", noises,
                  "a noise model; required parameters that are left out are fitted [none, ch-sd, "
                  "p-sd:fields=grid,count=3, trouve-vialard]")
      ->type_name("SPEC");
  reads_shape(
      verb.add_option("--source", source, "shape that the others are compared with, or mean: their Procrustes mean"));
  add_read_options(verb, reading);
  add_flip_option(verb, reading);
  add_order_option(verb, by_order);
  verb.add_flag("--merge-coincident", merge_coincident,
                "merge landmarks at the same position in the source, and take the mean of theirs in each target");
  output.add_to(verb, "comparison.png and .svg");
  verb.add_option("--sigma", sigma, "digitising error, length units; auto: 1 % of the diameter")
      ->type_name("NUMBER")
      ->capture_default_str();
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
  verb.add_option("--integrator", options.settings.integrator, "see pulson info integrators")
      ->type_name("NAME")
      ->capture_default_str();
  verb.add_option("--folds", options.folds, "cross-validation folds for predicting held-out shapes; 0: none")
      ->capture_default_str();
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
  verb.add_option("--simulate", simulate,
                  "draw cohorts from this model instead and count which model is chosen; parameters left out are "
                  "fitted to the shapes; all: every --noise")
      ->type_name("SPEC");
  verb.add_option("--true-lambda", true_lambda,
                  "inverse variance of the momenta in the generating models [fitted to the shapes]");
  verb.add_option("--true-kernel", true_kernel,
                  "kernel of the generating models, with --true-lambda [that of --kernel, of automatic width where its "
                  "width is fitted]")
      ->type_name("SPEC");
  verb.add_option("--count", count, "cohorts drawn from each model")->capture_default_str();
  verb.add_option("--cohort-size", cohort_size,
                  "shapes in each cohort drawn [as many as are given, or 20 if one is given]");
  units.add_to(verb, "cohorts of --simulate");
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
  pulson::compare::merge_coincident(cohort, merge_coincident, notes);
  return cohort;
}

compare::CompareOptions CompareArguments::compare_options(const compare::CohortShapes& cohort,
                                                          std::vector<std::string>& notes) const {
  const compare::Cohort about = cohort.cohort();
  compare::CompareOptions asked = options_about(about.source, notes);
  if (constexpr std::size_t kFewest = 3;
      asked.settings.fit_width && cohort.targets.size() < kFewest && simulate.empty()) {
    asked.settings.fit_width = false;
    notes.push_back(
        fmt::format("the kernel's width is chosen by the spacing of landmarks, {:.4g}: so few shapes do not "
                    "determine it",
                    asked.settings.kernel.make(about.source.points).terms().front().alpha));
  }
  if (!time.chosen) asked.settings.grid.steps = sufficient_steps(about, asked.settings);
  return asked;
}

compare::CompareOptions CompareArguments::options_about(const Landmarks& about, std::vector<std::string>& notes) const {
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
  std::string spec = kernel;
  if (const std::size_t place = spec.find(kFittedWidth); place != std::string::npos) {
    asked.settings.fit_width = true;
    spec.replace(place, kFittedWidth.size(), "alpha=auto");
  }
  asked.settings.kernel = make_kernel(spec, about.points).spec();
  if (!true_kernel.empty()) static_cast<void>(make_kernel(true_kernel, about.points));
  asked.maps = !no_maps;
  if (lambda != "fit") asked.settings.lambda = parse_number(lambda, "--lambda");
  asked.settings.sigma = sigma == "auto" ? kUsualSigma * diameter(about.points) : parse_number(sigma, "--sigma");
  if (sigma == "auto")
    notes.push_back(
        fmt::format("sigma {:.3g}, 1 % of the diameter, is a guess: give --sigma, the digitising error, on which the "
                    "ranking depends",
                    asked.settings.sigma.in(0)));
  return asked;
}

}  // namespace pulson
