#include <charconv>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "jobs.hpp"

namespace pulson {
namespace {

[[noreturn]] void refuse_background(const WarpArguments& arguments, double full) {
  throw InputError(
      fmt::format("--background is '{}'; it must be three numbers of 0 to 255, as in 255,255,255, or one value of the "
                  "image{}",
                  arguments.background, full > 1 ? fmt::format(", 0 to {}", full) : std::string()));
}

// The numbers of --background, one or three.
std::vector<double> background_numbers(const WarpArguments& arguments, double full) {
  std::vector<double> numbers;
  const char* at = arguments.background.data();
  const char* const end = at + arguments.background.size();
  for (;; ++at) {
    const auto number = std::from_chars(at, end, numbers.emplace_back());
    at = number.ptr;
    if (number.ec != std::errc() || !std::isfinite(numbers.back()) || (at != end && *at != ','))
      refuse_background(arguments, full);
    if (at == end) break;
  }
  const double most = numbers.size() > 1 ? 255 : full;
  const bool is_brightness = numbers.size() > 1 || full > 1;
  for (const double number : numbers)
    if (is_brightness && !(number >= 0 && number <= most)) refuse_background(arguments, full);
  if (numbers.size() != 1 && numbers.size() != 3) refuse_background(arguments, full);
  return numbers;
}

// Numbers that are not brightness: 0 is a better background than white.
bool has_measurements(const WarpArguments& arguments, const images::Image& image) {
  return image.type() == images::PixelType::kFloat32 || is_grid_file(arguments.input) ||
         images::parse_interpolation(arguments.interpolation) == images::Interpolation::kLabel;
}

// In units and order of the image's channels, opaque.
std::array<double, 4> fill_of(const WarpArguments& arguments, const images::Image& image) {
  const double full = full_value(image.type());
  std::array<double, 4> fill{};
  if (!arguments.background.empty()) {
    const std::vector<double> numbers = background_numbers(arguments, full);
    for (std::size_t c = 0; c < 3; ++c) fill[c] = numbers.size() == 1 ? numbers[0] : numbers[c] * full / 255;
  } else if (!has_measurements(arguments, image)) {
    fill.fill(full);
  }
  fill[image.channels() == 2 ? 1 : 3] = full;
  return fill;
}

bool is_transparent(const WarpArguments& arguments, const images::Image& image) {
  const bool is_asked = arguments.border == "transparent" || (arguments.border == "auto" && image.has_alpha());
  return is_asked && arguments.background.empty() && keeps_alpha(arguments.out);
}

images::Border border_of(const WarpArguments& arguments, const images::Image& image) {
  if (is_transparent(arguments, image)) return images::Border::kTransparent;
  if (arguments.border == "auto" || arguments.border == "transparent") return images::Border::kConstant;
  return images::parse_border(arguments.border);
}

}  // namespace

images::WarpImageOptions warp_options(const WarpArguments& arguments, const WarpFrames& frames,
                                      const images::Image& image) {
  return {.width = frames.width,
          .height = frames.height,
          .method = arguments.warp_method(),
          .inverse = arguments.inverse,
          .interpolation = images::parse_interpolation(arguments.interpolation),
          .border = border_of(arguments, image),
          .fill = fill_of(arguments, image),
          .over = warp::parse_over(arguments.over),
          .label_ranks = frames.label_ranks,
          .supersampling = arguments.supersampling,
          .tolerance = arguments.tolerance,
          .with_displacements = !arguments.field.empty(),
          .max_pixels = arguments.max_pixels};
}

}  // namespace pulson
