#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "jobs.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace pulson {
namespace {

using Eigen::Index;

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
  return image.depth() == images::PixelDepth::kFloat32 || is_grid_file(arguments.input) ||
         images::parse_interpolation(arguments.interpolation) == images::Interpolation::kLabel;
}

// In units and order of the image's channels, opaque.
std::array<double, 4> fill_of(const WarpArguments& arguments, const images::Image& image) {
  const double full = full_value(image.depth());
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

images::RemapOptions remap_options(const WarpArguments& arguments, const images::Image& image) {
  images::RemapOptions options{images::parse_interpolation(arguments.interpolation), images::Border::kConstant,
                               fill_of(arguments, image)};
  if (is_transparent(arguments, image))
    options.border = images::Border::kTransparent;
  else if (arguments.border != "auto" && arguments.border != "transparent")
    options.border = images::parse_border(arguments.border);
  return options;
}

bool is_outside(const std::array<float, 2>& place, const images::Image& image) {
  return !(place[0] >= -0.5F && place[1] >= -0.5F && place[0] <= static_cast<float>(image.width()) - 0.5F &&
           place[1] <= static_cast<float>(image.height()) - 0.5F);
}

// From pixel positions of one frame, whose rows begin at `first_row`, to places in another: in landmark units.
void append_displacements(const warp::SampledMap& map, int first_row, const images::PixelFrame& from,
                          const images::PixelFrame& to, std::vector<float>& all) {
  const auto count = static_cast<Index>(map.places.size());
  Points pixels(2, count), places(2, count);
  for (Index i = 0; i < count; ++i) {
    const Index row = i / map.columns;
    pixels.col(i) << static_cast<double>(i - row * map.columns), static_cast<double>(first_row + row);
    const auto& [x, y] = map.places[static_cast<std::size_t>(i)];
    places.col(i) << x, y;
  }
  const Eigen::MatrixXf difference = (to.to_landmarks(places) - from.to_landmarks(pixels)).cast<float>();
  all.insert(all.end(), difference.data(), difference.data() + difference.size());
}

// The result of a pull, some rows at a time.
class PulledRows {
 public:
  PulledRows(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
             const WarpArguments& arguments)
      : image_(image), warp_(warp), frames_(frames), arguments_(arguments), options_(remap_options(arguments, image)) {
    result_.pulled = true;
    result_.figures.method = "pull";
  }

  void add(int first_row, warp::SampledMap&& rows) {
    note_jacobians(rows);
    if (!arguments_.field.empty())
      append_displacements(rows, first_row, frames_.result, frames_.input, result_.displacements);
    for (const auto& place : rows.places) result_.multiplicity.push_back(is_outside(place, image_) ? 0 : 1);
    const images::Image pulled = remap(image_, {rows.columns, rows.rows, std::move(rows.places)}, options_);
    images::Image& whole = result_.image;
    if (whole.empty()) whole = images::Image(frames_.width, frames_.height, pulled.channels(), pulled.depth());
    const std::size_t row_bytes = whole.bytes().size() / static_cast<std::size_t>(frames_.height);
    std::copy(pulled.bytes().begin(), pulled.bytes().end(),
              whole.bytes().begin() + static_cast<std::ptrdiff_t>(row_bytes * static_cast<std::size_t>(first_row)));
  }

  WarpedImage result() && {
    WarpFigures& figures = result_.figures;
    // Of the map that moves the source. Where the map is flipped its inverse has no value, which the sign shows.
    figures.min_jacobian = arguments_.inverse || least_ <= 0 ? least_ : 1.0 / most_;
    const auto all = static_cast<double>(result_.multiplicity.size());
    const auto outside = std::count(result_.multiplicity.begin(), result_.multiplicity.end(), 0);
    figures.folded_fraction = static_cast<double>(folded_) / all;
    figures.uncovered_fraction = static_cast<double>(outside) / all;
    figures.max_multiplicity = outside < std::ssize(result_.multiplicity) ? 1 : 0;
    result_.holes.resize(result_.multiplicity.size());
    return std::move(result_);
  }

 private:
  void note_jacobians(const warp::SampledMap& rows) {
    const auto sign = static_cast<float>(warp_.orientation());
    for (const float determinant : rows.jacobians) {
      const float jacobian = sign * determinant;
      least_ = std::min(least_, jacobian);
      most_ = std::max(most_, jacobian);
      folded_ += jacobian <= 0 ? 1 : 0;
    }
    result_.figures.map_error = std::max(result_.figures.map_error, rows.error);
  }

  const images::Image& image_;
  const images::ImageWarp& warp_;
  const WarpFrames& frames_;
  const WarpArguments& arguments_;
  images::RemapOptions options_;
  WarpedImage result_;
  float least_ = std::numeric_limits<float>::infinity();
  float most_ = -std::numeric_limits<float>::infinity();
  std::int64_t folded_ = 0;
};

WarpedImage pull(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                 const WarpArguments& arguments) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return arguments.inverse ? warp.forward(pixels) : warp.backward(pixels);
  };
  PulledRows rows(image, warp, frames, arguments);
  sample_map_by_rows(map, {frames.width, frames.height, 0}, arguments.tolerance, true,
                     [&](int first_row, warp::SampledMap&& band) { rows.add(first_row, std::move(band)); });
  return std::move(rows).result();
}

WarpedImage push(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                 const WarpArguments& arguments) {
  PushedMesh mesh = push_image(image, warp, frames, arguments);
  WarpedImage result;
  WarpFigures& figures = result.figures;
  figures.method = "push";
  figures.map_error = mesh.map_error;
  figures.min_jacobian = mesh.min_jacobian;
  figures.folded_fraction = mesh.folds.folded_fraction;
  figures.max_multiplicity = mesh.pushed.coverage.max_multiplicity;
  figures.uncovered_fraction = mesh.pushed.coverage.uncovered_fraction();
  result.holes = warp::enclosed(mesh.pushed.uncovered, frames.width, frames.height);
  figures.hole_fraction = static_cast<double>(std::count(result.holes.begin(), result.holes.end(), true)) /
                          static_cast<double>(result.holes.size());
  result.multiplicity = std::move(mesh.pushed.multiplicity);
  result.image = std::move(mesh.pushed.image);
  if (!arguments.field.empty()) {
    const auto forward = [&](const Points& pixels) { return warp.forward(pixels); };
    warp::sample_map_by_rows(forward, {image.width(), image.height(), 0}, arguments.tolerance, false,
                             [&](int first_row, const warp::SampledMap& rows) {
                               append_displacements(rows, first_row, frames.input, frames.result, result.displacements);
                             });
  }
  return result;
}

}  // namespace

std::vector<float> label_order(const images::Image& image, const Points& landmarks, const std::vector<int>& ranks) {
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

PushedMesh push_image(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                      const WarpArguments& arguments) {
  const warp::PlaneMap map = [&](const Points& pixels) { return warp.forward(pixels); };
  PushedMesh result;
  const bool is_mirrored = warp.orientation() < 0;
  result.min_jacobian = std::numeric_limits<double>::infinity();
  warp::DeformedMesh mesh{image.width() + 1, image.height() + 1, {}};
  mesh.vertices.reserve(static_cast<std::size_t>(mesh.columns) * static_cast<std::size_t>(mesh.rows));
  const auto add = [&](int, const warp::SampledMap& rows) {
    mesh.vertices.insert(mesh.vertices.end(), rows.places.begin(), rows.places.end());
    const auto [least, most] = std::minmax_element(rows.jacobians.begin(), rows.jacobians.end());
    result.min_jacobian = std::min<double>(result.min_jacobian, is_mirrored ? -*most : *least);
    result.map_error = std::max(result.map_error, rows.error);
  };
  sample_map_by_rows(map, {mesh.columns, mesh.rows, -0.5}, arguments.tolerance, true, add);
  result.folds = mesh_folds(mesh);
  if (is_mirrored) {
    result.folds.folded_fraction = 1 - result.folds.folded_fraction;
    for (std::uint8_t& reversed : result.folds.reversed_in_cell) reversed = 2 - reversed;
  }
  const warp::RasterOptions raster{.width = frames.width,
                                   .height = frames.height,
                                   .supersampling = arguments.supersampling,
                                   .over = warp::parse_over(arguments.over)};
  images::PushOptions options{images::parse_interpolation(arguments.interpolation), std::nullopt};
  if (!is_transparent(arguments, image)) options.fill = fill_of(arguments, image);
  std::vector<float> priority;
  if (raster.over == warp::SheetOrder::kPriority)
    priority = label_order(image, warp.label_pixels(), frames.label_ranks);
  result.pushed = push_forward(image, std::move(mesh), raster, options, std::move(priority));
  return result;
}

std::vector<float> jacobians_on_image(const images::Image& image, const images::ImageWarp& warp,
                                      const WarpArguments& arguments) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return arguments.inverse ? warp.backward(pixels) : warp.forward(pixels);
  };
  std::vector<float> jacobians =
      sample_map(map, {image.width(), image.height(), 0}, arguments.tolerance, true).jacobians;
  if (warp.orientation() < 0)
    for (float& jacobian : jacobians) jacobian = -jacobian;
  return jacobians;
}

std::vector<float> displacements_on_image(const images::Image& image, const images::ImageWarp& warp,
                                          const WarpArguments& arguments) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return arguments.inverse ? warp.backward(pixels) : warp.forward(pixels);
  };
  const warp::SampledMap sampled = sample_map(map, {image.width(), image.height(), 0}, arguments.tolerance, false);
  std::vector<float> lengths(sampled.places.size());
  parallel_for(image.height(), [&](int y) {
    Points here(2, image.width()), there(2, image.width());
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width());
    for (int x = 0; x < image.width(); ++x) {
      const auto& place = sampled.places[first + static_cast<std::size_t>(x)];
      here.col(x) << x, y;
      there.col(x) << place[0], place[1];
    }
    const Points moved = arguments.inverse ? Points(here - warp.aligned(there)) : Points(there - warp.aligned(here));
    const Eigen::VectorXf all = (warp.target().scale().asDiagonal() * moved).colwise().norm().cast<float>();
    std::copy(all.begin(), all.end(), lengths.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return lengths;
}

WarpedImage warp_image(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
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
