#include "pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "drawings.hpp"
#include "images/colour_maps.hpp"
#include "images/compose.hpp"
#include "register/picture.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using Eigen::Index;

constexpr int kGridLines = 24;  // along the longer side
constexpr images::Colour kGridColour{0, 150, 255, 150};
constexpr images::Colour kPathColour{255, 120, 0, 220};
constexpr images::Colour kRimColour{255, 255, 255, 200};
constexpr images::Colour kRingColour{33, 105, 210, 255};

// Lines and dots grow with the picture: 1 at 600 pixels.
double unit_of(const images::Image& image) { return std::max(1.0, std::max(image.width(), image.height()) / 600.0); }

images::Image overlay(const images::Image& image, const WarpResult& result, const images::ImageWarp& warp,
                      const WarpArguments& arguments) {
  const std::vector<Points> lines = moved_grid(image, warp, arguments.inverse);
  const images::Image shown = for_show(result.image);
  images::Image gridded = blend_lines(shown, lines, {kGridColour, static_cast<int>(std::lround(unit_of(shown)))});
  if (arguments.inverse) return gridded;
  const std::vector<Points> paths = warp.landmark_paths();
  return with_landmarks(gridded, paths, paths.size() - 1, unit_of(gridded));
}

// "violet 0, blue 1": the colours of the counts that occur; of many, of the first and the last.
std::string counts_in_colours(const std::vector<float>& counts, double most) {
  constexpr std::array kNames = {"violet", "blue", "teal", "green", "yellow"};
  constexpr std::size_t kMostListed = 5;
  const std::set<float> occurring(counts.begin(), counts.end());
  const auto name = [&](float count) {
    return fmt::format("{} {:g}", kNames.at(static_cast<std::size_t>(std::lround(4 * count / most))), count);
  };
  if (occurring.size() > kMostListed)
    return fmt::format("{} to {}", name(*occurring.begin()), name(*occurring.rbegin()));
  std::vector<std::string> texts;
  for (const float count : occurring) texts.push_back(name(count));
  return fmt::format("{}", fmt::join(texts, ", "));
}

// Pictures of numbers, and the keys to their colours.
class NumberPictures {
 public:
  explicit NumberPictures(const WarpArguments& arguments) : drawings_(arguments) {}

  struct What {
    const std::string& file;
    std::string heading;
    const std::vector<float>& values;
    int width, height;
    const Frame& frame;
    Points landmarks;  // in pixels
  };

  void write(What what, const images::DivergingScale& scale) {
    const bool ends_at_mark = scale.marked_below == scale.centre - scale.reach;
    const std::string mark = ends_at_mark         ? fmt::format(", yellow below {:g}", *scale.marked_below)
                             : scale.marked_below ? ", yellow folds"
                                                  : "";
    const draw::ColourBar bar = bar_of(scale, what.values);
    write(
        std::move(what), [&](const What& of) { return diverging(of.values, of.width, of.height, scale); }, bar,
        fmt::format("blue {:g}, white {:g}, red {:g}{}", scale.centre - scale.reach, scale.centre,
                    scale.centre + scale.reach, mark));
  }

  void write(What what, double most, bool whole = false) {
    const draw::ColourBar bar = whole ? bar_of_counts(most, what.values) : bar_of(most);
    const std::string meaning = whole ? counts_in_colours(what.values, most)
                                      : fmt::format("violet 0, teal {:.3g}, yellow {:.3g}", most / 2, most);
    write(
        std::move(what), [&](const What& of) { return images::viridis(of.values, of.width, of.height, 0, most); }, bar,
        meaning);
  }

  std::vector<ColourKey> keys() && { return std::move(keys_); }

 private:
  template <class Colours>
  void write(What what, const Colours& colours, draw::ColourBar bar, std::string meaning) {
    if (holds_numbers(what.file)) {
      write_picture(what.file, images::Image(what.width, what.height, 1, std::span<const float>(what.values)),
                    what.frame);
      return;
    }
    drawings_.write(drawings_.numbers({what.heading, colours(what), std::move(bar), what.width, what.height,
                                       std::move(what.landmarks)}),
                    what.file);
    keys_.push_back({what.file, std::move(meaning)});
  }

  Drawings drawings_;
  std::vector<ColourKey> keys_;
};

double largest(const std::vector<float>& values) {
  double most = 0;
  for (const float value : values)
    if (std::isfinite(value)) most = std::max<double>(most, value);
  return most > 0 ? most : 1;
}

void write_jacobians(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                     const WarpArguments& arguments, NumberPictures& pictures) {
  const std::vector<float> jacobians =
      jacobians_on_image(image, warp, {.inverse = arguments.inverse, .tolerance = arguments.tolerance});
  const int width = image.width(), height = image.height();
  const Points landmarks = landmarks_on_image(warp, arguments);
  try_to_write(arguments.jacobian, [&] {
    pictures.write({arguments.jacobian, kJacobianHeading, jacobians, width, height, frames.input, landmarks},
                   kJacobianScale);
  });
  try_to_write(arguments.log_jacobian, [&] {
    std::vector<float> logarithms(jacobians.size());
    const float of_folds =
        holds_numbers(arguments.log_jacobian) ? std::nanf("") : -std::numeric_limits<float>::infinity();
    std::transform(jacobians.begin(), jacobians.end(), logarithms.begin(),
                   [&](float j) { return warp::is_fold(j) ? of_folds : std::log2(j); });
    pictures.write({arguments.log_jacobian, "Logarithm to base 2 of the Jacobian determinant", logarithms, width,
                    height, frames.input, landmarks},
                   kLogJacobianScale);
  });
  try_to_write(arguments.folds, [&] {
    std::vector<bool> folded(jacobians.size());
    std::transform(jacobians.begin(), jacobians.end(), folded.begin(), [](float j) { return warp::is_fold(j); });
    write_mask(arguments.folds, folded, width, height);
  });
}

void write_statistics(const images::Image& image, const WarpResult& result, const WarpFrames& frames,
                      const WarpArguments& arguments, NumberPictures& pictures) {
  try_to_write(arguments.deviation, [&] {
    pictures.write({arguments.deviation, "Standard deviation of each pixel over the samples, units of the image",
                    result.deviations, frames.width, frames.height, frames.result, Points(2, 0)},
                   largest(result.deviations));
  });
  try_to_write(arguments.fold_probability, [&] {
    pictures.write({arguments.fold_probability, "Probability that the map folds at a pixel of the image",
                    result.fold_probabilities, image.width(), image.height(), frames.input, Points(2, 0)},
                   1.0);
  });
}

void write_numbers_of_pixels(const images::Image& image, const WarpResult& result, const images::ImageWarp& warp,
                             const WarpFrames& frames, const WarpArguments& arguments, NumberPictures& pictures) {
  write_statistics(image, result, frames, arguments, pictures);
  const std::string& of_jacobians = !arguments.jacobian.empty()       ? arguments.jacobian
                                    : !arguments.log_jacobian.empty() ? arguments.log_jacobian
                                                                      : arguments.folds;
  try_to_write(of_jacobians, [&] { write_jacobians(image, warp, frames, arguments, pictures); });
  try_to_write(arguments.displacement, [&] {
    const std::vector<float> lengths =
        displacements_on_image(image, warp, {.inverse = arguments.inverse, .tolerance = arguments.tolerance});
    pictures.write({arguments.displacement, "Displacement after the alignment, landmark units", lengths, image.width(),
                    image.height(), frames.input, landmarks_on_image(warp, arguments)},
                   largest(lengths));
  });
  try_to_write(arguments.multiplicity, [&] {
    const std::vector<float> counts(result.multiplicity.begin(), result.multiplicity.end());
    pictures.write({arguments.multiplicity, "Number of points of the image that land on each pixel", counts,
                    frames.width, frames.height, frames.result, Points(2, 0)},
                   std::max(3.0, static_cast<double>(result.figures.max_multiplicity)), true);
  });
}

}  // namespace

std::vector<Points> moved_grid(const images::Image& image, const images::ImageWarp& warp, bool inverse) {
  const std::vector<Points> lines = grid_lines(image.width(), image.height());
  const Points pixels = joined_lines(lines);
  return split_lines(inverse ? warp.backward(pixels).places : warp.forward(pixels).places, lines);
}

std::vector<Points> grid_lines(int width, int height) {
  const double spacing = std::max(4.0, std::max(width, height) / static_cast<double>(kGridLines));
  const double step = std::max(1.0, spacing / 8);
  std::vector<Points> lines;
  for (const bool across : {false, true}) {
    const double length = across ? width - 1 : height - 1;
    const double extent = across ? height - 1 : width - 1;
    const auto vertices = static_cast<Index>(std::ceil(length / step)) + 1;
    for (double at = std::fmod(extent, spacing) / 2; at <= extent; at += spacing) {
      Points line(2, vertices);
      line.row(across ? 0 : 1) = Eigen::RowVectorXd::LinSpaced(vertices, 0, length);
      line.row(across ? 1 : 0).setConstant(at);
      lines.push_back(std::move(line));
    }
  }
  return lines;
}

images::Image with_landmarks(const images::Image& image, const std::vector<Points>& paths, std::size_t k,
                             double scale) {
  std::vector<Points> lines;
  for (Index a = 0; a < paths.front().cols(); ++a) {
    Points line(2, static_cast<Index>(k) + 1);
    for (std::size_t i = 0; i <= k; ++i) line.col(static_cast<Index>(i)) = paths[i].col(a);
    lines.push_back(std::move(line));
  }
  const images::Image drawn = blend_lines(image, lines, {kPathColour, static_cast<int>(std::lround(scale))});
  const int width = static_cast<int>(std::lround(scale));
  const images::Image rimmed = blend_rings(drawn, paths[k], 4.5 * scale, {kRimColour, 2 * width});
  return blend_rings(rimmed, paths[k], 4.5 * scale, {kRingColour, width});
}

Points landmarks_on_image(const images::ImageWarp& warp, const WarpArguments& arguments) {
  return arguments.inverse ? warp.landmark_paths().back() : warp.label_pixels();
}

void write_field(const std::string& file, const images::WarpedImage& result, const images::Image& image,
                 const WarpFrames& frames) {
  if (result.pulled)
    write_displacements(file, result.displacements, frames.width, frames.height, frames.result);
  else
    write_displacements(file, result.displacements, image.width(), image.height(), frames.input);
}

void try_to_write(const std::string& file, const std::function<void()>& write) {
  if (file.empty()) return;
  std::string reason = "interrupted";
  try {
    if (!Interrupt::came()) return write();
  } catch (const std::bad_alloc&) {
    reason = "out of memory";
  } catch (const std::exception& error) {
    reason = error.what();
  }
  print_warning(fmt::format("{} was not written: {}", file, reason));
}

std::vector<ColourKey> write_more_results(const images::Image& image, const WarpResult& result,
                                          const images::ImageWarp& warp, const WarpFrames& frames,
                                          const WarpArguments& arguments) {
  NumberPictures pictures(arguments);
  write_numbers_of_pixels(image, result, warp, frames, arguments, pictures);
  try_to_write(arguments.holes, [&] { write_mask(arguments.holes, result.holes, frames.width, frames.height); });
  try_to_write(arguments.grid,
               [&] { write_picture(arguments.grid, overlay(image, result, warp, arguments), frames.result); });
  const Drawings drawings(arguments);
  try_to_write(arguments.side_by_side,
               [&] { drawings.write(drawings.side_by_side(image, result, warp, frames), arguments.side_by_side); });
  try_to_write(arguments.overlay, [&] { drawings.write(drawings.overlay(result, frames), arguments.overlay); });
  return std::move(pictures).keys();
}

}  // namespace pulson
