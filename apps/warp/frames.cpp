#include "frames.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "draw/layers.hpp"
#include "pulson/core/errors.hpp"
#include "register/picture.hpp"

namespace pulson {
namespace {

using Eigen::Vector2d;

void append(std::vector<std::string>& all, std::vector<std::string>& more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

PlacedPicture placed(Picture picture, const std::string& file, const Landmarks& landmarks, const FrameOptions& options,
                     WarpFrames& frames) {
  PlacedPicture result = place_picture(std::move(picture), file, landmarks, options);
  append(frames.notes, result.notes);
  append(frames.warnings, result.warnings);
  return result;
}

// ---- the canvas

Points corners_of(int width, int height) {
  Points corners(2, 4);
  corners.row(0) << -0.5, width - 0.5, -0.5, width - 0.5;
  corners.row(1) << -0.5, -0.5, height - 0.5, height - 0.5;
  return corners;
}

// Pixels from low up to and with high.
struct PixelBox {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;

  void hold(const Vector2d& lowest, const Vector2d& highest) {
    if (!(lowest.allFinite() && highest.allFinite())) return;
    low = low.cwiseMin(lowest);
    high = high.cwiseMax(highest);
  }
  bool meets(const Vector2d& size) const {
    return (high.array() >= 0).all() && (low.array() <= size.array() - 1).all();
  }
};

// The corners of the image where the map takes them, in pixels of the result's first frame.
Points moved_corners(const WarpArguments& arguments, const matching::Registration& registration,
                     const warp::MaterialFlow& flow, const WarpFrames& frames) {
  const Points corners = corners_of(frames.input.width, frames.input.height);
  if (!arguments.inverse)
    return images::ImageWarp(flow, registration.alignment, frames.input, frames.result).forward(corners).places;
  const images::ImageWarp back(flow, registration.alignment, frames.result, frames.input);
  return flow.is_diffeomorphic() ? back.backward(corners).places : back.aligned_backward(corners);
}

// The result begins at pixel `first` of the frame that it had.
void move_frame(Frame& frame, const Vector2d& first, int width, int height) {
  frame.origin[0] += frame.unit_per_pixel[0] * first.x();
  frame.origin[1] += frame.unit_per_pixel[1] * (frame.y_down ? first.y() : frame.height - first.y() - height);
  frame.width = width;
  frame.height = height;
}

void fit_canvas(const WarpArguments& arguments, const matching::Registration& registration,
                const warp::MaterialFlow& flow, const Landmarks& to, WarpFrames& frames) {
  PixelBox box;
  const auto [lowest, highest] = bounding_box(moved_corners(arguments, registration, flow, frames));
  box.hold(lowest.array().ceil(), highest.array().floor());
  if (frames.landmarks_there.cols() > 0) {
    const auto [low, high] = bounding_box(frames.landmarks_there);
    box.hold((low.array() + 0.5).floor(), (high.array() + 0.5).floor());
  }
  const Vector2d size(frames.width, frames.height);
  if (!box.low.allFinite() || box.meets(size)) box.hold(Vector2d::Zero(), size.array() - 1);
  const Vector2d extent = box.high - box.low + Vector2d::Ones();
  constexpr double kLongest = 1 << 20;
  if (!(extent.array() <= kLongest).all() || extent.prod() > static_cast<double>(arguments.max_pixels))
    throw InputError(
        fmt::format("the map takes the image to {:.0f} x {:.0f} pixels, more than --max-pixels {} allows: "
                    "give the size of the result with --like or --size",
                    extent.x(), extent.y(), arguments.max_pixels));
  frames.width = static_cast<int>(extent.x());
  frames.height = static_cast<int>(extent.y());
  frames.first_pixel = {static_cast<int>(box.low.x()), static_cast<int>(box.low.y())};
  move_frame(frames.result, box.low, frames.width, frames.height);
  if (frames.first_pixel != std::array{0, 0})
    frames.notes.push_back(
        fmt::format("the result begins at pixel {}, {} of the picture of {}, to hold all of it, and is {} x {} pixels: "
                    "as a picture "
                    "of these landmarks it needs --origin={:.6g},{:.6g}; --like or --size keep their own frame",
                    frames.first_pixel[0], frames.first_pixel[1], to.source, frames.width, frames.height,
                    frames.result.origin[0], frames.result.origin[1]));
}

void check_canvas(const WarpArguments& arguments, const Landmarks& to, const WarpFrames& frames) {
  const auto is_outside = [&](const Vector2d& pixel) {
    return (pixel.array() < -1).any() || pixel.x() > frames.width || pixel.y() > frames.height;
  };
  int outside = 0;
  for (const auto pixel : frames.landmarks_there.colwise()) outside += is_outside(pixel) ? 1 : 0;
  if (outside > 0 && outside == frames.landmarks_there.cols())
    throw InputError(fmt::format(
        "none of the landmarks of {} lies on the result, {} x {} pixels: {}", to.source, frames.width, frames.height,
        arguments.target_origin.empty() ? "--target-origin says where it begins; without --size it holds all"
                                        : "check --target-origin"));
}

// ---- what else drawings need

void add_landmarks(const matching::Registration& registration, const Landmarks& to, WarpFrames& frames) {
  if (to.dimension() <= 2) frames.landmarks_there = frames.result.to_pixels(images::in_plane(to.points, frames.result));
  frames.names = draw::mark_names(registration.original);
  const std::vector<std::vector<int>> groups = landmarks_by_group(registration.original);
  frames.label_ranks.resize(static_cast<std::size_t>(registration.original.count()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g])
      frames.label_ranks[static_cast<std::size_t>(a)] = groups.size() > 1 ? static_cast<int>(g) : a;
}

FrameOptions options_of_result(const WarpArguments& arguments) {
  return {arguments.target_pixel_size ? arguments.target_pixel_size : arguments.pixel_size,
          arguments.origin_of_result(), arguments.flip_y};
}

// The frame that the result has before it is fitted to what it holds.
void begin_result(const WarpArguments& arguments, const Landmarks& from, const Landmarks& to, WarpFrames& frames) {
  const FrameOptions options = options_of_result(arguments);
  if (!arguments.like.empty()) {
    PlacedPicture like =
        placed(read_picture(arguments.like, arguments.max_pixels), arguments.like, to, options, frames);
    frames.result = like.frame;
    frames.orientation = like.picture.orientation();
    frames.like = std::move(like.picture);
  } else {
    if (to.frame.orientation == Orientation::kDisplayed) frames.orientation = 1;
    const Frame& input = frames.input;
    const bool knows_size = to.frame.width > 0 && to.frame.height > 0 && !options.say_units();
    const bool is_of_one_size = from.frame.width == to.frame.width && from.frame.height == to.frame.height;
    // On pictures of one size the result is a copy as the image is one.
    frames.result = frame_on(to, options, knows_size && !is_of_one_size ? Frame{} : input);
    const auto pixels = [&](int size, std::size_t axis) {  // of the result, whose may be larger than the target's
      return std::max(
          1, static_cast<int>(std::lround(size * to.frame.unit_per_pixel[axis] / frames.result.unit_per_pixel[axis])));
    };
    frames.result.width = knows_size ? pixels(to.frame.width, 0) : input.width;
    frames.result.height = knows_size ? pixels(to.frame.height, 1) : input.height;
    if (const auto canvas = arguments.canvas()) std::tie(frames.result.width, frames.result.height) = *canvas;
  }
  frames.width = frames.result.width;
  frames.height = frames.result.height;
}

}  // namespace

WarpFrames warp_frames(const WarpArguments& arguments, const matching::Registration& registration,
                       const warp::MaterialFlow& flow, Picture& picture) {
  WarpFrames frames;
  const Landmarks& from = arguments.inverse ? registration.target : registration.original;
  const Landmarks& to = arguments.inverse ? registration.original : registration.target;
  PlacedPicture input = placed(std::move(picture), arguments.input, from,
                               {arguments.pixel_size, arguments.origin_of_image(), arguments.flip_y}, frames);
  picture = std::move(input.picture);
  frames.input = input.frame;
  begin_result(arguments, from, to, frames);
  frames.title = short_name(from) + " → " + short_name(to);
  add_landmarks(registration, to, frames);
  if (arguments.like.empty() && arguments.size.empty()) {
    fit_canvas(arguments, registration, flow, to, frames);
    frames.landmarks_there = frames.result.to_pixels(images::in_plane(to.points, frames.result));
  }
  images::check_pixel_count(frames.width, frames.height, arguments.max_pixels, "the result");
  check_canvas(arguments, to, frames);
  return frames;
}

}  // namespace pulson
