#include "missing_marks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::formats {
namespace {

template <class IsMissing>
void mark_as_missing(std::vector<Landmarks>& shapes, const IsMissing& is_missing) {
  for (Landmarks& shape : shapes)
    for (auto point : shape.points.colwise())
      if (is_missing(point.array())) point.setConstant(text::kMissing);
}

template <class IsAbsent>
void mark_as_absent(std::vector<Landmarks>& shapes, const IsAbsent& is_absent) {
  for (Landmarks& shape : shapes)
    for (int a = 0; a < shape.count(); ++a) {
      if (!is_absent(shape.points.col(a).array())) continue;
      shape.points.col(a).setConstant(text::kMissing);
      const auto place = std::lower_bound(shape.absent.begin(), shape.absent.end(), a);
      if (place == shape.absent.end() || *place != a) shape.absent.insert(place, a);
    }
}

/// That several landmarks of a shape are at 0, where they were perhaps not digitised; empty where none are.
std::string note_of_zeros(const std::vector<Landmarks>& shapes) {
  std::size_t zeros = 0;
  const Landmarks* first = nullptr;
  for (const Landmarks& shape : shapes) {
    const auto is_zero = [](const auto& point) { return point.size() > 1 && (point.array() == 0).all(); };
    const auto here = std::count_if(shape.points.colwise().begin(), shape.points.colwise().end(), is_zero);
    // one may be an origin, and so may those among negative coordinates
    if (here < 2 || (shape.points.array() < 0).any()) continue;
    zeros += static_cast<std::size_t>(here);
    if (first == nullptr) first = &shape;
  }
  if (first == nullptr) return {};
  return fmt::format(
      "{} at 0 in each coordinate, the first of them in {}, often those that were not digitised, read as points like "
      "any "
      "other: `zero_is_missing` distinguishes them",
      text::counted(zeros, "landmark"), text::in_quotes(first->name));
}

/// Landmarks with −1 in all coordinates, in shapes that have no other negative coordinate.
std::size_t count_negative_marks(const std::vector<Landmarks>& shapes) {
  std::size_t marks = 0;
  for (const Landmarks& shape : shapes)
    for (const auto& point : shape.points.colwise()) {
      if (point.hasNaN() || (point.array() >= 0).all()) continue;
      if (point.size() == 1 || (point.array() != -1).any()) return 0;
      ++marks;
    }
  return marks;
}

// 99, 999, 9999, … and their negatives, as statistical programs write what is not known.
bool is_of_nines(double value) {
  constexpr double kFewest = 1e2, kMost = 1e6;
  for (double power = kFewest; power <= kMost; power *= 10)
    if (std::abs(value) == power - 1) return true;
  return false;
}

/// Notes the numbers of nines that stand in all coordinates of a landmark, each with their count.
void note_nines(const std::string& path, LandmarkFile& file) {
  std::map<double, std::size_t> counts;
  for (const Landmarks& shape : file.shapes)
    for (const auto& point : shape.points.colwise())
      if (point.size() > 1 && is_of_nines(point[0]) && (point.array() == point[0]).all()) ++counts[point[0]];
  for (const auto& [code, count] : counts)
    file.warnings.push_back(fmt::format(
        "{}: {} with {} in each coordinate, often the mark of a missing one, read as a point like any other: "
        "`missing_codes = {}` distinguishes them",
        path, text::counted(count, "landmark"), code, code));
}

// One code is a number, or NaN for what has no number.
template <class Point>
bool has_code(const Point& point, double code) {
  return std::isnan(code) ? point.isNaN().any() : (point == code).all();
}

}  // namespace

void mark_missing(const ReadOptions& options, const std::string& path, LandmarkFile& file) {
  if (options.negative_is_missing) mark_as_missing(file.shapes, [](const auto& point) { return (point < 0).any(); });
  for (const double code : options.missing_codes)
    mark_as_missing(file.shapes, [&](const auto& point) { return has_code(point, code); });
  for (const double code : options.absent_codes)
    mark_as_absent(file.shapes, [&](const auto& point) { return has_code(point, code); });
  if (options.zero_is_missing)
    mark_as_missing(file.shapes, [](const auto& point) { return (point == 0).all(); });
  else if (const std::string note = note_of_zeros(file.shapes); !note.empty())
    file.warnings.push_back(fmt::format("{}: {}", path, note));
  if (const std::size_t marks = count_negative_marks(file.shapes); marks > 0)
    file.warnings.push_back(fmt::format(
        "{}: {} with -1 in each coordinate, often the mark of a missing one, read as a point like any other: "
        "`negative_is_missing` distinguishes them",
        path, text::counted(marks, "landmark")));
  note_nines(path, file);
}

}  // namespace pulson::formats
