#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/core/estimate.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson {

/// A probability by sample paths, of those that are clean. NaN where none is.
struct SampledProbability : Estimate {
  std::int64_t paths = 0;

  double known_error() const;  ///< NaN where all paths or none are counted, as 0 would say nothing
  std::string text() const;
};

/// What a report on a pair says.
struct PairFacts {
  const fokker_planck::PairEquation& equation;
  std::string noise;
  const fokker_planck::PairCrossing& crossing;
  const std::vector<SampledProbability>& sampled;  ///< at the times of the crossing; may be empty
  std::int64_t samples = 0;
};

/// `report.html` of a pair: the probability and how well it is known, the picture, the grids, and the probability over
/// time. @param picture PNG or SVG, or empty
html::HtmlReport pair_report(const PairFacts& facts, const std::vector<std::string>& warnings,
                             const std::vector<std::string>& notes, const std::filesystem::path& picture);

}  // namespace pulson
