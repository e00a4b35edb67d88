#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "noise/models.hpp"

namespace pulson {

/// What the formulas of pair_noises_body.hpp need to know of a noise `ch-sd-screened`.
struct ScreenedPairs {
  double beta = 0;
  double gamma = 0;
  LandmarkChoice on;
  std::vector<std::size_t> group;  ///< of each landmark; empty where there is one group

  /// Whether a and b screen each other.
  bool screens(std::size_t a, std::size_t b) const { return group.empty() || group[a] != group[b]; }
};

/// The same of a noise `kunita`.
struct KunitaPairs {
  double beta = 0;
  double width = 0;
};

/// None for another noise, sums included.
std::optional<ScreenedPairs> screened_pairs(const NoiseModel& noise);
std::optional<KunitaPairs> kunita_pairs(const NoiseModel& noise);

/// The terms of a sum, in the order of their channels; none for another noise.
std::vector<std::shared_ptr<const NoiseModel>> terms_of_sum(const NoiseModel& noise);

}  // namespace pulson
