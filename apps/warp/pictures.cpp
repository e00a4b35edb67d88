#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "images/colour_maps.hpp"
#include "images/compose.hpp"
#include "images/drawing.hpp"

namespace pulson {
namespace {

using Eigen::Index;

constexpr int kGridLines = 24;  // along the longer side
constexpr int kGap = 12;
constexpr Colour kGridColour{0, 150, 255, 150};
constexpr Colour kPathColour{255, 120, 0, 220};
constexpr Colour kRimColour{255, 255, 255, 255};

// Lines and dots grow with the picture: 1 at 600 pixels.
double unit_of(const Image& image) { return std::max(1.0, std::max(image.width(), image.height()) / 600.0); }

std::vector<Points> moved(const std::vector<Points>& lines, const std::function<Points(const Points&)>& map) {
  Index count = 0;
  for (const Points& line : lines) count += line.cols();
  Points all(2, count);
  Index at = 0;
  for (const Points& line : lines) {
    all.middleCols(at, line.cols()) = line;
    at += line.cols();
  }
  const Points places = map(all);
  std::vector<Points> result;
  at = 0;
  for (const Points& line : lines) {
    result.emplace_back(places.middleCols(at, line.cols()));
    at += line.cols();
  }
  return result;
}

Image with_grid(const Image& image, const std::vector<Points>& lines) {
  const LineStyle style{kGridColour, static_cast<int>(std::lround(unit_of(image)))};
  return blend_lines(image, lines, style);
}

Image overlay(const Image& image, const WarpedImage& result, const ImageWarp& warp, const WarpArguments& arguments) {
  const std::vector<Points> lines = moved(grid_lines(image.width(), image.height()), [&](const Points& pixels) {
    return arguments.inverse ? warp.backward(pixels).places : warp.forward(pixels).places;
  });
  Image gridded = with_grid(for_show(result.image), lines);
  if (arguments.inverse) return gridded;
  const std::vector<Points> paths = warp.landmark_paths();
  return with_landmarks(gridded, paths, paths.size() - 1, unit_of(gridded));
}

// Pictures of numbers, and the keys to their colours.
class NumberPictures {
 public:
  void write(const std::string& path, const std::vector<float>& values, int width, int height, const PixelFrame& frame,
             const DivergingScale& scale) {
    write_numbers(path, values, width, height, frame, diverging(values, width, height, scale));
    const std::string mark = scale.marked_below ? fmt::format(", yellow below {:g}", *scale.marked_below) : "";
    add(path, fmt::format("blue {:g}, white {:g}, red {:g}{}", scale.centre - scale.reach, scale.centre,
                          scale.centre + scale.reach, mark));
  }

  void write(const std::string& path, const std::vector<float>& values, int width, int height, const PixelFrame& frame,
             double most) {
    write_numbers(path, values, width, height, frame, viridis(values, width, height, 0, most));
    add(path, fmt::format("violet 0, teal {:.3g}, yellow {:.3g}", most / 2, most));
  }

  std::vector<ColourKey> keys() && { return std::move(keys_); }

 private:
  void add(const std::string& path, std::string meaning) {
    if (!holds_numbers(path)) keys_.push_back({path, std::move(meaning)});
  }

  std::vector<ColourKey> keys_;
};

void write_jacobians(const Image& image, const ImageWarp& warp, const WarpFrames& frames,
                     const WarpArguments& arguments, NumberPictures& pictures) {
  const std::vector<float> jacobians = jacobians_on_image(image, warp, arguments);
  const int width = image.width(), height = image.height();
  if (!arguments.jacobian.empty())
    pictures.write(arguments.jacobian, jacobians, width, height, frames.input,
                   DivergingScale{.centre = 1, .reach = 1, .marked_below = 0.0});
  if (!arguments.log_jacobian.empty()) {
    std::vector<float> logarithms(jacobians.size());
    std::transform(jacobians.begin(), jacobians.end(), logarithms.begin(), [](float j) { return std::log2(j); });
    pictures.write(arguments.log_jacobian, logarithms, width, height, frames.input,
                   DivergingScale{.centre = 0, .reach = 2});
  }
  if (!arguments.folds.empty()) {
    std::vector<bool> folded(jacobians.size());
    std::transform(jacobians.begin(), jacobians.end(), folded.begin(), [](float j) { return j <= 0; });
    write_mask(arguments.folds, folded, width, height);
  }
}

void write_statistics(const Image& image, const WarpedImage& result, const WarpFrames& frames,
                      const WarpArguments& arguments, NumberPictures& pictures) {
  if (!arguments.deviation.empty()) {
    const float most = *std::max_element(result.deviations.begin(), result.deviations.end());
    pictures.write(arguments.deviation, result.deviations, frames.width, frames.height, frames.result,
                   most > 0 ? most : 1.0);
  }
  if (!arguments.fold_probability.empty())
    pictures.write(arguments.fold_probability, result.fold_probabilities, image.width(), image.height(), frames.input,
                   1.0);
}

}  // namespace

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

Image with_landmarks(const Image& image, const std::vector<Points>& paths, std::size_t k, double scale) {
  std::vector<Points> lines;
  for (Index a = 0; a < paths.front().cols(); ++a) {
    Points line(2, static_cast<Index>(k) + 1);
    for (std::size_t i = 0; i <= k; ++i) line.col(static_cast<Index>(i)) = paths[i].col(a);
    lines.push_back(std::move(line));
  }
  const Image drawn = blend_lines(image, lines, {kPathColour, static_cast<int>(std::lround(scale))});
  return blend_dots(blend_dots(drawn, paths[k], 3.5 * scale, kRimColour), paths[k], 2.5 * scale, kPathColour);
}

std::vector<ColourKey> write_more_results(const Image& image, const WarpedImage& result, const ImageWarp& warp,
                                          const WarpFrames& frames, const WarpArguments& arguments) {
  NumberPictures pictures;
  write_statistics(image, result, frames, arguments, pictures);
  if (!arguments.field.empty())
    write_displacements(arguments.field, result.displacements, result.pulled ? frames.width : image.width(),
                        result.pulled ? frames.height : image.height(), result.pulled ? frames.result : frames.input);
  if (!arguments.jacobian.empty() || !arguments.log_jacobian.empty() || !arguments.folds.empty())
    write_jacobians(image, warp, frames, arguments, pictures);
  if (!arguments.multiplicity.empty()) {
    const std::vector<float> counts(result.multiplicity.begin(), result.multiplicity.end());
    pictures.write(arguments.multiplicity, counts, frames.width, frames.height, frames.result,
                   std::max(3.0, static_cast<double>(result.figures.max_multiplicity)));
  }
  if (!arguments.holes.empty()) write_mask(arguments.holes, result.holes, frames.width, frames.height);
  if (!arguments.grid.empty()) write_picture(arguments.grid, overlay(image, result, warp, arguments), frames.result);
  if (!arguments.side_by_side.empty()) {
    std::vector<Image> images{with_grid(for_show(image), grid_lines(image.width(), image.height())),
                              overlay(image, result, warp, arguments)};
    if (frames.like) images.push_back(for_show(frames.like->image));
    write_picture(arguments.side_by_side, side_by_side(images, kGap), {});
  }
  return std::move(pictures).keys();
}

}  // namespace pulson
