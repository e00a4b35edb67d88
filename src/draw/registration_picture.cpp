#include "pulson/draw/registration_picture.hpp"

#include <fmt/format.h>

#include "checks.hpp"
#include "compositions.hpp"

namespace pulson {
namespace {

void check(const RegistrationPicture& picture) {
  const picture::Checks checks("registration picture");
  const Landmarks& source = picture.source;
  checks.shape(source, "the source");
  checks.incomplete_shape(picture.target, source.dimension(), "the target");
  if (picture.corresponds) checks.count(picture.target.points, source, "the source", "the target");
  checks.landmarks(picture.result, source, "the source", "the result");
  checks.times(picture.times, picture.trajectory.size(), "the trajectory");
  checks.trajectory(picture.trajectory, source, "the source", "trajectory");
  const auto check_lines = [&](const std::vector<Points>& lines, Eigen::Index rows, const std::string& what) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      checks.points(lines[i], rows, fmt::format("{} line {}", what, i + 1));
  };
  check_lines(picture.grid_before, source.dimension(), "undeformed grid");
  check_lines(picture.grid_after, source.dimension(), "deformed grid");
  check_lines(picture.grid_paths, 2, "material path");
}

}  // namespace

void write_registration_picture(const RegistrationPicture& picture, const std::filesystem::path& png,
                                const std::filesystem::path& svg) {
  check(picture);
  const picture::Canvas canvas = picture.source.dimension() == 1   ? picture::compose_line(picture)
                                 : picture.source.dimension() == 2 ? picture::compose_plane(picture)
                                                                   : picture::compose_space(picture);
  canvas.write(png, svg);
}

}  // namespace pulson
