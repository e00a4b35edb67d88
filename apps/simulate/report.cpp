#include "report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "records/simulation_facts.hpp"
#include "register/picture.hpp"
#include "shell/facts.hpp"
#include "shell/messages.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

constexpr std::int64_t kMostKernels = 300'000'000;  // for the material: about a second
constexpr int kMaterialPoints = 2600;

std::size_t clean_paths(const records::Simulation& simulation) {
  return static_cast<std::size_t>(
      std::count_if(simulation.samples.begin(), simulation.samples.end(),
                    [](const ensemble::SamplePath& sample) { return sample.status == ensemble::PathStatus::kClean; }));
}

std::string lead(const records::Simulation& simulation) {
  const std::size_t all = simulation.samples.size(), clean = clean_paths(simulation);
  std::string text = fmt::format("{} of {} in {}D to t = {:.4g}.", counted(all, "sample path"),
                                 counted(simulation.shape.count(), "landmark"), simulation.shape.dimension(),
                                 simulation.options.grid.time);
  return text + (clean == all ? " All were followed to their end."
                              : fmt::format(" {} of them could not be followed to the end.", all - clean));
}

// The box of the material: that of the first path, with a margin.
MaterialBox material_box(const std::vector<Points>& frames) {
  auto [low, high] = bounding_box(frames.front());
  for (const Points& frame : frames) {
    const auto [from, to] = bounding_box(frame);
    low = low.cwiseMin(from);
    high = high.cwiseMax(to);
  }
  const double margin = 0.1 * std::max((high - low).maxCoeff(), 1e-300);
  return {low.array() - margin, high.array() + margin};
}

std::optional<html::ReportMotion> motion_of(const records::Simulation& simulation) {
  const TimeGrid& grid = simulation.options.grid;
  const ensemble::SamplePath& first = simulation.samples.front();
  const std::int64_t numbers = simulation.start.q.size();
  const std::vector<int> steps = shown_frames(grid.steps, numbers);
  html::ReportMotion motion;
  motion.source = simulation.shape;
  for (const int k : steps) motion.times.push_back(grid.at(k));
  add_path(first.path, steps, motion.frames);
  const std::size_t others =
      shown_paths(simulation.samples.size() - 1, numbers * static_cast<std::int64_t>(steps.size()), kMostShownPaths);
  for (std::size_t m = 1; m <= others; ++m) add_path(simulation.samples[m].path, steps, motion.others.emplace_back());
  std::erase_if(motion.others, [](const std::vector<Points>& path) { return !can_be_drawn(path); });
  motion.others_name = counted(motion.others.size(), "other path");
  if (!can_be_drawn(motion.frames)) return std::nullopt;
  if (first.status == ensemble::PathStatus::kClean &&
      kMaterialPoints * simulation.shape.count() <= kMostKernels / grid.steps)
    add_material(simulation.system, first.path, steps, material_box(motion.frames), motion);
  motion.caption =
      fmt::format("Sample path 1{}{}.", motion.grid.empty() ? "" : " with the material between the landmarks",
                  motion.others.empty() ? "" : fmt::format(", and faintly {}", motion.others_name));
  return motion;
}

html::ReportTable settings(const records::Simulation& simulation) {
  html::ReportTable table = report_facts(
      chosen(records::simulation_facts(), {"kernel", "noise", "integrator", "time", "steps", "seed", "seconds"}),
      simulation, "setting");
  table.rows.insert(table.rows.begin(), {{"start"}, {start_text(simulation.shape)}});
  return table;
}

html::ReportTable path_table(const records::Simulation& simulation) {
  const Facts<records::SamplePathRow>& all = records::sample_path_facts();
  const bool are_clean = clean_paths(simulation) == simulation.samples.size();
  std::vector<records::SamplePathRow> rows;
  for (std::size_t m = 0; m < simulation.samples.size(); ++m) rows.push_back({&simulation, m});
  html::ReportTable table = report_table(
      are_clean ? chosen(all, {"largest_displacement", "largest_momentum", "contraction_bound"})
                : chosen(all, {"reason", "time", "largest_displacement", "largest_momentum", "contraction_bound"}),
      rows, "κ below 1: the equation of each step has one root.");
  table.header.insert(table.header.begin(), {"path", "ended"});
  for (std::size_t m = 0; m < rows.size(); ++m) {
    const char* end = simulation.samples[m].status == ensemble::PathStatus::kClean ? "clean" : "early";
    table.rows[m].insert(table.rows[m].begin(), {{fmt::to_string(m + 1)}, {end}});
  }
  return table;
}

// Displacements of each landmark from the start to the end of clean paths.
html::ReportTable displacement_table(const records::Simulation& simulation) {
  const auto n = simulation.start.q.cols();
  Eigen::VectorXd first = Eigen::VectorXd::Constant(n, std::nan("")), squares = Eigen::VectorXd::Zero(n);
  for (const ensemble::SamplePath& sample : simulation.samples) {
    const Eigen::VectorXd moved = (sample.path.final().q - simulation.start.q).colwise().norm();
    if (&sample == &simulation.samples.front()) first = moved;
    if (sample.status == ensemble::PathStatus::kClean) squares += moved.cwiseAbs2();
  }
  const std::size_t clean = clean_paths(simulation);
  html::ReportTable table = landmark_table(simulation.shape);
  table.header.emplace_back("displacement in path 1");
  if (simulation.samples.size() > 1) table.header.emplace_back("root mean square of all paths");
  for (const int a : listed_landmarks(first)) {
    std::vector<html::ReportCell> row = landmark_cells(simulation.shape, a);
    row.push_back({report_number(first[a])});
    if (simulation.samples.size() > 1)
      row.push_back({clean > 0 ? report_number(std::sqrt(squares[a] / static_cast<double>(clean))) : ""});
    table.rows.push_back(std::move(row));
  }
  table.caption = "Distance of each landmark from its start at the end. paths.csv has the paths.";
  return table;
}

}  // namespace

void add_path(const Trajectory& path, const std::vector<int>& steps, std::vector<Points>& frames) {
  for (const int k : steps)
    frames.push_back(path.states[std::min(static_cast<std::size_t>(k), path.states.size() - 1)].q);
}

std::size_t shown_paths(std::size_t paths, std::int64_t numbers, std::size_t most) {
  constexpr std::int64_t kMostNumbers = 120'000;
  const auto room = static_cast<std::size_t>(kMostNumbers / std::max<std::int64_t>(numbers, 1));
  return std::min({paths, most, room});
}

html::HtmlReport simulation_report(const records::Simulation& simulation, const std::vector<std::string>& warnings,
                                   const std::vector<std::string>& notes, const std::filesystem::path& picture) {
  html::HtmlReport report =
      new_report("Sample paths of " + start_name(simulation.shape), lead(simulation), warnings, notes);
  if (std::optional<html::ReportMotion> motion = motion_of(simulation))
    report.sections.push_back({"Motion", {std::move(*motion)}});
  add_still(report, "The paths", picture);
  report.sections.push_back({"Numbers", {settings(simulation), path_table(simulation)}});
  report.sections.push_back({"Landmarks", {displacement_table(simulation)}});
  return report;
}

}  // namespace pulson
