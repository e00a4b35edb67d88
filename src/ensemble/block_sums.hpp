#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "path_sampler.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson {

/// What one block of paths adds to an ensemble.
class BlockSums {
 public:
  /// The first `lanes` paths of a block. The histograms' ranges are those that the ensemble has.
  BlockSums(const EnsembleOptions& options, const PhaseState& start,
            const std::vector<std::vector<Histogram>>& histograms, std::size_t lanes);

  /// Each record, in order.
  void take(std::size_t record, const LaneStates& states);
  /// After the last record.
  void finish(const LaneEnds& ends);

  /// But for the histograms.
  const EnsembleSums& sums() const { return sums_; }
  void add_to(std::vector<Histogram>& histograms, std::size_t record) const;

 private:
  void take_momenta(const LaneStates& states);
  void take_pairs(std::size_t record, const LaneStates& states);
  void take_bins(std::size_t record, const LaneStates& states);
  void keep(std::size_t record, const LaneStates& states);

  const EnsembleOptions& options_;
  const PhaseState& start_;
  const std::vector<std::vector<Histogram>>& histograms_;
  std::size_t lanes_;
  EnsembleSums sums_;
  struct Range {
    double smallest = std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
  };
  struct Bins {
    std::vector<std::uint16_t> of_lanes;  // [coordinate·kPathBatch + lane]
    std::vector<Range> ranges;            // [coordinate]
  };
  std::vector<Bins> bins_;   // [record]
  std::vector<bool> clean_;  // lanes, up to the record that was taken last
  PathLanes last_gap_{};
};

}  // namespace pulson
