#include "placed_picture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/shape_frames.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/images/image_warp.hpp"

namespace pulson {
namespace {

using Size = std::array<int, 2>;  // width, height

Size size_of(const Picture& picture) { return {picture.image.width(), picture.image.height()}; }

std::string text_of(const Size& size) { return fmt::format("{} x {}", size[0], size[1]); }

// ---- copies of another size

// The least and the largest factor by which `whole` pixels were reduced to `part`, whichever way they were rounded.
std::array<double, 2> factors(int whole, int part) {
  const double least = static_cast<double>(whole) / (part + 1);
  return {least, part > 1 ? static_cast<double>(whole) / (part - 1) : 2.0 * whole};
}

bool is_copy(const Size& original, const Size& copy) {
  const auto x = factors(original[0], copy[0]), y = factors(original[1], copy[1]);
  return std::max(x[0], y[0]) <= std::min(x[1], y[1]);
}

// The same coordinates on a copy of another size.
void rescale(Frame& frame, const Size& original, const Size& copy) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double factor = static_cast<double>(original[axis]) / copy[axis];
    const double shift = frame.unit_per_pixel[axis] * (factor - 1) / 2;  // of the centre of the first pixel
    frame.origin[axis] += axis == 1 && !frame.y_down ? -shift : shift;
    frame.unit_per_pixel[axis] *= factor;
  }
}

// ---- where landmarks lie

bool is_outside(const Eigen::Vector2d& pixel, const Size& size) {
  // A pixel more on each side: some programs count from 1, some clicks miss the edge.
  return (pixel.array() < -1).any() || pixel[0] > size[0] || pixel[1] > size[1];
}

int count_outside(const Points& landmarks, const Frame& frame) {
  const Points pixels = frame.to_pixels(images::in_plane(landmarks, frame));
  int count = 0;
  for (const auto pixel : pixels.colwise()) count += is_outside(pixel, {frame.width, frame.height}) ? 1 : 0;
  return count;
}

// ---- turned pictures

struct Turn {
  Orientation orientation;
  std::string reason;
};

int count_outside(const Landmarks& landmarks, const FrameOptions& options, const Frame& header, const Size& size) {
  Frame frame = frame_on(landmarks, options, header);
  frame.width = size[0];
  frame.height = size[1];
  return count_outside(landmarks.points, frame);
}

Turn turn_of(const Picture& picture, const Landmarks& landmarks, const FrameOptions& options) {
  using enum Orientation;
  const Size stored = size_of(picture), displayed = picture.orientation() > 4 ? Size{stored[1], stored[0]} : stored;
  const Size original{landmarks.frame.width, landmarks.frame.height};
  const Orientation usual = landmarks.frame.orientation, other = usual == kStored ? kDisplayed : kStored;
  if (original[0] > 0 && original[1] > 0) {
    const bool fits_stored = is_copy(original, stored), fits_displayed = is_copy(original, displayed);
    if (fits_stored != fits_displayed)
      return {fits_stored ? kStored : kDisplayed, fmt::format("it was {} pixels", text_of(original))};
  }
  const auto outside = [&](Orientation orientation) {
    return landmarks.dimension() > 2 ? 0
                                     : count_outside(landmarks, options, picture.frame.value_or(Frame{}),
                                                     orientation == kStored ? stored : displayed);
  };
  if (stored != displayed && outside(usual) > 0 && outside(other) == 0) return {other, "there they all lie on it"};
  return {usual, usual == kStored ? "so its file, which does not say otherwise, is read" : "so its program shows it"};
}

// The picture that the landmarks were placed on.
Picture as_placed(Picture picture, const std::string& file, const Landmarks& landmarks, const FrameOptions& options,
                  std::vector<std::string>& notes) {
  if (picture.orientation() == 1) return picture;
  const Turn turn = turn_of(picture, landmarks, options);
  const bool is_displayed = turn.orientation == Orientation::kDisplayed;
  notes.push_back(fmt::format("{} is displayed turned (orientation {}); {} was placed on it as {}: {}", file,
                              picture.orientation(), landmarks.source, is_displayed ? "displayed" : "stored",
                              turn.reason));
  return is_displayed ? oriented(picture) : std::move(picture);
}

// ---- resolutions

// Units of the landmarks per pixel, by the resolution of the picture, where both name units of length.
std::optional<std::array<double, 2>> unit_by_resolution(const Picture& picture, const std::string& unit) {
  const auto& resolution = picture.pages.front().about.resolution;
  if (!resolution || resolution->unit == images::Resolution::Unit::kNone) return std::nullopt;
  if (!(resolution->x > 0 && resolution->y > 0)) return std::nullopt;
  const std::optional<double> length = metres(unit);
  if (!length) return std::nullopt;
  const double metres_of_unit = resolution->unit == images::Resolution::Unit::kInch ? 0.0254 : 0.01;
  return std::array{metres_of_unit / resolution->x / *length, metres_of_unit / resolution->y / *length};
}

// What a person may have meant, for the end of a message.
std::string likeliest(const Landmarks& landmarks, const Frame& frame) {
  Frame flipped = frame;
  flipped.y_down = !frame.y_down;
  if (count_outside(landmarks.points, flipped) == 0)
    return fmt::format("with {} they lie on it", frame.y_down ? "--flip-y" : "--no-flip-y");
  if (landmarks.scale && frame.unit_per_pixel == std::array{1.0, 1.0})
    return fmt::format("check that it is the right image, or say the unit of the coordinates, as in --pixel-size {}",
                       *landmarks.scale);
  const auto [low, high] = bounding_box(images::in_plane(landmarks.points, frame));
  const double factor =
      (high.array() / (Eigen::Array2d(frame.width, frame.height) * frame.scale().array().abs())).maxCoeff();
  if ((low.array() >= 0).all() && factor > 1)
    return fmt::format(
        "check that it is the right image; of a copy reduced {:.3g} times or more say so, as in --pixel-size {:.3g}",
        factor, factor * frame.unit_per_pixel[0]);
  return "check that it is the right image, and see --pixel-size, --origin and --flip-y";
}

std::string outside_text(const Landmarks& landmarks, const Frame& frame, const std::string& file, int outside) {
  return fmt::format("{} of {} landmarks of {} lie outside {}, {} pixels: {}", outside, landmarks.count(),
                     landmarks.source, file, text_of({frame.width, frame.height}), likeliest(landmarks, frame));
}

// Landmarks in centimetres, say, whose file does not say so, are a speck in the corner.
void check_span(const Landmarks& landmarks, const FrameOptions& options, const std::string& file,
                PlacedPicture& placed) {
  const auto [low, high] = bounding_box(placed.frame.to_pixels(images::in_plane(landmarks.points, placed.frame)));
  if (!(low.allFinite() && high.allFinite()) || landmarks.count() < 2) return;
  const Eigen::Vector2d span = high - low;
  const std::string text =
      fmt::format("the {} landmarks of {} lie within {:.2g} x {:.2g} pixels of {}, {} pixels", landmarks.count(),
                  landmarks.source, span.x(), span.y(), file, text_of({placed.frame.width, placed.frame.height}));
  constexpr const char* kUnits = "--pixel-size says how many units of their coordinates a pixel has";
  constexpr double kSmallPart = 0.05;  // of a side: one in twenty
  if (!(span.x() < kSmallPart * placed.frame.width && span.y() < kSmallPart * placed.frame.height)) return;
  // Less than two pixels to a landmark: nobody placed them on these pixels.
  const bool is_crowded = (span.x() + 1) * (span.y() + 1) < 2.0 * landmarks.count();
  if (is_crowded && !options.say_units() && !placed.frame.says_units)
    throw InputError(fmt::format("{}: {}", text, kUnits));
  placed.warnings.push_back(fmt::format("{}: {}", text, kUnits));
}

void check_places(const Landmarks& landmarks, const FrameOptions& options, const std::string& file,
                  PlacedPicture& placed) {
  if (landmarks.dimension() > 2) return;
  if (const int outside = count_outside(landmarks.points, placed.frame); outside > 0) {
    const std::string text = outside_text(landmarks, placed.frame, file, outside);
    if (!options.say_units())
      throw InputError(text + (outside < landmarks.count() ? "; where they are meant to, --pixel-size 1 says so" : ""));
    placed.warnings.push_back(text);
  }
  check_span(landmarks, options, file, placed);
}

}  // namespace

Frame frame_on(const Landmarks& landmarks, const FrameOptions& options, const Frame& otherwise) {
  Frame frame = otherwise;
  const Frame& own = landmarks.frame;  // `register --pixel-size` sets units that the file does not say
  if (own.says_units || own.unit_per_pixel != std::array{1.0, 1.0} || own.origin != std::array{0.0, 0.0}) {
    frame.unit_per_pixel = landmarks.frame.unit_per_pixel;
    frame.origin = landmarks.frame.origin;
    frame.says_units = true;
  }
  if (options.pixel_size) frame.unit_per_pixel = {*options.pixel_size, *options.pixel_size};
  if (options.origin) frame.origin = *options.origin;
  const bool usual = landmarks.frame.y_down || landmarks.dimension() == 1;  // a strip is seen as it is stored
  frame.y_down = options.flip_y ? !*options.flip_y : usual;
  frame.says_y = options.flip_y.has_value() || landmarks.frame.says_y;
  return frame;
}

PlacedPicture place_picture(Picture picture, const std::string& file, const Landmarks& landmarks,
                            const FrameOptions& options) {
  PlacedPicture placed;
  placed.picture = as_placed(std::move(picture), file, landmarks, options, placed.notes);
  const std::optional<Frame>& header = placed.picture.frame;
  if (header && landmarks.frame.says_units && header->says_units && !options.say_units() &&
      header->unit_per_pixel != landmarks.frame.unit_per_pixel)
    throw InputError(
        fmt::format("{} has {:.4g} units per pixel by its header and {:.4g} by {}: --pixel-size says which", file,
                    header->unit_per_pixel[0], landmarks.frame.unit_per_pixel[0], landmarks.source));
  placed.frame = frame_on(landmarks, options, header.value_or(Frame{}));
  if (!header && !placed.frame.says_units && !options.say_units())
    if (const auto unit = unit_by_resolution(placed.picture, landmarks.units)) {
      placed.frame.unit_per_pixel = *unit;
      placed.notes.push_back(
          fmt::format("{} has {:.4g} {} per pixel by its resolution", file, (*unit)[0], landmarks.units));
    }
  const Size size = size_of(placed.picture), original{landmarks.frame.width, landmarks.frame.height};
  if (original[0] > 0 && original[1] > 0 && original != size && !options.say_units()) {
    if (!is_copy(original, size))
      throw InputError(fmt::format("{} has {} pixels, and {} was placed on a picture of {}: it is another picture",
                                   file, text_of(size), landmarks.source, text_of(original)));
    rescale(placed.frame, original, size);
    placed.notes.push_back(fmt::format(
        "{} has {} pixels, and {} was placed on {}: it is taken for a copy of another size, {:.4g} pixels to one", file,
        text_of(size), landmarks.source, text_of(original), static_cast<double>(original[0]) / size[0]));
  }
  placed.frame.width = size[0];
  placed.frame.height = size[1];
  check_places(landmarks, options, file, placed);
  return placed;
}

}  // namespace pulson
