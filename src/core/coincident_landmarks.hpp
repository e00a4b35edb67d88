#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// All pairs a < b at the same position, as find_coincident() defines it, in no particular order.
std::vector<std::pair<int, int>> coincident_pairs(const Points& points, double tolerance = 1e-12);

/// Whether landmarks a and b of a shape are at the same position, as find_coincident() defines it, or one of them has a
/// missing coordinate.
bool is_repeated(const Points& points, int a, int b);

/// The shape without landmark `second`, and with `first` at the mean of both; where one has a missing coordinate, at
/// the other. @param weights of both in the mean
Landmarks merged(const Landmarks& shape, int first, int second, const Eigen::Vector2d& weights);

/// The note that both were merged: `a.csv: landmarks 1 and 13 are at the same position in both shapes and are merged`.
/// @param shapes "in both shapes", or empty
std::string merged_note(const Landmarks& shape, int first, int second, const std::string& shapes);

/// The error where they differ in `other`, so that no flow maps `shape` to it.
std::string coincident_error(const Landmarks& shape, int first, int second, const Landmarks& other);

}  // namespace pulson
