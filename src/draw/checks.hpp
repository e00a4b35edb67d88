#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::picture {

/// Beyond it, differences and squares of pixels would overflow.
inline constexpr double kLargestDrawn = 1e300;

/// Finite, and no larger than that.
inline bool can_be_drawn(double value) { return std::abs(value) <= kLargestDrawn; }

/// Refuses what cannot be drawn: each method throws InputError, its message led by the name of the picture.
class Checks {
 public:
  explicit Checks(std::string picture) : picture_(std::move(picture)) {}

  [[noreturn]] void refuse(const std::string& why) const;

  /// 1 to 3 rows, at least one landmark, as many groups as landmarks or none. `what`: "the source".
  void shape(const Landmarks& shape, const std::string& what) const;

  /// So many rows, at least one landmark, as many groups as landmarks or none; coordinates may be missing (NaN), but
  /// not all.
  void incomplete_shape(const Landmarks& shape, Eigen::Index rows, const std::string& what) const;

  /// All of the points can be drawn, and they have so many rows.
  void points(const Points& points, Eigen::Index rows, const std::string& what) const;

  /// The same, and one point for each landmark of the shape, which a message calls `shape_name`.
  void landmarks(const Points& points, const Landmarks& shape, const std::string& shape_name,
                 const std::string& what) const;

  /// One point for each landmark of the shape.
  void count(const Points& points, const Landmarks& shape, const std::string& shape_name,
             const std::string& what) const;

  /// Every entry of the list has a point for each landmark; `what`: "trajectory".
  void trajectory(const std::vector<Points>& entries, const Landmarks& shape, const std::string& shape_name,
                  const std::string& what) const;

  /// As many times as entries, two or more; finite and increasing.
  void times(const std::vector<double>& times, std::size_t entries, const std::string& of_what) const;

 private:
  std::string picture_;
};

}  // namespace pulson::picture
