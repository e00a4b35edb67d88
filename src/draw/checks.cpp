#include "checks.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson::picture {
namespace {

bool can_be_drawn(const Points& points) { return (points.array().abs() <= kLargestDrawn).all(); }

}  // namespace

void Checks::refuse(const std::string& why) const { throw InputError(picture_ + ": " + why); }

void Checks::shape(const Landmarks& shape, const std::string& what) const {
  const int d = shape.dimension();
  if (d < 1 || d > 3) refuse(fmt::format("the dimension is {}; 1, 2 and 3 can be drawn", d));
  if (shape.count() == 0) refuse("there are no landmarks");
  if (!shape.groups.empty() && shape.groups.size() != static_cast<std::size_t>(shape.count()))
    refuse(fmt::format("{} group names for {} landmarks", shape.groups.size(), shape.count()));
  points(shape.points, d, what);
}

void Checks::incomplete_shape(const Landmarks& shape, Eigen::Index rows, const std::string& what) const {
  const auto is_missing = shape.points.array().isNaN();
  points(is_missing.select(0, shape.points), rows, what);
  if (shape.count() == 0) refuse(fmt::format("{} has no landmarks", what));
  if (is_missing.all()) refuse(fmt::format("{} has no coordinates", what));
  if (!shape.groups.empty() && shape.groups.size() != static_cast<std::size_t>(shape.count()))
    refuse(fmt::format("{} has {} group names for {} landmarks", what, shape.groups.size(), shape.count()));
}

void Checks::points(const Points& points, Eigen::Index rows, const std::string& what) const {
  if (points.rows() != rows) refuse(fmt::format("{} has {} rows, not {}", what, points.rows(), rows));
  if (can_be_drawn(points)) return;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) refuse(fmt::format("point {} of {} is not finite", i + 1, what));
    if (!can_be_drawn(points.col(i)))
      refuse(fmt::format("point {} of {} is larger than {:g}, too large to be drawn", i + 1, what, kLargestDrawn));
  }
}

void Checks::landmarks(const Points& points, const Landmarks& shape, const std::string& shape_name,
                       const std::string& what) const {
  this->points(points, shape.dimension(), what);
  count(points, shape, shape_name, what);
}

void Checks::count(const Points& points, const Landmarks& shape, const std::string& shape_name,
                   const std::string& what) const {
  if (points.cols() != shape.count())
    refuse(fmt::format("{} has {} landmarks, {} {}", what, points.cols(), shape_name, shape.count()));
}

void Checks::trajectory(const std::vector<Points>& entries, const Landmarks& shape, const std::string& shape_name,
                        const std::string& what) const {
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (entries[k].rows() != shape.points.rows() || entries[k].cols() != shape.points.cols() ||
        !can_be_drawn(entries[k]))
      landmarks(entries[k], shape, shape_name, fmt::format("{} entry {}", what, k + 1));
}

void Checks::times(const std::vector<double>& times, std::size_t entries, const std::string& of_what) const {
  if (times.size() != entries || entries < 2)
    refuse(fmt::format("{} times for {} entries of {}; both must be K+1, K ≥ 1", times.size(), entries, of_what));
  for (std::size_t k = 0; k < times.size(); ++k)
    if (!can_be_drawn(times[k]) || (k > 0 && times[k] <= times[k - 1]))
      refuse(
          fmt::format("time {} is {}; times must increase and be no larger than {:g}", k + 1, times[k], kLargestDrawn));
}

}  // namespace pulson::picture
