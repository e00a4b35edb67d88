#include "arguments.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "draw/animation.hpp"
#include "draw/gnuplot.hpp"
#include "drawings.hpp"
#include "picture_files.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"

namespace pulson {
namespace {

// Whether the two names are of one file that is there.
bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return !a.empty() && !b.empty() && std::filesystem::equivalent(a, b, error) && !error;
}

// Files that are drawings or masks, of which grids hold none, and formats without alpha no drawing.
void check_drawing_file(const std::string& file) {
  check_picture_file(file);
  if (!keeps_alpha(file)) throw InputError(fmt::format("{}: drawings and masks are written as .png or .tif", file));
}

// Drawings with captions.
void check_captioned_file(const std::string& file) {
  if (!is_drawing_file(file)) throw InputError(fmt::format("{}: it is drawn as .png, .svg or .pdf", file));
  check_output_file(file);
  if (!Gnuplot::is_installed())
    throw InputError(fmt::format("{} needs gnuplot; install it (Debian: gnuplot-nox)", file));
}

// Files of one number a pixel, or its colour.
void check_numbers_file(const std::string& file) {
  if (is_drawing_file(file)) return check_captioned_file(file);
  check_picture_file(file);
  if (!holds_numbers(file))
    throw InputError(fmt::format("{}: numbers are written as .png, .svg, .pdf (colours), .tif, .mha or .nrrd", file));
}

}  // namespace

WarpMethod WarpArguments::warp_method() const {
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

std::vector<std::string> WarpArguments::outputs() const {
  return {out,   field, json, jacobian,     log_jacobian, multiplicity, deviation, fold_probability,
          folds, holes, grid, side_by_side, overlay,      displacement, animate,   report};
}

void WarpArguments::check() const {
  parse_over(over);
  parse_interpolation(interpolation);
  if (border != "auto") parse_border(border);
  parse_label_kernel(labels);
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
  if (samples > 0 && parse_interpolation(interpolation) == Interpolation::kLabel)
    throw InputError("--samples makes the mean of pictures, which labels do not have; warp them without it");
  if (inverse && !animate.empty())
    throw InputError("--animate shows the motion to the target; it cannot be combined with --inverse");
  if (!like.empty() && !size.empty())
    throw InputError("--like and --size both set the size of the result; give one of them");
  if (!overlay.empty() && like.empty())
    throw InputError("--overlay shows the result over the target's image; give that with --like");
  for (const std::string& file : {jacobian, log_jacobian, multiplicity, deviation, fold_probability, displacement})
    if (!file.empty()) check_numbers_file(file);
  for (const std::string& file : {folds, holes, grid})
    if (!file.empty()) check_drawing_file(file);
  for (const std::string& file : {side_by_side, overlay})
    if (!file.empty()) check_captioned_file(file);
  check_picture_size(width, dpi);
  if (!report.empty()) check_output_file(report);
  for (const std::string& file : {out, field, animate})
    if (!file.empty()) check_output_file(file);
  for (const std::string& file : outputs())
    for (const std::string& read : {input, like, registration})
      if (is_same_file(file, read))
        throw InputError(fmt::format("'{}' is an input; the result needs another name", file));
  if (!json.empty() && json != "-") check_output_file(json);
  if (!field.empty() && !is_grid_file(field))
    throw InputError(fmt::format("{}: displacement fields are written as .mha or .nrrd", field));
  if (!animate.empty() && !Animation::available())
    throw InputError("--animate needs ffmpeg; install it, or leave the animation out");
  if (!animate.empty()) Animation(animate, 2, 2, 1);  // refuses what it cannot write
}

void WarpArguments::check_for_landmarks() const {
  for (const auto& [name, file] : {std::pair("--field", field),
                                   {"--jacobian", jacobian},
                                   {"--log-jacobian", log_jacobian},
                                   {"--multiplicity", multiplicity},
                                   {"--folds", folds},
                                   {"--holes", holes},
                                   {"--grid", grid},
                                   {"--side-by-side", side_by_side},
                                   {"--overlay", overlay},
                                   {"--displacement", displacement},
                                   {"--animate", animate}})
    if (!file.empty()) throw InputError(fmt::format("{} is for images, and {} holds landmarks", name, input));
  for (const auto& [name, is_given] : {std::pair("--samples", samples > 0),
                                       {"--like", !like.empty()},
                                       {"--size", !size.empty()},
                                       {"--pixel-size", pixel_size.has_value()},
                                       {"--target-pixel-size", target_pixel_size.has_value()},
                                       {"--origin", !origin.empty()},
                                       {"--target-origin", !target_origin.empty()},
                                       {"--flip-y", flip_y.has_value()}})
    if (is_given) throw InputError(fmt::format("{} is for images, and {} holds landmarks", name, input));
  landmark_format_to_write(out);
}

void WarpArguments::check_for_fold() const {
  if (!inverse) return;
  if (!report.empty())
    throw InputError(
        "--report with --inverse needs a map that has an inverse; here the noise moves landmarks individually");
  for (const auto& [name, file] : {std::pair("--jacobian", jacobian),
                                   {"--log-jacobian", log_jacobian},
                                   {"--folds", folds},
                                   {"--grid", grid},
                                   {"--displacement", displacement},
                                   {"--side-by-side", side_by_side}})
    if (!file.empty())
      throw InputError(fmt::format(
          "{} with --inverse needs a map that has an inverse; here the noise moves landmarks individually", name));
}

}  // namespace pulson
