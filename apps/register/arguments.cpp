#include "arguments.hpp"

#include <fmt/core.h>

#include "core/paths.hpp"
#include "core/text.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/help_groups.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/picture_sizes.hpp"

namespace pulson {
namespace {

void add_data_options(CLI::App& verb, RegisterArguments& arguments) {
  matching::RegistrationOptions& options = arguments.options;
  begin_group(verb, kModelGroup);
  verb.add_option("--sigma", arguments.sigma,
                  "standard deviation of a landmark's position: a length, or per cent of the source's diameter; fit: "
                  "fitted first")
      ->type_name("LENGTH")
      ->capture_default_str();
  arguments.loss.add_to(verb, "of landmarks in place of least squares; sigma is then fitted, and at least --sigma");
  reads_file(verb.add_option("--weights", arguments.weights,
                             "csv: a weight for each landmark; its variance is sigma^2 divided by it"));
  reads_file(
      verb.add_option("--covariances", arguments.covariances,
                      "csv: variance, variances of the axes or covariance of each landmark, instead of sigma^2"));
  verb.add_flag("--merge-coincident", options.data.merge_coincident,
                "merge landmarks at the same position in the source, with the mean of their targets");
  begin_group(verb, kModelGroup);
  only_known(verb.add_option("--data", arguments.data,
                             "landmarks; for outlines without correspondence varifold, or current (oriented)")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "data");
  begin_group(verb, more(kModelGroup));
  verb.add_option("--data-width", arguments.data_width, "width of the kernel that compares outlines")
      ->type_name("NUMBER")
      ->capture_default_str();
  only_known(verb.add_option("--curve-ends", arguments.curve_ends,
                             "whether outlines are closed, open or auto: closed if the gap is small")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "ends");
  begin_group(verb, kModelGroup);
  only_known(
      verb.add_option(
              "--align", arguments.align,
              "transformation removed first: none, translation, rigid, similarity, affine; auto: similarity in the "
              "plane and in space (of outlines, translation), none on a line")
          ->type_name("NAME")
          ->capture_default_str(),
      "alignment", {"auto"});
  begin_group(verb, more(kModelGroup));
  verb.add_flag("--reflect", options.reflect, "allow the alignment to reflect the shape");
}

void add_solver_options(CLI::App& verb, RegisterArguments& arguments) {
  matching::RegistrationOptions& options = arguments.options;
  begin_group(verb, kModelGroup);
  verb.add_option(
          "--lambda", arguments.lambda,
          "weight of the energy; auto: fitted with --kernel auto, else 1/diameter^2 of the source; fit: fitted first")
      ->type_name("NUMBER")
      ->capture_default_str();
  begin_group(verb, kSearchGroup);
  only_known(verb.add_option("--solver", arguments.solver,
                             "paths; shooting, by the paper's integrator (20) unless --integrator says otherwise: by "
                             "gauss-newton, or where large lbfgs, which can be named, too; auto: paths where there is "
                             "a search for them")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "solver");
  verb.add_flag("--uncertainty", options.uncertainty,
                "standard deviations of momenta and end points, by Laplace's approximation");
  begin_group(verb, more(kSearchGroup));
  verb.add_flag("--homotopy", arguments.homotopy,
                "how far from diffeomorphic the pair is: J while beta of the noise is halved ten times");
  verb.add_option("--samples", options.samples, "realisations of the noise in mode expected")->capture_default_str();
  add_seed_option(verb, options.seed);
  verb.add_option("--tolerance", options.minimise.gradient_tolerance,
                  "relative gradient below which a fit counts as converged")
      ->capture_default_str();
  verb.add_option("--max-iterations", options.minimise.max_iterations, "maximum number of iterations of the solver")
      ->capture_default_str();
}

}  // namespace

void RegisterArguments::add_to(CLI::App& verb) {
  options.integrator = matching::register_defaults().integrator.value;
  reads_shape(
      verb.add_option("SOURCE", source, "shape: file, file#3 (from 1) or file#id=NAME; with --template a target, too"))
      ->required();
  reads_shape(verb.add_option("TARGET", targets,
                              "shapes to match, each separately: as SOURCE, or a file of several; without one, the "
                              "shapes of SOURCE are registered to their mean"));
  add_read_options(verb, reading);
  add_order_option(verb, options.data.by_order);
  output.add_to(verb, "registration.png and .svg");
  field.add_to(verb, "the path", "trajectory.csv");
  add_flip_option(verb, reading);
  begin_group(verb, kPictureGroup);
  reads_file(verb.add_option(
      "--image", image,
      "image of the source, drawn below the landmarks [the one that its file names, if it is beside it]"));
  begin_group(verb, more(kPictureGroup));
  verb.add_option("--pixel-size", pixel_size, "landmark units per pixel of the image [1]");
  verb.add_option("--origin", origin,
                  "x,y of the image's first pixel (where y points up, of its lower edge), landmark units [0,0]")
      ->type_name("X,Y");
  add_max_pixels_option(verb, max_pixels);
  reads_file(verb.add_option("--mesh", mesh,
                             "surface of the source in 3D (ply, stl, obj), drawn below the landmarks [the one beside "
                             "its file, of the same name]"));
  begin_group(verb, kModelGroup);
  verb.add_option(
          "--kernel", kernel,
          "kernel, see pulson info kernels; auto: matern32 of the width of maximum likelihood; alpha=fit: fitted "
          "first, by maximum evidence, as all that is fit")
      ->type_name("SPEC")
      ->capture_default_str();
  verb.add_option("--noise", noise, "noise model, see pulson info noises; beta=fit: fitted first, 2%:fit: from 2 %")
      ->type_name("SPEC")
      ->capture_default_str();
  only_known(verb.add_option("--mode", mode,
                             "deterministic: no noise; metamorphosis: the least expensive path under noise [for ch-sd, "
                             "ch-sd-screened, p-sd]; map: the most probable one [for other noise]; pathwise: for one "
                             "realisation of the noise; expected: for the mean over realisations")
                 ->type_name("NAME"),
             "mode");
  begin_group(verb, more(kModelGroup));
  verb.add_option(
          "--integrator", options.integrator,
          "see pulson info integrators; auto: variational with --solver shooting, in pathwise and expected, else rk4 "
          "without noise, midpoint for metamorphosis, variational-2 for map")
      ->type_name("NAME")
      ->capture_default_str();
  add_data_options(verb, *this);
  add_solver_options(verb, *this);
  begin_group(verb, more(kModelGroup));
  time.add_to(verb, "1");
  begin_group(verb, kManyGroup);
  reads_shape(verb.add_option("--template", from, "source of all shapes: a shape, or mean: their Procrustes mean"));
  units.add_to(verb, "shapes, where there are several");
  begin_group(verb, more(kSearchGroup));
  add_threads_option(verb);
}

OpenModel RegisterArguments::model() const { return {kernel, noise, sigma, lambda}; }

bool RegisterArguments::asks_for_cohort() const {
  return !from.empty() || targets.size() != 1 || read_addressed_shapes(targets.front(), reading).shapes.size() > 1;
}

SourceImage RegisterArguments::source_image(Landmarks& shape, std::vector<std::string>& notes) const {
  if (pixel_size) require_positive("--pixel-size", *pixel_size);
  const FrameOptions frame{pixel_size, parse_place("--origin", origin), std::nullopt};
  if (frame.say_units() && shape.dimension() == 2) shape.frame = frame_on(shape, frame, shape.frame);
  if (image.empty()) {
    const auto named = picture_beside(shape);
    return named ? pulson::source_image(*named, frame, max_pixels, shape, notes) : SourceImage{};
  }
  if (shape.dimension() != 2)
    throw InputError(fmt::format("--image needs landmarks in 2D; {} is in {}D", source, shape.dimension()));
  if (const std::string why = why_no_file(image); !why.empty() || !is_file(image))
    throw InputError(
        fmt::format("cannot read {}: {}", quoted_path(image), why.empty() ? "No such file or directory" : why));
  return pulson::source_image(image, frame, max_pixels, shape, notes);
}

matching::RegistrationOptions RegisterArguments::registration_options(const Landmarks& shape,
                                                                      std::vector<std::string>& notes) const {
  matching::RegistrationOptions asked = options;
  model().set(asked);
  asked.grid = time.grid();
  asked.more_steps = !time.chosen && !time.dt;
  if (mode) asked.mode = matching::parse_mode(*mode);
  if (align != "auto") asked.align = parse_alignment(align);
  asked.minimise.solver = matching::parse_solver(solver);
  asked.data.kind = matching::parse_data_kind(data);
  asked.data.ends = matching::parse_curve_ends(curve_ends);
  if (data_width != "auto") asked.data.width = parse_number(data_width, "--data-width");
  if (!weights.empty()) asked.data.weights = formats::read_weights(weights, shape, &notes, asked.data.by_order);
  if (!covariances.empty())
    asked.data.covariances = formats::read_covariances(covariances, shape, &notes, asked.data.by_order);
  asked.loss = loss.chosen();
  check_at_least(asked.samples, 1, "--samples");
  if (asked.minimise.max_iterations < 0)
    throw InputError(fmt::format("--max-iterations is {}; it must not be negative", asked.minimise.max_iterations));
  if (!(asked.minimise.gradient_tolerance > 0))
    throw InputError(fmt::format("--tolerance is {}; it must be greater than 0", asked.minimise.gradient_tolerance));
  return asked;
}

}  // namespace pulson
