// `pulson warp`: the map of a registration applied to an image or to landmarks.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>

#include <fmt/core.h>

#include "jobs.hpp"
#include "pictures.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/records/records.hpp"
#include "register/registration_warnings.hpp"
#include "report.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/printing.hpp"
#include "shell/verbs.hpp"
#include "space_field.hpp"

namespace pulson {
namespace {

// Numbers first: what is drawn may fail.
void run_points(const WarpArguments& arguments, const matching::Registration& registration, double start) {
  const Interrupt until_written;
  const warp::MaterialFlow flow(registration_system(registration), replay(registration),
                                warp::parse_label_kernel(arguments.labels));
  check_space_field(arguments, flow);
  WarpedPoints warped = warp_points(flow, registration, arguments);
  warped.figures.seconds = seconds_now() - start;
  write_figures({warped.figures, arguments, nullptr});
  const std::string field = arguments.field.empty() ? "" : write_space_field(arguments, flow, registration);
  try_to_write(arguments.report, [&] { write_warp_report(warped, flow, registration, arguments); });
  print_figures({warped.figures, arguments, nullptr});
  if (!field.empty() && arguments.json != "-" && verbosity() != Verbosity::kQuiet) print_text("{}\n", field);
}

// A map that takes the image elsewhere is a frame that is wrong.
void check_coverage(const WarpArguments& arguments, const images::WarpedImage& result) {
  const double uncovered = result.figures.uncovered_fraction;
  constexpr double kMostUncovered = 0.9;
  if (uncovered <= kMostUncovered) return;
  const std::string advice = arguments.like.empty() && arguments.size.empty()
                                 ? "see --pixel-size, --origin and --flip-y"
                                 : "see --target-pixel-size, --target-origin and --flip-y, or leave out --like and "
                                   "--size, and the result holds all";
  const std::string text =
      fmt::format("{} of the result shows nothing of {}: {}", percent_text(uncovered), arguments.input, advice);
  if (uncovered >= 1) throw InputError(text);
  print_warning(text);
}

WarpFigures figures_of(const WarpResult& result, const warp::MaterialFlow& flow) {
  WarpFigures figures{result.figures, result.pulled ? "pull" : "push", result.reason, result.landmark_error};
  figures.ridge = flow.ridge();
  return figures;
}

// Whether the result can be written, and what is not done as asked for.
void check_result(const WarpArguments& arguments, const Picture& picture) {
  const images::Interpolation asked = images::parse_interpolation(arguments.interpolation);
  check_result_picture(arguments.out, picture, asked);
  if (picture.pages.front().about.has_palette() && asked != images::Interpolation::kLabel &&
      asked != images::Interpolation::kNearest)
    print_note(fmt::format("{} has a palette, whose numbers have no means: it is warped with --interpolation label",
                           arguments.input));
}

WarpResult warped(const Picture& picture, const images::ImageWarp& warp, const matching::Registration& registration,
                  const WarpFrames& frames, const WarpArguments& arguments) {
  if (arguments.samples > 0) return warp_samples(picture, registration, frames, arguments);
  const images::WarpImageOptions options = warp_options(arguments, frames, picture.pages.front());
  return {warp_image(pages_of(picture), warp, options), {}, {}, warp.landmark_error()};
}

// What the file said of its pixels' places is of the result's only where these have not moved.
void describe_result(const WarpArguments& arguments, const WarpFrames& frames, images::PageMetadata& about) {
  if (frames.orientation) about.orientation = *frames.orientation;
  if (frames.first_pixel == std::array{0, 0} && arguments.like.empty()) return;
  constexpr std::uint32_t kOfMaps[] = {33550, 33922, 34264, 34735, 34736, 34737};  // GeoTIFF
  const auto dropped = std::erase_if(about.tiff_tags, [&](const images::TiffTag& tag) {
    return std::find(std::begin(kOfMaps), std::end(kOfMaps), tag.tag) != std::end(kOfMaps);
  });
  if (dropped > 0)
    print_note(fmt::format("{}: the place on the map that {} says is left out, for the result begins elsewhere",
                           arguments.out, arguments.input));
}

// All pages; what is drawn shows the first.
void write_result(const WarpArguments& arguments, const Picture& picture, const WarpFrames& frames,
                  WarpResult& result) {
  std::vector<images::Image> images{std::move(result.image)};
  std::move(result.more.begin(), result.more.end(), std::back_inserter(images));
  result.more.clear();
  std::vector<images::Page> pages = pages_with(picture, std::move(images));
  for (images::Page& page : pages) describe_result(arguments, frames, page.about);
  result.image = shown(pages.front());
  write_picture(arguments.out, std::move(pages), frames.result);
}

// The picture is the result, and numbers come next. All else may fail.
void run_image(const WarpArguments& arguments, const matching::Registration& registration, double start) {
  Picture picture = read_picture(arguments.input, arguments.max_pixels);
  check_result(arguments, picture);
  const warp::MaterialFlow flow(registration_system(registration), replay(registration),
                                warp::parse_label_kernel(arguments.labels));
  if (!flow.is_diffeomorphic()) arguments.check_for_fold();
  const WarpFrames frames = warp_frames(arguments, registration, flow, picture);
  const images::ImageWarp warp = arguments.inverse
                                     ? images::ImageWarp(flow, registration.alignment, frames.result, frames.input)
                                     : images::ImageWarp(flow, registration.alignment, frames.input, frames.result);
  WarpResult result = warped(picture, warp, registration, frames, arguments);
  log_step("mapped the image");
  check_coverage(arguments, result);
  print_notes(frames.notes);
  for (const std::string& text : frames.warnings) print_warning(text);
  const Interrupt until_written;
  write_result(arguments, picture, frames, result);
  const images::Image& image = picture.image;
  WarpFigures figures = figures_of(result, flow);
  figures.seconds = seconds_now() - start;
  write_figures({figures, arguments, &frames});
  if (!arguments.field.empty()) write_field(arguments.field, result, image, frames);
  figures.colours = write_more_results(image, result, warp, frames, arguments);
  try_to_write(arguments.animate, [&] { write_animation(image, warp, frames, arguments); });
  try_to_write(arguments.report,
               [&] { write_warp_report(image, result, figures, warp, frames, registration, arguments); });
  print_figures({figures, arguments, &frames});
}

// The record, or that in the folder of a registration.
std::filesystem::path record_of(const WarpArguments& arguments) {
  std::filesystem::path given = arguments.registration;
  if (is_folder(given)) return given / "registration.json";
  if (is_picture_file(arguments.registration))
    throw InputError(fmt::format("{} is an image; the registration comes first, then the image", given.string()));
  return given;
}

void run_warp(const WarpArguments& arguments) {
  const double start = seconds_now();
  const bool of_image = is_picture_file(arguments.input);
  run_paths().reads(record_of(arguments), "REGISTRATION");
  arguments.check();
  if (of_image && arguments.grid_points)
    throw InputError("--grid-points is for landmarks in 3D; the field of an image has a point for each of its pixels");
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
