#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "triangle_samples.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson {

inline std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

/// Where counts of sheets end.
inline constexpr int kMaxSheets = std::numeric_limits<std::uint8_t>::max();

/// The label at weights w1 and w2 of a triangle's corners 1 and 2: x + sign w1, y + sign w2.
struct LabelMap {
  double x, y, sign;

  LabelMap(int column, int row, std::size_t triangle)
      : x(column + kCellTriangles[triangle][0][0] - 0.5),
        y(row + kCellTriangles[triangle][0][1] - 0.5),
        sign(triangle == 0 ? 1 : -1) {}
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
        band_.labels[sample] = {static_cast<float>(label.x + label.sign * w1),
                                static_cast<float>(label.y + label.sign * w2)};
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
    const double stretch = triangle.squared_stretch();
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

}  // namespace pulson
