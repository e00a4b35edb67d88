#include "underlay.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <system_error>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "pulson/images/warp_image.hpp"
#include "pulson/warp/material_flow.hpp"
#include "shell/path_options.hpp"
#include "warp/picture_files.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

constexpr double kLongestSide = 900;  // pixels

// A box in whole pixels.
struct PixelBox {
  Vector2d low;
  double pixel;
  int width, height;

  PixelBox(const Vector2d& from, const Vector2d& to) : low(from), pixel((to - from).maxCoeff() / kLongestSide) {
    width = std::max(1, static_cast<int>(std::lround((to - from).x() / pixel)));
    height = std::max(1, static_cast<int>(std::lround((to - from).y() / pixel)));
  }

  Vector2d high() const { return low + pixel * Vector2d(width, height); }

  // Where y points up, its origin is that of the lower edge.
  Frame frame(bool y_down) const {
    const Vector2d origin = low + pixel / 2 * Vector2d(1, y_down ? 1 : -1);
    return {{origin.x(), origin.y()}, {pixel, pixel}, y_down, height};
  }
};

// The flow of the same landmarks, which stay where they are.
warp::MaterialFlow at_rest(matching::Registration registration) {
  registration.noise = "none";
  registration.own_noise = nullptr;
  registration.mode = matching::MatchingMode::kDeterministic;
  registration.integrator = "rk4";
  registration.grid.steps = 1;
  registration.samples = 1;
  registration.momenta.setZero();
  registration.increments.resize(0, 1);
  registration.states.clear();
  registration.result = registration.source.points;
  registration.uncertainty.reset();
  return {registration_system(registration), replay(registration)};
}

images::Image moved(const images::Image& image, const images::ImageWarp& warp, const PixelBox& to) {
  return warp_image(image, warp, {.width = to.width, .height = to.height}).image;
}

}  // namespace

SourceImage named_image(const Landmarks& shape, bool scale_was_applied) {
  if (shape.image.empty() || shape.dimension() != 2) return {};
  std::string text = shape.image;
  std::replace(text.begin(), text.end(), '\\', '/');
  const fs::path name = text, folder = fs::path(shape.source.substr(0, shape.source.find('#'))).parent_path();
  for (const fs::path& file : {folder / name.relative_path(), folder / name.filename()}) {
    if (!is_file(file)) continue;
    run_paths().reads(file, "the image of " + shape.source);
    return {file, scale_was_applied ? shape.scale.value_or(1) : 1, {0, 0}};
  }
  return {};
}

std::optional<PageImage> add_underlay(const SourceImage& image, const matching::Registration& registration,
                                      draw::RegistrationPicture& picture, std::vector<std::string>& notes) try {
  if (image.file.empty() || picture.grid_after.empty()) return std::nullopt;
  const bool y_down = picture.source.frame.y_down || picture.target.frame.y_down;
  const auto [low, high] = drawn_box(registration);
  const PixelBox before(low, high);
  const auto [moved_low, moved_high] = bounding_box(joined_lines(picture.grid_after));
  const PixelBox after(low.cwiseMin(moved_low), high.cwiseMax(moved_high));

  const Picture read = read_picture(image.file, image.max_pixels);
  const Frame frame{image.origin, {image.pixel_size, image.pixel_size}, y_down, read.image.height()};
  if (const auto outside = landmarks_outside(frame.to_pixels(registration.original.points), read.image, image.file))
    notes.push_back(*outside);
  const warp::MaterialFlow rest = at_rest(registration);
  const images::Image aligned =
      for_show(moved(read.image, {rest, registration.alignment, frame, before.frame(y_down)}, before));
  picture.image_before = {raster_of(aligned), before.low, before.high()};

  const warp::MaterialFlow flow(registration_system(registration), replay(registration));
  const Alignment none{AlignmentKind::kNone, 1, Eigen::MatrixXd::Identity(2, 2), Vector2d::Zero()};
  const images::Image carried = moved(aligned, {flow, none, before.frame(y_down), after.frame(y_down)}, after);
  picture.image_after = {raster_of(carried), after.low, after.high()};
  return PageImage{jpeg_of(aligned), before.low, before.high()};
} catch (const std::exception& error) {  // whatever it is: numbers do not depend on a picture
  picture.image_before.reset();
  notes.push_back(fmt::format("{}: it is not drawn below the landmarks: {}", image.file.string(), error.what()));
  return std::nullopt;
}

}  // namespace pulson
