#include "arguments.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "draw/animation.hpp"
#include "picture_files.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

std::optional<std::array<double, 2>> place(const char* name, const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::array<double, 2> numbers{};
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, numbers[0]);
  const bool has_comma = first.ec == std::errc() && first.ptr < end && *first.ptr == ',';
  const auto second = has_comma ? std::from_chars(first.ptr + 1, end, numbers[1]) : first;
  if (!has_comma || second.ec != std::errc() || second.ptr != end || !std::isfinite(numbers[0]) ||
      !std::isfinite(numbers[1]))
    throw InputError(fmt::format("{} is '{}'; it must be two numbers, as in -2,-1.5", name, text));
  return numbers;
}

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

// Files of one number a pixel, or its colour.
void check_numbers_file(const std::string& file) {
  check_picture_file(file);
  if (!keeps_alpha(file) && !is_grid_file(file))
    throw InputError(fmt::format("{}: numbers are written as .png (colours), .tif, .mha or .nrrd", file));
}

}  // namespace

WarpMethod WarpArguments::warp_method() const {
  constexpr EnumNames<WarpMethod, 3> kMethods = {
      "method", {{{"auto", WarpMethod::kAuto}, {"pull", WarpMethod::kPull}, {"push", WarpMethod::kPush}}}};
  return kMethods.parse(method);
}

std::optional<std::pair<int, int>> WarpArguments::canvas() const {
  if (size.empty()) return std::nullopt;
  int width = 0, height = 0;
  const char* end = size.data() + size.size();
  const auto first = std::from_chars(size.data(), end, width);
  const bool has_cross = first.ec == std::errc() && first.ptr < end && *first.ptr == 'x';
  const auto second = has_cross ? std::from_chars(first.ptr + 1, end, height) : first;
  if (!has_cross || second.ec != std::errc() || second.ptr != end || width < 1 || height < 1)
    throw InputError(fmt::format("--size is '{}'; it must be width and height in pixels, as in 640x480", size));
  return std::pair(width, height);
}

std::optional<std::array<double, 2>> WarpArguments::origin_of_image() const { return place("--origin", origin); }

std::optional<std::array<double, 2>> WarpArguments::origin_of_result() const {
  return target_origin.empty() ? origin_of_image() : place("--target-origin", target_origin);
}

std::vector<std::string> WarpArguments::outputs() const {
  return {out,   field, json, jacobian,     log_jacobian, multiplicity, deviation, fold_probability,
          folds, holes, grid, side_by_side, animate};
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
  for (const std::string& file : {jacobian, log_jacobian, multiplicity, deviation, fold_probability})
    if (!file.empty()) check_numbers_file(file);
  for (const std::string& file : {folds, holes, grid, side_by_side})
    if (!file.empty()) check_drawing_file(file);
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
  for (const auto& [name, file] : {std::pair("--jacobian", jacobian),
                                   {"--log-jacobian", log_jacobian},
                                   {"--folds", folds},
                                   {"--grid", grid},
                                   {"--side-by-side", side_by_side}})
    if (!file.empty())
      throw InputError(fmt::format(
          "{} with --inverse needs a map that has an inverse; here the noise moves landmarks individually", name));
}

}  // namespace pulson
