#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// Adds the positions of a path at these steps; from where it ends early on, its end.
void add_path(const Trajectory& path, const std::vector<int>& steps, std::vector<Points>& frames);

inline constexpr std::size_t kMostShownPaths = 30;

/// The other paths that a motion can show beside the first: as many as keep the page small, at most `most`.
std::size_t shown_paths(std::size_t paths, std::int64_t numbers, std::size_t most);

/// `report.html` of a simulation: how the paths ended, the first as it moves with the others behind it, the numbers,
/// and how far each landmark went. @param picture PNG or SVG, or empty @param notes of the run
html::HtmlReport simulation_report(const records::Simulation& simulation, const std::vector<std::string>& warnings,
                                   const std::vector<std::string>& notes, const std::filesystem::path& picture);

}  // namespace pulson
