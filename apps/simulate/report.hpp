#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "html/html_report.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/records/records.hpp"
#include "shell/report_parts.hpp"

namespace pulson {

/// Adds the positions of a path at these steps; from where it ends early on, its end.
void add_path(const Trajectory& path, const std::vector<int>& steps, std::vector<Points>& frames);

inline constexpr std::size_t kMostShownPaths = 30;

/// The other paths that a motion can show beside the first: as many as keep the page small, at most `most`.
std::size_t shown_paths(std::size_t paths, std::int64_t numbers, std::size_t most);

/// The settings of a `Simulation` or `EnsembleRun`, the first rows of the facts in its report.
template <class Run>
FactTable settings(const Run& run) {
  FactTable table("setting");
  table.add("start", start_text(run.shape));
  table.add("kernel", run.system.kernel.spec(4));
  table.add("noise", shortened_spec(run.system.noise->spec()));
  table.add("integrator", run.integrator);
  table.add("time", run.options.grid.time);
  table.add("steps", fmt::to_string(run.options.grid.steps));
  table.add("seed", fmt::to_string(run.options.seed));
  return table;
}

/// `report.html` of a simulation: how the paths ended, the first as it moves with the others behind it, the numbers,
/// and how far each landmark went. @param picture PNG or SVG, or empty @param notes of the run
html::HtmlReport simulation_report(const records::Simulation& simulation, const std::vector<std::string>& warnings,
                                   const std::vector<std::string>& notes, const std::filesystem::path& picture);

}  // namespace pulson
