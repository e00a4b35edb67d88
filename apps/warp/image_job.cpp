#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "jobs.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace pulson {
namespace {

using Eigen::Index;

// The colour r,g,b of 0 to 255 in units of the image; the first for grey.
// White where none is given; but 0 for floating-point numbers, which are measurements rather than brightness.
std::array<double, 4> fill_of(const WarpArguments& arguments, const Image& image) {
  std::array<double, 4> fill{255, 255, 255, 255};
  if (image.depth() == PixelDepth::kFloat32) fill = {0, 0, 0, 255};
  const char* at = arguments.background.data();
  const char* end = at + arguments.background.size();
  for (std::size_t c = 0; c < 3 && !arguments.background.empty(); ++c) {
    const auto number = std::from_chars(at, end, fill[c]);
    const bool last = c == 2;
    if (number.ec != std::errc() || (last ? number.ptr != end : number.ptr == end || *number.ptr != ',') ||
        !(fill[c] >= 0 && fill[c] <= 255))
      throw InputError(fmt::format("--background is '{}'; it must be three numbers of 0 to 255, as in 255,255,255",
                                   arguments.background));
    at = number.ptr + 1;
  }
  for (double& value : fill) value *= full_value(image.depth()) / 255;
  if (image.channels() == 2) fill[1] = fill[3];
  return fill;
}

bool is_transparent(const WarpArguments& arguments) {
  return arguments.border == "transparent" && arguments.background.empty() && keeps_alpha(arguments.out);
}

RemapOptions remap_options(const WarpArguments& arguments, const Image& image) {
  RemapOptions options{parse_interpolation(arguments.interpolation), parse_border(arguments.border),
                       fill_of(arguments, image)};
  if (options.border == Border::kTransparent && !is_transparent(arguments)) options.border = Border::kConstant;
  return options;
}

bool is_outside(const std::array<float, 2>& place, const Image& image) {
  return !(place[0] >= -0.5F && place[1] >= -0.5F && place[0] <= static_cast<float>(image.width()) - 0.5F &&
           place[1] <= static_cast<float>(image.height()) - 0.5F);
}

// From pixel positions of one frame, in the order of a SampledMap, to places in another: in landmark units.
std::vector<float> displacements_of(const SampledMap& map, const PixelFrame& from, const PixelFrame& to) {
  const auto count = static_cast<Index>(map.places.size());
  Points pixels(2, count), places(2, count);
  for (Index i = 0; i < count; ++i) {
    const Index row = i / map.columns;
    pixels.col(i) << static_cast<double>(i - row * map.columns), static_cast<double>(row);
    const auto& [x, y] = map.places[static_cast<std::size_t>(i)];
    places.col(i) << x, y;
  }
  const Eigen::MatrixXf difference = (to.to_landmarks(places) - from.to_landmarks(pixels)).cast<float>();
  return {difference.data(), difference.data() + difference.size()};
}

WarpedImage pull(const Image& image, const ImageWarp& warp, const WarpFrames& frames, const WarpArguments& arguments) {
  const PlaneMap map = [&](const Points& pixels) {
    return arguments.inverse ? warp.forward(pixels) : warp.backward(pixels);
  };
  SampledMap sampled = sample_map(map, {frames.width, frames.height, 0}, arguments.tolerance, true);
  WarpedImage result;
  result.pulled = true;
  WarpFigures& figures = result.figures;
  figures.method = "pull";
  figures.map_error = sampled.error;
  if (warp.orientation() < 0)
    for (float& jacobian : sampled.jacobians) jacobian = -jacobian;
  const auto [least, most] = std::minmax_element(sampled.jacobians.begin(), sampled.jacobians.end());
  // Of the map that moves the source. Where the map is flipped its inverse has no value, which the sign shows.
  figures.min_jacobian = arguments.inverse || *least <= 0 ? *least : 1.0 / *most;
  const auto folded = std::count_if(sampled.jacobians.begin(), sampled.jacobians.end(), [](float j) { return j <= 0; });
  const auto all = static_cast<double>(sampled.jacobians.size());
  figures.folded_fraction = static_cast<double>(folded) / all;
  if (!arguments.field.empty()) result.displacements = displacements_of(sampled, frames.result, frames.input);
  std::int64_t outside = 0;
  for (const auto& place : sampled.places) {
    const bool out = is_outside(place, image);
    outside += out ? 1 : 0;
    result.multiplicity.push_back(out ? 0 : 1);
  }
  figures.uncovered_fraction = static_cast<double>(outside) / all;
  figures.max_multiplicity = outside < std::ssize(sampled.places) ? 1 : 0;
  result.holes.resize(sampled.places.size());
  result.image =
      remap(image, {frames.width, frames.height, std::move(sampled.places)}, remap_options(arguments, image));
  return result;
}

WarpedImage push(const Image& image, const ImageWarp& warp, const WarpFrames& frames, const WarpArguments& arguments) {
  PushedMesh mesh = push_image(image, warp, frames, arguments);
  WarpedImage result;
  WarpFigures& figures = result.figures;
  figures.method = "push";
  figures.map_error = mesh.map_error;
  figures.min_jacobian = mesh.min_jacobian;
  figures.folded_fraction = mesh.folds.folded_fraction;
  figures.max_multiplicity = mesh.pushed.coverage.max_multiplicity;
  figures.uncovered_fraction = mesh.pushed.coverage.uncovered_fraction();
  result.holes = enclosed(mesh.pushed.uncovered, frames.width, frames.height);
  figures.hole_fraction = static_cast<double>(std::count(result.holes.begin(), result.holes.end(), true)) /
                          static_cast<double>(result.holes.size());
  result.multiplicity = std::move(mesh.pushed.multiplicity);
  result.image = std::move(mesh.pushed.image);
  if (!arguments.field.empty()) {
    const auto forward = [&](const Points& pixels) { return warp.forward(pixels); };
    result.displacements =
        displacements_of(sample_map(forward, {image.width(), image.height(), 0}, arguments.tolerance, false),
                         frames.input, frames.result);
  }
  return result;
}

}  // namespace

std::vector<float> label_order(const Image& image, const Points& landmarks, const std::vector<int>& ranks) {
  const double reach = median_nearest_distance(landmarks);
  std::vector<float> order(image.pixel_count());
  parallel_for(image.height(), [&](int y) {
    for (int x = 0; x < image.width(); ++x) {
      Index nearest = 0;
      const double squared = (landmarks.colwise() - Eigen::Vector2d(x, y)).colwise().squaredNorm().minCoeff(&nearest);
      const bool is_near = squared <= reach * reach;
      order[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(x)] =
          is_near ? static_cast<float>(ranks[static_cast<std::size_t>(nearest)]) : -1;
    }
  });
  return order;
}

PushedMesh push_image(const Image& image, const ImageWarp& warp, const WarpFrames& frames,
                      const WarpArguments& arguments) {
  const PlaneMap map = [&](const Points& pixels) { return warp.forward(pixels); };
  SampledMap corners = sample_map(map, {image.width() + 1, image.height() + 1, -0.5}, arguments.tolerance, true);
  PushedMesh result;
  result.map_error = corners.error;
  const bool is_mirrored = warp.orientation() < 0;
  const auto [least, most] = std::minmax_element(corners.jacobians.begin(), corners.jacobians.end());
  result.min_jacobian = is_mirrored ? -*most : *least;
  corners.jacobians = {};
  DeformedMesh mesh{corners.columns, corners.rows, std::move(corners.places)};
  result.folds = mesh_folds(mesh);
  if (is_mirrored) {
    result.folds.folded_fraction = 1 - result.folds.folded_fraction;
    for (std::uint8_t& reversed : result.folds.reversed_in_cell) reversed = 2 - reversed;
  }
  const RasterOptions raster{.width = frames.width,
                             .height = frames.height,
                             .supersampling = arguments.supersampling,
                             .over = parse_over(arguments.over)};
  PushOptions options{parse_interpolation(arguments.interpolation), std::nullopt};
  if (!is_transparent(arguments)) options.fill = fill_of(arguments, image);
  std::vector<float> priority;
  if (raster.over == SheetOrder::kPriority) priority = label_order(image, warp.label_pixels(), frames.label_ranks);
  result.pushed = push_forward(image, std::move(mesh), raster, options, std::move(priority));
  return result;
}

std::vector<float> jacobians_on_image(const Image& image, const ImageWarp& warp, const WarpArguments& arguments) {
  const PlaneMap map = [&](const Points& pixels) {
    return arguments.inverse ? warp.backward(pixels) : warp.forward(pixels);
  };
  std::vector<float> jacobians =
      sample_map(map, {image.width(), image.height(), 0}, arguments.tolerance, true).jacobians;
  if (warp.orientation() < 0)
    for (float& jacobian : jacobians) jacobian = -jacobian;
  return jacobians;
}

WarpedImage warp_image(const Image& image, const ImageWarp& warp, const WarpFrames& frames,
                       const WarpArguments& arguments) {
  const WarpMethod method = arguments.warp_method();
  const bool invertible = warp.flow().is_diffeomorphic();
  if (arguments.inverse) {
    if (method == WarpMethod::kPush)
      throw InputError("--inverse always pulls the image; it cannot be combined with --method push");
    WarpedImage result = pull(image, warp, frames, arguments);
    result.figures.reason = "each pixel of the source looks up its image under the map";
    return result;
  }
  if (method == WarpMethod::kPull && !invertible)
    throw InputError("--method pull needs a map that has an inverse; here the noise moves landmarks individually");
  if (method != WarpMethod::kPush && invertible) {
    WarpedImage result = pull(image, warp, frames, arguments);
    if (result.figures.min_jacobian > 0) {
      result.figures.reason = "the map is a diffeomorphism";
      return result;
    }
    if (method == WarpMethod::kPull)
      throw InputError("--method pull: the time steps are too long for an inverse; register with more --steps");
  }
  WarpedImage result = push(image, warp, frames, arguments);
  result.figures.reason = method == WarpMethod::kPush ? "as requested"
                          : invertible                ? "the time steps are too long for an inverse"
                          : result.figures.folded_fraction > 0
                              ? "the map folds"
                              : "the noise moves landmarks individually, but nothing folds";
  return result;
}

}  // namespace pulson
