#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/core/estimate.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"

namespace pulson {

/// What a report on a pair says.
struct PairFacts {
  const fokker_planck::PairEquation& equation;
  std::string noise;
  const fokker_planck::PairCrossing& crossing;
  const std::vector<Estimate>& sampled;  ///< at the times of the crossing; may be empty
  std::int64_t samples = 0;
};

/// `report.html` of a pair: the probability and how well it is known, the picture, the grids, and the probability over
/// time. @param picture PNG or SVG, or empty
html::HtmlReport pair_report(const PairFacts& facts, const std::vector<std::string>& warnings,
                             const std::vector<std::string>& notes, const std::filesystem::path& picture);

}  // namespace pulson
