#include "arguments.hpp"

#include <charconv>
#include <cmath>
#include <type_traits>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "draw/animation.hpp"
#include "drawings.hpp"
#include "formats/shape_address.hpp"
#include "jobs.hpp"
#include "picture_files.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "shell/help_groups.hpp"
#include "shell/messages.hpp"
#include "shell/outputs.hpp"
#include "shell/path_options.hpp"
#include "shell/tables.hpp"

namespace pulson {
namespace {

// Files that are drawings or masks, of which grids hold none, and formats without alpha no drawing.
void check_drawing_file(const std::string& file) {
  check_picture_file(file);
  if (!keeps_alpha(file)) throw InputError(fmt::format("{}: drawings and masks are written as .png or .tif", file));
}

// Drawings with captions.
void check_captioned_file(const std::string& file) {
  if (!is_drawing_file(file)) throw InputError(fmt::format("{}: it is drawn as .png, .svg or .pdf", file));
  check_output_file(file);
}

// Files of one number a pixel, or its colour.
void check_numbers_file(const std::string& file) {
  if (is_drawing_file(file)) return check_captioned_file(file);
  check_picture_file(file);
  if (!holds_numbers(file))
    throw InputError(fmt::format("{}: numbers are written as .png, .svg, .pdf (colours), .tif, .mha or .nrrd", file));
}

// ---- files beside the result

void check_grid(const std::string& file) {
  if (!is_grid_file(file)) throw InputError(fmt::format("{}: displacement fields are written as .mha or .nrrd", file));
  check_output_file(file);
}

void check_animation(const std::string& file) {
  check_output_file(file);
  draw::Animation::check_extension(file);
}

void check_page(const std::string& file) { check_output_file(file); }

constexpr const char* kMoreResults = "More results";
constexpr const char* kMaps = "Maps of the deformation, more";
constexpr const char* kEnsembles = "Ensembles, more";

struct FileOption {
  const char* name;
  std::string WarpArguments::*file;
  void (*check)(const std::string& file);
  const char* help;
  bool needs_inverse = false;  // with --inverse
  bool of_images = true;
  const char* group = kMoreResults;
};

const std::vector<FileOption>& file_options() {
  using W = WarpArguments;
  static const std::vector<FileOption> kOptions = {
      {"--field", &W::field, check_grid,
       "displacement field (mha, nrrd): of an image, or of landmarks in 3D about these", false, false, kMaps},
      {"--jacobian", &W::jacobian, check_numbers_file,
       "signed Jacobian on the image, as colours (png, svg, pdf) or numbers (tif, mha, nrrd)", true, true, kMaps},
      {"--log-jacobian", &W::log_jacobian, check_numbers_file, "its logarithm to base 2, likewise", true, true, kMaps},
      {"--multiplicity", &W::multiplicity, check_numbers_file,
       "how many points of the image land on each pixel, likewise", false, true, kMaps},
      {"--displacement", &W::displacement, check_numbers_file,
       "how far each pixel of the image moves after the alignment, likewise", true, true, kMaps},
      {"--folds", &W::folds, check_drawing_file, "mask of the image's pixels where the map folds (png)", true, true,
       kMaps},
      {"--holes", &W::holes, check_drawing_file, "mask of holes in the result (png)", false, true, kMaps},
      {"--grid", &W::grid, check_drawing_file, "the result with the deformed grid and the landmarks' paths (png)",
       true},
      {"--side-by-side", &W::side_by_side, check_captioned_file,
       "image, result and --like side by side (png, svg, pdf)", true},
      {"--overlay", &W::overlay, check_captioned_file,
       "the result over --like: checkerboard, blend and difference (png, svg, pdf)"},
      {"--report", &W::report, check_page,
       "a page (html) with the motion, the result over --like, drawings and numbers", true, false},
      {"--animate", &W::animate, check_animation, "the motion (gif, mp4, webp; needs ffmpeg)"},
      {"--deviation", &W::deviation, check_numbers_file, "standard deviation of each pixel, as colours or numbers",
       false, true, kEnsembles},
      {"--fold-probability", &W::fold_probability, check_numbers_file,
       "probability that the map folds at a pixel of the image", false, true, kEnsembles}};
  return kOptions;
}

}  // namespace

void WarpArguments::add_to(CLI::App& verb) {
  const auto add = [&](const char* group, const char* name, auto& value, const char* help, const char* type = nullptr) {
    CLI::Option* option = verb.add_option(name, value, help);
    if (type != nullptr) option->type_name(type);
    if constexpr (!std::is_same_v<decltype(value), std::optional<double>&>) option->capture_default_str();
    if (group != nullptr) option->group(group);
    return option;
  };
  begin_group(verb, kInputGroup);
  reads_file(add(nullptr, "REGISTRATION", registration, "registration.json of pulson register"))->required();
  reads_shape(
      add(nullptr, "INPUT", input, "image of the source (png, jpg, tif, bmp, pgm, ppm; mha, nrrd), or landmarks"))
      ->required();
  writes_file(add(nullptr, "-o,--out", out, "the warped image; or landmarks, in the format of its extension"))
      ->required();
  writes_file(add(nullptr, "--json", json,
                  "write the numbers to this file; -: to standard output, with nothing else printed there"));
  begin_group(verb, more(kInputGroup));
  add_table_option(verb);
  add_quiet_option(verb);
  begin_group(verb, "Picture");
  verb.add_flag("--inverse", inverse, "map from target to source");
  begin_group(verb, more("Picture"));
  only_known(add(nullptr, "--labels", labels,
                 "interpolation of the displacements by noise between landmarks: metric or thin-plate", "NAME"),
             "labels");

  constexpr const char* kCoordinates = "Coordinates";
  const std::string more_coordinates = more(kCoordinates);
  reads_file(add(kCoordinates, "--like", like, "image of the target: the result has its size and coordinates"));
  add(kCoordinates, "--size", size,
      "size of the result, as in 640x480 [holds the target's landmarks and the warped image's corners]", "WxH");
  add(kCoordinates, "--pixel-size", pixel_size,
      "landmark units per pixel of the image [as the landmarks' or the image's file says, else 1]");
  add(more_coordinates.c_str(), "--target-pixel-size", target_pixel_size,
      "landmark units per pixel of the result [--pixel-size]");
  add(kCoordinates, "--origin", origin,
      "x,y of the image's first pixel (where y points up, of its lower edge), landmark units [0,0]", "X,Y");
  add(more_coordinates.c_str(), "--target-origin", target_origin, "the same for the result [--origin]", "X,Y");
  // Not bound to the variable: CLI11 would set an optional to false where the flag is not given.
  verb.add_flag_function(
          "--flip-y,!--no-flip-y", [this](std::int64_t count) { flip_y = count > 0; },
          "y of the landmarks, or of the points of INPUT, points up; --no-flip-y: down, as rows of an image [as their "
          "file says, else down]")
      ->group(kCoordinates);

  constexpr const char* kPicture = "Picture";
  const std::string more_picture = more(kPicture);
  only_known(add(kPicture, "--method", method, "pull (needs a map that does not fold), push, or auto", "NAME"),
             "method");
  add(more_picture.c_str(), "--over", over,
      "sheet on top where the map folds: least-stretched, first, label-order, or average", "NAME");
  add(kPicture, "--interpolation", interpolation,
      "nearest, linear, cubic or lanczos; label: for images of region numbers, of which it invents none", "NAME");
  only_known(
      add(more_picture.c_str(), "--border", border,
          "outside the image: transparent, constant (see --background), replicate or reflect; auto: transparent if "
          "the image has an alpha channel, else constant",
          "NAME"),
      "border");
  add(more_picture.c_str(), "--background", background,
      "what lies outside the image: a colour r,g,b of 0 to 255, or one value in the units of the image [white; of "
      "labels, floating-point images, mha and nrrd 0]",
      "COLOUR");
  add(more_picture.c_str(), "--supersampling", supersampling, "samples per pixel and axis of a push-forward, 1 to 8");
  add(more_picture.c_str(), "--tolerance", tolerance, "largest interpolation error of the map, pixels");
  add_max_pixels_option(verb, max_pixels)->group(more_picture);

  const auto add_files = [&](const char* group) {
    for (const FileOption& row : file_options())
      if (row.group == group) writes_file(add(group, row.name, this->*row.file, row.help));
  };
  add_files(kMoreResults);
  add_files(kMaps);
  verb.add_option("--grid-points", grid_points, "points of --field in 3D along its longest side [41]")->group(kMaps);
  verb.add_flag("--numbers", numbers, "numbers of the landmarks in --side-by-side")->group(more(kMoreResults));
  const std::string more_results = more(kMoreResults);
  add(more_results.c_str(), "--width", width, "width of drawings in mm [about 420]");
  add(more_results.c_str(), "--dpi", dpi, "pixels per inch of png drawings");
  add_read_options(verb, reading);
  add(kEnsembles, "--samples", samples, "number of samples of the noise, with the fitted momenta; OUT is their mean");
  add(kEnsembles, "--seed", seed, "seed of the random numbers");
  add_files(kEnsembles);
  add_threads_option(verb);
}

images::WarpMethod WarpArguments::warp_method() const {
  using images::WarpMethod;
  constexpr EnumNames<WarpMethod, 3> kMethods = {
      "method", {{{"auto", WarpMethod::kAuto}, {"pull", WarpMethod::kPull}, {"push", WarpMethod::kPush}}}};
  return kMethods.parse(method);
}

std::optional<std::pair<int, int>> WarpArguments::canvas() const {
  if (size.empty()) return std::nullopt;
  int columns = 0, rows = 0;
  const char* end = size.data() + size.size();
  const auto first = std::from_chars(size.data(), end, columns);
  const bool has_cross = first.ec == std::errc() && first.ptr < end && *first.ptr == 'x';
  const auto second = has_cross ? std::from_chars(first.ptr + 1, end, rows) : first;
  if (!has_cross || second.ec != std::errc() || second.ptr != end || columns < 1 || rows < 1)
    throw InputError(fmt::format("--size is '{}'; it must be width and height in pixels, as in 640x480", size));
  return std::pair(columns, rows);
}

std::optional<std::array<double, 2>> WarpArguments::origin_of_image() const { return parse_place("--origin", origin); }

std::optional<std::array<double, 2>> WarpArguments::origin_of_result() const {
  return target_origin.empty() ? origin_of_image() : parse_place("--target-origin", target_origin);
}

void WarpArguments::check() const {
  warp::parse_over(over);
  images::parse_interpolation(interpolation);
  if (border != "auto") images::parse_border(border);
  warp::parse_label_kernel(labels);
  warp_method();
  canvas();
  origin_of_image();
  origin_of_result();
  for (const auto& [name, value] : {std::pair("--pixel-size", pixel_size), {"--target-pixel-size", target_pixel_size}})
    if (value) require_positive(name, *value);
  require_positive("--tolerance", tolerance);
  if (samples < 0) throw InputError(fmt::format("--samples is {}; it must be positive", samples));
  if (samples == 0 && (!deviation.empty() || !fold_probability.empty()))
    throw InputError("--deviation and --fold-probability need --samples");
  if (samples > 0 && (!field.empty() || !holes.empty()))
    throw InputError("--field and --holes describe one map; they cannot be combined with --samples");
  if (samples > 0 && images::parse_interpolation(interpolation) == images::Interpolation::kLabel)
    throw InputError("--samples makes the mean of pictures, which labels do not have; warp them without it");
  if (inverse && !animate.empty())
    throw InputError("--animate shows the motion to the target; it cannot be combined with --inverse");
  if (grid_points && field.empty()) throw InputError("--grid-points needs --field");
  if (!like.empty() && !size.empty())
    throw InputError("--like and --size both set the size of the result; give one of them");
  if (!overlay.empty() && like.empty())
    throw InputError("--overlay shows the result over the target's image; give that with --like");
  check_picture_size(width, dpi);
  check_output_file(out);
  for (const FileOption& row : file_options())
    if (const std::string& file = this->*row.file; !file.empty()) row.check(file);
  if (!json.empty() && json != "-") check_output_file(json);
}

void WarpArguments::check_for_landmarks() const {
  const auto refuse = [&](const char* name) {
    throw InputError(fmt::format("{} is for images, and {} holds landmarks", name, input));
  };
  for (const FileOption& row : file_options())
    if (row.of_images && !(this->*row.file).empty()) refuse(row.name);
  for (const auto& [name, is_given] : {std::pair("--samples", samples > 0),
                                       {"--like", !like.empty()},
                                       {"--size", !size.empty()},
                                       {"--pixel-size", pixel_size.has_value()},
                                       {"--target-pixel-size", target_pixel_size.has_value()},
                                       {"--origin", !origin.empty()},
                                       {"--target-origin", !target_origin.empty()}})
    if (is_given) refuse(name);
  check_points_output(formats::file_of_address(input), out);
}

void WarpArguments::check_for_fold() const {
  for (const FileOption& row : file_options())
    if (inverse && row.needs_inverse && !(this->*row.file).empty())
      throw InputError(fmt::format(
          "{} with --inverse needs a map that has an inverse; here the noise moves landmarks individually", row.name));
}

}  // namespace pulson
