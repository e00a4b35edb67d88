#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/estimate.hpp"

namespace pulson {

/// Count, mean and sum of squared deviations of several numbers that are sampled together.
struct Moments {
  std::int64_t count = 0;
  Eigen::ArrayXd mean;
  Eigen::ArrayXd squares;  ///< Σ (x − mean)²

  /// As if the samples of `other` had come after these: T. Chan, G. Golub, R. LeVeque, Updating formulae and a pairwise
  /// algorithm for computing sample variances (1979).
  void merge(const Moments& other);
  /// Squared deviations over count − 1; NaN for fewer than two samples.
  Eigen::ArrayXd variance() const;
  /// Of the mean.
  Eigen::ArrayXd standard_error() const;
};

/// Moments of the rows of x that are to be used.
Moments moments_of(const Eigen::ArrayXXd& x, const std::vector<bool>& used);

/// A density, constant between edges.
struct DensityBars {
  std::vector<double> edges;   ///< n + 1
  std::vector<double> values;  ///< n
};

/// Counts of one number in equal bins; what lies outside is counted in the first bin or the last.
struct Histogram {
  double low = 0;
  double high = 1;
  std::vector<std::uint64_t> counts;
  double smallest = std::numeric_limits<double>::infinity();  ///< of the samples
  double largest = -std::numeric_limits<double>::infinity();

  std::size_t bin_of(double x) const {
    const auto bins = static_cast<double>(counts.size());
    const double place = (x - low) * (bins / (high - low));
    return static_cast<std::size_t>(place > 0 ? (place < bins ? place : bins - 1) : 0);
  }
  double width() const { return (high - low) / static_cast<double>(counts.size()); }
  std::int64_t total() const;
  /// The x below which the fraction `probability` of the samples lies, linear within bins and
  /// not beyond the smallest and the largest sample. NaN where there are none.
  double quantile(double probability) const;
  /// The density between the quantiles `tail` and 1 − tail, bins joined so that there are at most `most` bars.
  DensityBars bars(double tail, double most) const;
};

/// How many paths ended how. A path is counted where it first fits: with momenta beyond the bound, without a root, with
/// two landmarks at exactly the same position at the end, clean.
struct PathCounts {
  std::int64_t clean = 0;
  std::int64_t no_root = 0;
  std::int64_t momentum_bound = 0;
  std::int64_t tie = 0;

  std::int64_t total() const { return clean + no_root + momentum_bound + tie; }
};

/// Landmarks on a line that changed their order, among the clean paths.
struct CrossingCounts {
  std::int64_t at_end = 0;
  std::int64_t ever = 0;  ///< at the end of some step
  /// Antithetic pairs of clean paths, by how many of the two crossed (0, 1, 2).
  std::array<std::int64_t, 3> pairs{};
};

/// All that an ensemble has added up so far: the paths 0 … samples − 1.
struct EnsembleSums {
  std::int64_t samples = 0;
  PathCounts paths;
  CrossingCounts crossing;
  double momentum_error = 0;    ///< max over paths and records of |Σp − Σp(0)| / Σ|p_a(0)|
  double largest_momentum = 0;  ///< max |p_a| over all paths, as far as they were followed
  /// For each record: of the 2dN coordinates of (q, p), over the paths that were clean up to then.
  std::vector<Moments> moments;
  std::vector<Moments> pair_moments;               ///< of the means of antithetic pairs; empty without these
  std::vector<std::vector<Histogram>> histograms;  ///< [record][coordinate]; empty for records without
  /// [path][record][coordinate] of all records or the last, NaN where a path is not clean so far; or empty.
  std::vector<double> states;

  /// The fraction of the clean paths whose landmarks, on a line, end in a different order from the start. With
  /// antithetic pairs the error is that of the pairs' means.
  Estimate crossing_probability() const;
  /// Standard errors of the mean at a record.
  Eigen::ArrayXd mean_error(std::size_t record) const;
};

}  // namespace pulson
