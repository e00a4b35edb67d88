#include "frames.hpp"

#include <filesystem>
#include <tuple>

namespace pulson {
namespace {

// The address of a shape may end in #3 or #id=NAME.
bool is_of_tps(const Landmarks& shape) {
  const std::string file = shape.source.substr(0, shape.source.find('#'));
  const std::string extension = std::filesystem::path(file).extension().string();
  return extension == ".tps" || extension == ".TPS";
}

PixelFrame frame_of(const std::optional<PixelFrame>& own, std::optional<double> pixel_size,
                    const std::optional<std::array<double, 2>>& origin, bool y_up, int height) {
  PixelFrame frame = own.value_or(PixelFrame{});
  if (pixel_size) frame.spacing = {*pixel_size, *pixel_size};
  if (origin) frame.origin = *origin;
  frame.y_up = y_up;
  frame.height = height;
  return frame;
}

}  // namespace

WarpFrames warp_frames(const WarpArguments& arguments, const Registration& registration, const Picture& input) {
  WarpFrames frames;
  frames.width = input.image.width();
  frames.height = input.image.height();
  std::optional<PixelFrame> of_result = input.frame;
  if (!arguments.like.empty()) {
    frames.like = read_picture(arguments.like);
    frames.width = frames.like->image.width();
    frames.height = frames.like->image.height();
    of_result = frames.like->frame;
  }
  if (const auto canvas = arguments.canvas()) std::tie(frames.width, frames.height) = *canvas;
  const Landmarks& from = arguments.inverse ? registration.target : registration.original;
  const Landmarks& to = arguments.inverse ? registration.original : registration.target;
  const auto of_target = arguments.target_pixel_size ? arguments.target_pixel_size : arguments.pixel_size;
  frames.input = frame_of(input.frame, arguments.pixel_size, arguments.origin_of_image(),
                          arguments.flip_y.value_or(is_of_tps(from)), input.image.height());
  frames.result = frame_of(of_result, of_target, arguments.origin_of_result(), arguments.flip_y.value_or(is_of_tps(to)),
                           frames.height);
  const std::vector<std::vector<int>> groups = landmarks_by_group(registration.original);
  frames.label_ranks.resize(static_cast<std::size_t>(registration.original.count()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g])
      frames.label_ranks[static_cast<std::size_t>(a)] = groups.size() > 1 ? static_cast<int>(g) : a;
  return frames;
}

}  // namespace pulson
