#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "warp/mesh_raster.hpp"

namespace pulson::warp {

/// A place in fractions of the distance of two samples; samples are at multiples of kUnitsPerSample.
struct FixedPoint {
  std::int32_t x, y;

  bool is_valid() const { return x != std::numeric_limits<std::int32_t>::min(); }
};

inline constexpr int kUnitBits = 10;
inline constexpr std::int32_t kUnitsPerSample = 1 << kUnitBits;
/// Furthest coordinate in samples: differences stay below 2^30, so that sums of two products of them fit 64 bits.
inline constexpr double kFurthestSample = 1 << 19;

/// The first sample at or after a coordinate, and the last at or before it.
inline int first_sample(std::int32_t units) { return (units + kUnitsPerSample - 1) >> kUnitBits; }
inline int last_sample(std::int32_t units) { return units >> kUnitBits; }

/// From pixel coordinates; invalid for places that are not finite or too far out. Rounding is monotone.
inline FixedPoint snapped(const std::array<float, 2>& place, int supersampling) {
  const double x = (static_cast<double>(place[0]) + 0.5) * supersampling - 0.5;
  const double y = (static_cast<double>(place[1]) + 0.5) * supersampling - 0.5;
  if (!(std::abs(x) < kFurthestSample && std::abs(y) < kFurthestSample))
    return {std::numeric_limits<std::int32_t>::min(), 0};
  // Truncation is the quickest rounding, and rounds down what is positive.
  constexpr std::int32_t kOffset = (1 << 19) * kUnitsPerSample;
  const auto round = [](double sample) {
    return static_cast<std::int32_t>(sample * kUnitsPerSample + (kOffset + 0.5)) - kOffset;
  };
  return {round(x), round(y)};
}

/// Samples with left ≤ x ≤ right and top ≤ y ≤ bottom.
struct SampleBox {
  int left, right, top, bottom;

  bool is_empty() const { return left > right || top > bottom; }
};

/// The samples that a triangle of either orientation covers, by three edge functions E_i, linear, not negative inside
/// and equal to the triangle's doubled area at the opposite corner i.
class TriangleSamples {
 public:
  /// Those within a window.
  TriangleSamples(const std::array<FixedPoint, 3>& corners, const SampleBox& window)
      : corners_(corners), box_(intersection(window)) {
    if (box_.is_empty()) return;
    const std::int64_t doubled = cross(vector(0, 1), vector(0, 2));
    reversed_ = doubled < 0;
    doubled_area_ = std::abs(doubled);
    if (is_empty()) return;
    for (std::size_t i = 0; i < 3; ++i) edges_[i] = edge((i + 1) % 3, (i + 2) % 3);
  }

  bool is_empty() const { return box_.is_empty() || doubled_area_ == 0; }
  bool is_reversed() const { return reversed_; }

  /// The larger eigenvalue σ² of AᵀA in units², of the affine map A to this triangle of one that is right-angled at its
  /// first corner with sides of length 1.
  double squared_stretch() const {
    const Vector u = vector(0, 1);
    const Vector v = vector(0, 2);
    const double uu = dot(u, u);
    const double vv = dot(v, v);
    const double uv = dot(u, v);
    return 0.5 * (uu + vv + std::sqrt((uu - vv) * (uu - vv) + 4 * uv * uv));
  }

  /// Calls visit(x, y, w1, w2) for every sample that is covered, with the weights of corners 1 and 2 in it.
  template <class Visit>
  void for_each(const Visit& visit) const {
    const double inverse_area = 1 / static_cast<double>(doubled_area_);
    std::array<Edge, 3> row = edges_;
    for (int y = box_.top; y <= box_.bottom; ++y) {
      const Span span = covered(row, box_.right - box_.left);
      std::int64_t e1 = row[1].value + row[1].excluded + span.first * row[1].step_x;
      std::int64_t e2 = row[2].value + row[2].excluded + span.first * row[2].step_x;
      for (int x = box_.left + span.first; x <= box_.left + span.last; ++x) {
        visit(x, y, static_cast<double>(e1) * inverse_area, static_cast<double>(e2) * inverse_area);
        e1 += row[1].step_x;
        e2 += row[2].step_x;
      }
      for (Edge& edge : row) edge.value += edge.step_y;
    }
  }

 private:
  struct Vector {
    std::int64_t x, y;
  };
  struct Edge {
    std::int64_t value;  ///< at the first sample, less `excluded`: a sample is covered where none is negative
    std::int64_t step_x, step_y;
    std::int64_t excluded;  ///< 1 where samples on the edge itself are not covered, else 0
  };
  // Steps from the first sample of a row; none where last < first.
  struct Span {
    int first, last;
  };
  using Row = std::array<Edge, 3>;

  static std::int64_t cross(const Vector& u, const Vector& v) { return u.x * v.y - u.y * v.x; }
  static double dot(const Vector& u, const Vector& v) {
    return static_cast<double>(u.x) * static_cast<double>(v.x) + static_cast<double>(u.y) * static_cast<double>(v.y);
  }
  Vector vector(std::size_t from, std::size_t to) const {
    return {std::int64_t{corners_[to].x} - corners_[from].x, std::int64_t{corners_[to].y} - corners_[from].y};
  }

  SampleBox intersection(const SampleBox& window) const {
    const auto [min_x, max_x] = std::minmax({corners_[0].x, corners_[1].x, corners_[2].x});
    const auto [min_y, max_y] = std::minmax({corners_[0].y, corners_[1].y, corners_[2].y});
    return {std::max(window.left, first_sample(min_x)), std::min(window.right, last_sample(max_x)),
            std::max(window.top, first_sample(min_y)), std::min(window.bottom, last_sample(max_y))};
  }

  // A reversed triangle's edges are taken in the opposite direction, so that its inside is on the same side as of
  // others. Of an edge's two directions exactly one excludes, which is what moving all samples by (ε, ε²) does.
  Edge edge(std::size_t from, std::size_t to) const {
    const Vector along = reversed_ ? vector(to, from) : vector(from, to);
    const bool excludes = along.y > 0 || (along.y == 0 && along.x < 0);
    const Vector to_first = {std::int64_t{box_.left} * kUnitsPerSample - corners_[from].x,
                             std::int64_t{box_.top} * kUnitsPerSample - corners_[from].y};
    return {cross(along, to_first) - (excludes ? 1 : 0), -along.y * kUnitsPerSample, along.x * kUnitsPerSample,
            excludes ? 1 : 0};
  }

  // Few steps are tested one by one; divisions are quicker for many.
  static Span covered(const Row& row, int last) {
    constexpr int kFewSteps = 12;
    return last < kFewSteps ? covered_by_steps(row, last) : covered_by_division(row, last);
  }

  static bool is_outside(const Row& row, int step) {
    return ((row[0].value + step * row[0].step_x) | (row[1].value + step * row[1].step_x) |
            (row[2].value + step * row[2].step_x)) < 0;
  }

  static Span covered_by_steps(const Row& row, int last) {
    Span span = {0, last};
    while (span.first <= span.last && is_outside(row, span.first)) ++span.first;
    while (span.first < span.last && is_outside(row, span.last)) --span.last;
    return span;
  }

  static Span covered_by_division(const Row& row, int last) {
    std::int64_t first = 0;
    std::int64_t end = last;
    for (const Edge& edge : row) {
      if (edge.step_x > 0 && edge.value < 0) first = std::max(first, (-edge.value + edge.step_x - 1) / edge.step_x);
      if (edge.step_x < 0) end = std::min(end, edge.value < 0 ? -1 : edge.value / -edge.step_x);
      if (edge.step_x == 0 && edge.value < 0) end = -1;
    }
    if (first > end) return {0, -1};
    return {static_cast<int>(first), static_cast<int>(end)};
  }

  std::array<FixedPoint, 3> corners_;
  SampleBox box_;
  std::int64_t doubled_area_ = 0;
  bool reversed_ = false;
  Row edges_{};
};

inline std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

/// Where counts of sheets end.
inline constexpr int kMaxSheets = std::numeric_limits<std::uint8_t>::max();

/// The label at weights w1 and w2 of a triangle's corners 1 and 2: (x, y) + w1 side1 + w2 side2.
struct LabelMap {
  double x, y;
  std::array<double, 2> side1, side2;

  LabelMap(int column, int row, std::size_t triangle)
      : x(column + kCellTriangles[triangle][0][0] - 0.5),
        y(row + kCellTriangles[triangle][0][1] - 0.5),
        side1{triangle == 0 ? 1.0 : -1.0, 0},
        side2{0, triangle == 0 ? 1.0 : -1.0} {}

  explicit LabelMap(const MeshTriangle& triangle)
      : x(triangle.labels[0][0]),
        y(triangle.labels[0][1]),
        side1{triangle.labels[1][0] - x, triangle.labels[1][1] - y},
        side2{triangle.labels[2][0] - x, triangle.labels[2][1] - y} {}

  std::array<float, 2> at(double w1, double w2) const {
    return {static_cast<float>(x + side1[0] * w1 + side2[0] * w2),
            static_cast<float>(y + side1[1] * w1 + side2[1] * w2)};
  }

  /// Of either side.
  double squared_length() const { return side1[0] * side1[0] + side1[1] * side1[1]; }
};

/// Writes the samples of triangles into a band.
class BandWriter {
 public:
  explicit BandWriter(RasterBand& band)
      : band_(band),
        row_length_(band.width * band.supersampling),
        window_{0, row_length_ - 1, band.first_row * band.supersampling,
                (band.first_row + band.rows) * band.supersampling - 1} {}

  const SampleBox& window() const { return window_; }

 protected:
  // Counts every sample of a triangle, and gives it this sheet's label where `takes(sample)`.
  template <class Takes>
  void write_samples(const TriangleSamples& triangle, const LabelMap& label, const Takes& takes) {
    const std::uint8_t reversed = triangle.is_reversed() ? 1 : 0;
    triangle.for_each([&](int x, int y, double w1, double w2) {
      const std::size_t sample = as_index(y - window_.top) * as_index(row_length_) + as_index(x);
      if (takes(sample)) {
        band_.labels[sample] = label.at(w1, w2);
        band_.reversed[sample] = reversed;
      }
      if (band_.counts[sample] < kMaxSheets) ++band_.counts[sample];
    });
  }

  int count(std::size_t sample) const { return band_.counts[sample]; }

 private:
  RasterBand& band_;
  int row_length_;
  SampleBox window_;
};

/// A larger one is on top of a smaller one; of equals the first is.
struct Rank {
  float priority, fitness;

  bool is_above(const Rank& other) const {
    return priority > other.priority || (priority == other.priority && fitness > other.fitness);
  }
};

/// Keeps the label of the sheet on top.
class TopSheetWriter : public BandWriter {
 public:
  TopSheetWriter(RasterBand& band, SheetOrder over) : BandWriter(band), over_(over) {
    if (over != SheetOrder::kFirst) ranks_.resize(band.counts.size());
  }

  void write(const TriangleSamples& triangle, const LabelMap& label, float priority) {
    if (over_ == SheetOrder::kFirst) {
      write_samples(triangle, label, [this](std::size_t sample) { return count(sample) == 0; });
      return;
    }
    const double stretch = triangle.squared_stretch() / label.squared_length();
    const Rank rank = {priority, static_cast<float>(triangle.is_reversed() ? -stretch : 1 / stretch)};
    write_samples(triangle, label, [this, rank](std::size_t sample) {
      if (count(sample) > 0 && !rank.is_above(ranks_[sample])) return false;
      ranks_[sample] = rank;
      return true;
    });
  }

 private:
  SheetOrder over_;
  std::vector<Rank> ranks_;
};

/// Keeps the label of the n-th triangle that is written to a sample.
class NthSheetWriter : public BandWriter {
 public:
  NthSheetWriter(RasterBand& band, int n) : BandWriter(band), n_(n) {}

  void write(const TriangleSamples& triangle, const LabelMap& label, float /*priority*/) {
    write_samples(triangle, label, [this](std::size_t sample) { return count(sample) == n_; });
  }

 private:
  int n_;
};

}  // namespace pulson::warp
