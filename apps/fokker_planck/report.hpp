#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "facts.hpp"
#include "html/html_report.hpp"

namespace pulson {

/// `report.html` of a pair: the probability and how well it is known, the picture, the grids, and the probability over
/// time. @param picture PNG or SVG, or empty
html::HtmlReport pair_report(const PairRun& run, const std::vector<std::string>& warnings,
                             const std::vector<std::string>& notes, const std::filesystem::path& picture);

}  // namespace pulson
