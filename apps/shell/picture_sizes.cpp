#include "picture_sizes.hpp"

#include <algorithm>

#include "core/paths.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "warp/placed_picture.hpp"

namespace pulson {

namespace fs = std::filesystem;

std::optional<fs::path> picture_beside(const Landmarks& shape) {
  if (shape.image.empty() || shape.dimension() != 2) return std::nullopt;
  std::string text = shape.image;
  std::replace(text.begin(), text.end(), '\\', '/');
  const fs::path name = text, folder = fs::path(shape.source.substr(0, shape.source.find('#'))).parent_path();
  for (const fs::path& file : {folder / name.relative_path(), folder / name.filename()}) {
    if (!is_file(file)) continue;
    run_paths().reads(file, "the image of " + shape.source);
    return file;
  }
  return std::nullopt;
}

void find_picture_size(Landmarks& shape) {
  if (shape.frame.height > 0) return;
  const std::optional<fs::path> file = picture_beside(shape);
  if (!file) return;
  try {
    const Frame frame = place_picture(read_picture(*file, images::kMaxPixels), file->string(), shape, {}).frame;
    shape.frame.width = frame.width;
    shape.frame.height = frame.height;
  } catch (const InputError&) {  // then it is not known, which a conversion says
  }
}

void find_picture_sizes(const std::vector<Landmarks*>& shapes) {
  const auto has_direction = [&](bool y_down) {
    return std::any_of(shapes.begin(), shapes.end(),
                       [&](const Landmarks* s) { return s->dimension() == 2 && s->frame.y_down == y_down; });
  };
  if (!has_direction(true) || !has_direction(false)) return;
  for (Landmarks* shape : shapes) find_picture_size(*shape);
}

}  // namespace pulson
