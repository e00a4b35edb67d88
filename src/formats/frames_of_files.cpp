#include "frames_of_files.hpp"

#include <fmt/format.h>

#include "core/shape_frames.hpp"
#include "landmark_writers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {

void complete_frame(const LandmarkFormat& format, bool is_of_image, const ReadOptions& options, Landmarks& shape) {
  Frame& frame = shape.frame;
  if (shape.dimension() != 2) {
    frame = Frame{.y_down = false};
    return;
  }
  if (format.orientation == Orientation::kDisplayed) frame.orientation = Orientation::kDisplayed;
  if (!options.y_down && frame.says_y) return;
  const std::optional<bool> by_file = is_of_image ? std::optional(true) : format.y_down;
  frame.y_down = options.y_down.value_or(by_file.value_or(true));
  frame.says_y = options.y_down || by_file;
}

void put_y_in_direction(const std::string& path, const LandmarkFormat& format, Landmarks& shape,
                        std::vector<std::string>& notes) {
  const Frame& frame = shape.frame;
  if (shape.dimension() != 2 || !format.y_down || *format.y_down == frame.y_down) return;
  const std::string of_format =
      fmt::format("{}: {} counts y {}", path, format.name, *format.y_down ? "downwards" : "upwards");
  if (!frame.says_y) {
    if (!frame.y_down) return;  // of no file
    add_once(notes, of_format +
                        ", and what was read does not say how it counts; where that is downwards, as the rows "
                        "of a picture, convert it with `mirror_y`");
    return;
  }
  if (frame.height == 0)
    throw InputError(
        fmt::format("{}, {} in the other direction, and the height of its picture is not known: convert "
                    "it with `mirror_y`",
                    of_format, shape.source.empty() ? "the shape" : shape.source));
  mirror_y(shape);
  add_once(notes, fmt::format("{}; converted by the height of the picture, {} pixels", of_format, frame.height));
}

}  // namespace pulson::formats
