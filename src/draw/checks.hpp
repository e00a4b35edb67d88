#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::draw {

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

/// At most `most` (≥ 2) of the indices 0, …, count − 1, evenly spaced, including both ends.
std::vector<std::size_t> spread_indices(std::size_t count, std::size_t most);

/// For each of these landmarks, the times that have to be drawn to show its whole path.
///
/// The time from first to last is cut into equal pieces. Of each piece those entries are kept where a coordinate is
/// least and where it is greatest, so that the drawn line fills the same range in every piece: noise keeps its
/// width, and no spike is lost. The first entry and the last are kept as well.
///
/// trajectory: K+1 entries d×N, finite; landmarks: columns of them; times: K+1, increasing. Returns for each landmark
/// increasing indices into `times`, no more than max(most, 2d + 2); all of them where K+1 ≤ most. One pass.
std::vector<std::vector<std::size_t>> thin_paths(const std::vector<Points>& trajectory,
                                                 const std::vector<int>& landmarks, const std::vector<double>& times,
                                                 std::size_t most);

/// Drops vertices of lines 2×M until `most` are left in all, those first without which the lines change least.
///
/// A vertex counts by its distance from the chord that replaces it where the line is divided at the farthest vertex,
/// again and again (D. Douglas and T. Peucker, 1973), so a spike stays when the straight parts around it are long gone.
/// The ends of lines are always kept; nothing is dropped if there are at most `most` vertices.
void simplify_lines(std::vector<Points>& lines, std::size_t most);

}  // namespace pulson::draw
