#include "arguments.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/help_groups.hpp"
#include "shell/open_model.hpp"
#include "shell/path_options.hpp"

namespace pulson {

void AtlasArguments::add_to(CLI::App& verb) {
  reads_shape(verb.add_option("COHORT", shapes, "a file with several shapes, or several files"))->required();
  add_read_options(verb, reading);
  add_order_option(verb, by_order);
  output.add_to(verb, "the pictures");
  add_flip_option(verb, reading);
  begin_group(verb, kModelGroup);
  verb.add_option("--kernel", kernel,
                  "kernel, see pulson info kernels; auto: matern32 of the width with the greatest likelihood")
      ->type_name("SPEC")
      ->capture_default_str();
  verb.add_option("--lambda", lambda, "weight of the energy; fit: fitted")->type_name("NUMBER")->capture_default_str();
  verb.add_option("--sigma", sigma,
                  "standard deviation of a landmark's position: a length, or per cent of the mean's diameter; fit: "
                  "fitted; 0: the template is carried onto each shape exactly")
      ->type_name("LENGTH")
      ->capture_default_str();
  loss.add_to(verb, "of each landmark's distance from its prediction by the others, in place of least squares");
  begin_group(verb, kModelGroup);
  verb.add_option("--noise", noise, "none, or ch-sd:beta=B: metamorphosis, in which landmarks move individually, too")
      ->type_name("SPEC")
      ->capture_default_str();
  only_known(verb.add_option("--align", align,
                             "transformation removed first: none, translation, rigid, similarity; auto: similarity in "
                             "the plane and in space, none on a line")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "alignment", {"auto"});
  begin_group(verb, "Statistics");
  verb.add_option("--model", model,
                  "linear model of the shapes by a formula as in R: 'log(size) + species * site'; size is the centroid "
                  "size")
      ->type_name("FORMULA");
  reads_file(verb.add_option("--data", data, "csv file with the columns of --model, a row for each specimen")
                 ->type_name("FILE"));
  reads_column(
      verb.add_option("--covariate", covariate,
                      "the model of one column of numbers of a csv file, such as size or age, and its shapes"));
  verb.add_option("--at", at, "values of the covariate at which the shape is drawn [the least, middle and greatest]")
      ->type_name("NUMBERS")
      ->delimiter(',');
  reads_column(verb.add_option("--groups", groups,
                               "the model of one grouping, and its mean shapes: a column of a csv file, or a comment "
                               "that the cohort's file has for each shape"));
  begin_group(verb, more("Statistics"));
  verb.add_option("--permutations", permutations.count, "permutations of each test")->capture_default_str();
  begin_group(verb, "Statistics");
  verb.add_option("--modes", modes, "principal components in the pictures")->capture_default_str();
  begin_group(verb, more(kSearchGroup));
  add_seed_option(verb, permutations.seed);
  verb.add_option("--steps", options.steps, "time steps of each geodesic")->capture_default_str();
  verb.add_option("--tolerance", options.tolerance,
                  "movement of the template, in diameters, below which it counts as converged")
      ->capture_default_str();
  verb.add_option("--max-iterations", options.max_iterations, "maximum number of iterations of the template")
      ->capture_default_str();
  begin_group(verb, kSearchGroup);
  verb.add_flag("--resume", resume, "continue with the iterations that are saved in the folder");
  begin_group(verb, more(kSearchGroup));
  add_threads_option(verb);
}

std::vector<Landmarks> AtlasArguments::read(std::vector<std::string>& notes) const {
  std::vector<Landmarks> all = read_shapes(shapes, reading, notes);
  leave_out_undigitised(all);
  if (all.size() < 2)
    throw InputError(fmt::format("there is one shape in '{}'; an atlas needs two or more", shapes.front()));
  put_in_order_of(Landmarks(all.front()), all, by_order, notes);
  return all;
}

cohort::AtlasOptions AtlasArguments::atlas_options() const {
  cohort::AtlasOptions asked = options;
  check_at_least(asked.steps, 1, "--steps");
  check_at_least(asked.max_iterations, 1, "--max-iterations");
  check_at_least(modes, 1, "--modes");
  check_at_least(permutations.count, 1, "--permutations");
  if (!model.empty() && !(covariate.empty() && groups.empty()))
    throw InputError(fmt::format("--model has all terms in its formula; leave out {}",
                                 covariate.empty() ? "--groups" : "--covariate"));
  if (!data.empty() && model.empty()) throw InputError("--data needs --model");
  if (!at.empty() && covariate.empty()) throw InputError("--at needs --covariate");
  for (const double value : at)
    if (!std::isfinite(value)) throw InputError(fmt::format("--at: {} is not a finite number", value));
  if (!(asked.tolerance > 0))
    throw InputError(fmt::format("--tolerance is {}; it must be greater than 0", asked.tolerance));
  if (!OpenSpec::parse(kernel, "kernel").open.empty())
    throw InputError(fmt::format("--kernel {}: an atlas fits the width of auto alone; give a number", kernel));
  if (kernel != "auto") asked.kernel = kernel;
  if (!is_fitted("--lambda", lambda)) asked.lambda = parse_number(lambda, "--lambda");
  if (asked.lambda && !(*asked.lambda > 0))
    throw InputError(fmt::format("--lambda is {}; it must be greater than 0", lambda));
  if (!is_fitted("--sigma", sigma)) {
    asked.sigma = Length::parse(sigma, "--sigma");
    if (!(asked.sigma->in(1) >= 0)) throw InputError(fmt::format("--sigma is {}; it must be 0 or greater", sigma));
  }
  asked.loss = loss.chosen();
  if (align != "auto") asked.align = parse_alignment(align);
  if (asked.align == AlignmentKind::kAffine)
    throw InputError("--align affine: a mean under affine alignment would shrink to a point; use similarity");
  const std::vector<Spec> terms = parse_spec_sum(noise, "noise");
  if (terms.size() == 1 && terms.front().name == "ch-sd" && terms.front().values.size() == 1 &&
      terms.front().values.contains("beta")) {
    asked.beta = Length::parse(terms.front().values.at("beta"), "--noise ch-sd:beta");
    if (!(asked.beta.in(1) > 0)) throw InputError(fmt::format("--noise {}: beta must be greater than 0", noise));
  } else if (noise != "none") {
    throw InputError(fmt::format("--noise {}: an atlas takes none or ch-sd:beta=B", noise));
  }
  return asked;
}

}  // namespace pulson
