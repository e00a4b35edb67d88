#pragma once

// What tests of landmark files share: numbers that are hard to write, shapes of them, and whether they came back.

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Finite doubles of random bits after −0, the least and the greatest, and some that are not short.
inline Points hard_points(int d, int count, unsigned seed = 1) {
  std::mt19937_64 bits(seed);
  std::vector<double> numbers = {-0.0, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(),
                                 0.1,  -std::numeric_limits<double>::min(),       1.0 / 3};
  while (std::ssize(numbers) < d * count)
    if (const auto number = std::bit_cast<double>(std::uint64_t{bits()}); std::isfinite(number))
      numbers.push_back(number);
  return Points::Map(numbers.data(), d, count);
}

inline LandmarkFile one_shape(Points points) {
  LandmarkFile file;
  file.shapes.emplace_back().points = std::move(points);
  return file;
}

/// Whether all coordinates have the same bits, or are missing in both.
inline testing::AssertionResult have_same_bits(const Points& points, const Points& expected) {
  if (points.rows() != expected.rows() || points.cols() != expected.cols())
    return testing::AssertionFailure() << points.cols() << " points in " << points.rows() << "D; expected "
                                       << expected.cols() << " in " << expected.rows() << "D";
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const double number = points.reshaped()[i];
    const double right = expected.reshaped()[i];
    if (std::isnan(number) && std::isnan(right)) continue;
    if (std::bit_cast<std::uint64_t>(number) != std::bit_cast<std::uint64_t>(right))
      return testing::AssertionFailure() << "coordinate " << i << " is " << number << "; expected " << right;
  }
  return testing::AssertionSuccess();
}

}  // namespace pulson::formats
