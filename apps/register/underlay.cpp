#include "underlay.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <system_error>

#include <fmt/format.h>

#include "pulson/images/warp_image.hpp"
#include "pulson/warp/material_flow.hpp"

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

SourceImage source_image(const fs::path& file, const FrameOptions& options, std::int64_t max_pixels, Landmarks& shape,
                         std::vector<std::string>& notes) try {
  PlacedPicture placed = place_picture(read_picture(file, max_pixels), file.string(), shape, options);
  for (const auto* texts : {&placed.notes, &placed.warnings}) notes.insert(notes.end(), texts->begin(), texts->end());
  if (shape.frame.width == 0) {
    shape.frame.width = placed.frame.width;
    shape.frame.height = placed.frame.height;
  }
  return {file, std::move(placed)};
} catch (const std::exception& error) {  // whatever it is: numbers do not depend on a picture
  notes.push_back(fmt::format("{}: it is not drawn below the landmarks: {}", file.string(), error.what()));
  return {file, std::nullopt};
}

std::optional<PageImage> add_underlay(const SourceImage& image, const matching::Registration& registration,
                                      draw::RegistrationPicture& picture, std::vector<std::string>& notes) try {
  if (!image.placed || picture.grid_after.empty()) return std::nullopt;
  const bool y_down = registration.original.frame.y_down;
  const auto [low, high] = drawn_box(registration);
  const PixelBox before(low, high);
  const auto [moved_low, moved_high] = bounding_box(joined_lines(picture.grid_after));
  const PixelBox after(low.cwiseMin(moved_low), high.cwiseMax(moved_high));

  Frame frame = image.placed->frame;
  frame.y_down = registration.original.frame.y_down;
  const warp::MaterialFlow rest = at_rest(registration);
  const images::Image aligned =
      for_show(moved(image.placed->picture.image, {rest, registration.alignment, frame, before.frame(y_down)}, before));
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
