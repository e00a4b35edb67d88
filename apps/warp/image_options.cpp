#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
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

double least_value(images::PixelType type) {
  double least = 0;
  with_number_type(type, [&]<class Value>() { least = static_cast<double>(std::numeric_limits<Value>::lowest()); });
  return least;
}

// The numbers of --background, one or three. @param least that a pixel may have
std::vector<double> background_numbers(const WarpArguments& arguments, double least, double full) {
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
    if (is_brightness && !(number >= (numbers.size() > 1 ? 0 : least) && number <= most))
      refuse_background(arguments, full);
  if (numbers.size() != 1 && numbers.size() != 3) refuse_background(arguments, full);
  return numbers;
}

// Numbers that are not brightness: 0 is a better background than white.
bool has_measurements(const WarpArguments& arguments, const images::Page& page) {
  const bool is_brightness =
      page.image.type() == images::PixelType::kUint8 || page.image.type() == images::PixelType::kUint16;
  return !is_brightness || page.about.has_palette() || is_grid_file(arguments.input) ||
         images::parse_interpolation(arguments.interpolation) == images::Interpolation::kLabel;
}

// The number of the colour of a palette that is nearest; colours of 0 to 255.
double nearest_colour(const images::PageMetadata& about, const std::vector<double>& colour) {
  constexpr double kTo16Bits = 257;
  double least = std::numeric_limits<double>::infinity();
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < about.palette.size(); ++i) {
    double squares = 0;
    for (std::size_t c = 0; c < 3; ++c) squares += std::pow(about.palette[i][c] - kTo16Bits * colour[c], 2);
    if (squares < least) least = squares, nearest = i;
  }
  return static_cast<double>(nearest);
}

// The number of the first transparent colour of a palette, or 0.
double clear_colour(const images::PageMetadata& about) {
  const auto clear =
      std::find_if(about.palette.begin(), about.palette.end(), [](auto& colour) { return colour[3] == 0; });
  return clear == about.palette.end() ? 0 : static_cast<double>(clear - about.palette.begin());
}

// In units and order of the page's channels, opaque.
std::vector<double> fill_of(const WarpArguments& arguments, const images::Page& page) {
  const images::PixelFormat& format = page.image.format();
  const double full = format.full;
  std::vector<double> fill(static_cast<std::size_t>(format.channels));
  const auto colours = static_cast<std::size_t>(format.colours());
  const bool is_dark = page.about.white_is_zero || page.about.is_cmyk;
  if (!arguments.background.empty()) {
    const std::vector<double> numbers = background_numbers(arguments, least_value(format.type), full);
    for (std::size_t c = 0; c < colours; ++c)
      fill[c] = numbers.size() == 1 ? numbers[0] : numbers[std::min<std::size_t>(c, 2)] * full / 255;
    if (numbers.size() == 3 && page.about.has_palette()) fill[0] = nearest_colour(page.about, numbers);
  } else if (page.about.has_palette()) {
    fill[0] = clear_colour(page.about);
  } else if (!has_measurements(arguments, page) && !is_dark) {
    std::fill(fill.begin(), fill.end(), full);
  }
  if (format.has_alpha()) fill.back() = full;
  return fill;
}

bool is_transparent(const WarpArguments& arguments, const images::Page& page) {
  const bool is_asked = arguments.border == "transparent" || (arguments.border == "auto" && page.image.has_alpha());
  return is_asked && arguments.background.empty() && keeps_alpha(arguments.out) && !page.about.has_palette();
}

images::Border border_of(const WarpArguments& arguments, const images::Page& page) {
  if (is_transparent(arguments, page)) return images::Border::kTransparent;
  if (arguments.border == "auto" || arguments.border == "transparent") return images::Border::kConstant;
  return images::parse_border(arguments.border);
}

// What has no means between its numbers is looked up as labels are.
images::Interpolation interpolation_of(const WarpArguments& arguments, const images::Page& page) {
  const images::Interpolation asked = images::parse_interpolation(arguments.interpolation);
  return page.about.has_palette() && asked != images::Interpolation::kNearest ? images::Interpolation::kLabel : asked;
}

}  // namespace

images::WarpImageOptions warp_options(const WarpArguments& arguments, const WarpFrames& frames,
                                      const images::Page& page) {
  return {.width = frames.width,
          .height = frames.height,
          .method = arguments.warp_method(),
          .inverse = arguments.inverse,
          .interpolation = interpolation_of(arguments, page),
          .border = border_of(arguments, page),
          .fill = fill_of(arguments, page),
          .over = warp::parse_over(arguments.over),
          .label_ranks = frames.label_ranks,
          .supersampling = arguments.supersampling,
          .tolerance = arguments.tolerance,
          .with_displacements = !arguments.field.empty(),
          .max_pixels = arguments.max_pixels};
}

}  // namespace pulson
