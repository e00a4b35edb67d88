// `pulson warp`: the map of a registration applied to an image or to landmarks.

#include <filesystem>
#include <memory>

#include <fmt/core.h>

#include "jobs.hpp"
#include "pictures.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/records/records.hpp"
#include "register/registration_warnings.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

void run_points(const WarpArguments& arguments, const matching::Registration& registration, double start) {
  const warp::MaterialFlow flow(registration_system(registration), replay(registration),
                                warp::parse_label_kernel(arguments.labels));
  WarpFigures figures = warp_points(flow, registration, arguments);
  figures.seconds = seconds_now() - start;
  print_figures(figures, arguments, nullptr);
}

// Landmarks that lie outside the image show that units, origin or y are not those of the image.
void warn_of_landmarks_outside(const WarpArguments& arguments, const matching::Registration& registration,
                               const WarpFrames& frames, const Picture& picture) {
  if (registration.source.dimension() != 2) return;
  const Points pixels =
      frames.input.to_pixels(arguments.inverse ? registration.target.points : registration.original.points);
  Eigen::Index outside = 0;
  for (const auto pixel : pixels.colwise())
    outside += (pixel.array() < -1).any() || pixel[0] > picture.image.width() || pixel[1] > picture.image.height();
  if (outside > 0)
    print_warning(
        fmt::format("{} of {} landmarks lie outside {}: check that it is the right image, and see --pixel-size, "
                    "--origin and --flip-y",
                    outside, pixels.cols(), arguments.input));
}

void run_image(const WarpArguments& arguments, const matching::Registration& registration, double start) {
  const Picture picture = read_picture(arguments.input);
  const WarpFrames frames = warp_frames(arguments, registration, picture);
  warn_of_landmarks_outside(arguments, registration, frames, picture);
  const warp::MaterialFlow flow(registration_system(registration), replay(registration),
                                warp::parse_label_kernel(arguments.labels));
  if (!flow.is_diffeomorphic()) arguments.check_for_fold();
  const images::ImageWarp warp = arguments.inverse
                                     ? images::ImageWarp(flow, registration.alignment, frames.result, frames.input)
                                     : images::ImageWarp(flow, registration.alignment, frames.input, frames.result);
  WarpedImage result = arguments.samples > 0 ? warp_samples(picture.image, registration, frames, arguments)
                                             : warp_image(picture.image, warp, frames, arguments);
  log_step("mapped the image");
  write_picture(arguments.out, result.image, frames.result, picture.type);
  result.figures.colours = write_more_results(picture.image, result, warp, frames, arguments);
  try {
    if (!arguments.animate.empty()) write_animation(picture.image, warp, frames, arguments);
  } catch (const InputError& error) {
    print_warning(fmt::format("there is no animation: {}", error.what()));
  }
  if (arguments.samples == 0) result.figures.landmark_error_max = warp.landmark_error();
  result.figures.ridge = flow.ridge();
  result.figures.seconds = seconds_now() - start;
  if (!arguments.report.empty()) write_warp_report(picture.image, result, warp, frames, registration, arguments);
  print_figures(result.figures, arguments, &frames);
}

// The record, or that in the folder of a registration.
std::filesystem::path record_of(const WarpArguments& arguments) {
  std::filesystem::path given = arguments.registration;
  std::error_code error;
  if (std::filesystem::is_directory(given, error)) return given / "registration.json";
  if (is_picture_file(arguments.registration))
    throw InputError(fmt::format("{} is an image; the registration comes first, then the image", given.string()));
  return given;
}

void run_warp(const WarpArguments& arguments) {
  const double start = seconds_now();
  const bool of_image = is_picture_file(arguments.input);
  if (is_picture_file(arguments.registration)) record_of(arguments);  // refuses it
  arguments.check();
  if (of_image)
    check_picture_file(arguments.out);
  else
    arguments.check_for_landmarks();
  const matching::Registration registration = records::read_registration(record_of(arguments));
  log_step(fmt::format("read {}: {} landmarks", arguments.registration, registration.source.count()));
  if (of_image)
    run_image(arguments, registration, start);
  else
    run_points(arguments, registration, start);
  for (const std::string& text : path_warnings(registration)) print_warning("of the registration: " + text);
}

}  // namespace

void add_warp_verb(CLI::App& program, int& /*exit_code*/) {
  const auto arguments = std::make_shared<WarpArguments>();
  CLI::App* verb = program.add_subcommand("warp", "Apply the map of a registration to an image or to landmarks");
  arguments->add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson warp out/registration.json a.png -o warped.png --side-by-side both.png\n"
      "  pulson warp out/registration.json a.jpg --like b.jpg --pixel-size 10 -o warped.png --report page.html\n"
      "  pulson warp out/registration.json b.png --inverse -o back.png\n"
      "  pulson warp out/registration.json a.png -o warped.png --jacobian j.tif --animate motion.gif\n"
      "  pulson warp out/registration.json points.csv -o moved.csv\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([arguments] { run_warp(*arguments); });
}

}  // namespace pulson
