#include "pulson/draw/path_picture.hpp"

#include <fmt/format.h>

#include "checks.hpp"
#include "path_compositions.hpp"

namespace pulson {
namespace {

void check(const PathPicture& picture) {
  const picture::Checks checks("path picture");
  checks.shape(picture.start, "the start");
  const std::size_t paths = picture.positions.size();
  if (paths == 0) checks.refuse("there are no paths");
  if (picture.momenta.size() != paths)
    checks.refuse(fmt::format("{} paths of momenta for {} of positions", picture.momenta.size(), paths));
  for (const bool momenta : {false, true})
    for (std::size_t m = 0; m < paths; ++m) {
      const std::vector<Points>& entries = momenta ? picture.momenta[m] : picture.positions[m];
      const std::string name = fmt::format("{} of path {}", momenta ? "momenta" : "positions", m + 1);
      checks.times(picture.times, entries.size(), "the " + name);
      checks.trajectory(entries, picture.start, "the start", name + ",");
    }
}

}  // namespace

void write_path_picture(const PathPicture& picture, const std::filesystem::path& png,
                        const std::filesystem::path& svg) {
  check(picture);
  const int d = picture.start.dimension();
  const picture::Canvas canvas = d == 1   ? picture::compose_paths_on_line(picture)
                                 : d == 2 ? picture::compose_paths_in_plane(picture)
                                          : picture::compose_paths_in_space(picture);
  canvas.write(png, svg);
}

}  // namespace pulson
