#include "pulson/report/registration_picture.hpp"

#include <cmath>

#include <fmt/format.h>

#include "compositions.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

[[noreturn]] void refuse(const std::string& why) { throw InputError("registration picture: " + why); }

void check_points(const Points& points, Eigen::Index rows, const std::string& what) {
  if (points.rows() != rows) refuse(fmt::format("{} has {} rows, not {}", what, points.rows(), rows));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite()) refuse(fmt::format("point {} of {} is not finite", i + 1, what));
}

void check_landmarks(const Points& points, const Landmarks& source, const std::string& what) {
  check_points(points, source.dimension(), what);
  if (points.cols() != source.count())
    refuse(fmt::format("{} has {} landmarks, the source {}", what, points.cols(), source.count()));
}

void check_lines(const std::vector<Points>& lines, Eigen::Index rows, const std::string& what) {
  for (std::size_t i = 0; i < lines.size(); ++i) check_points(lines[i], rows, fmt::format("{} line {}", what, i + 1));
}

void check_times(const std::vector<double>& times, std::size_t entries) {
  if (times.size() != entries || entries < 2)
    refuse(fmt::format("{} times for {} entries of the trajectory; both must be K+1, K ≥ 1", times.size(), entries));
  for (std::size_t k = 0; k < times.size(); ++k)
    if (!std::isfinite(times[k]) || (k > 0 && times[k] <= times[k - 1]))
      refuse(fmt::format("time {} is {}; times must be finite and increase", k + 1, times[k]));
}

void check(const RegistrationPicture& picture) {
  const Landmarks& source = picture.source;
  const int d = source.dimension();
  if (d < 1 || d > 3) refuse(fmt::format("the dimension is {}; 1, 2 and 3 can be drawn", d));
  if (source.count() == 0) refuse("there are no landmarks");
  if (!source.groups.empty() && source.groups.size() != static_cast<std::size_t>(source.count()))
    refuse(fmt::format("{} group names for {} landmarks", source.groups.size(), source.count()));
  check_landmarks(source.points, source, "the source");
  check_landmarks(picture.target, source, "the target");
  check_landmarks(picture.result, source, "the result");
  check_times(picture.times, picture.trajectory.size());
  for (std::size_t k = 0; k < picture.trajectory.size(); ++k)
    check_landmarks(picture.trajectory[k], source, fmt::format("trajectory entry {}", k + 1));
  check_lines(picture.grid_before, d, "undeformed grid");
  check_lines(picture.grid_after, d, "deformed grid");
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
