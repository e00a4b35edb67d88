#include "report.hpp"

#include <cmath>

#include "records/ensemble_facts.hpp"
#include "shell/facts.hpp"
#include "shell/messages.hpp"
#include "shell/probability_text.hpp"
#include "shell/report_parts.hpp"
#include "simulate/report.hpp"

namespace pulson {
namespace {

std::string lead(const records::EnsembleRun& run) {
  const ensemble::PathCounts& paths = run.sums.paths;
  std::string text =
      fmt::format("{} of {} in {}D to t = {:.4g}, {} of them clean.", counted(run.sums.samples, "sample path"),
                  counted(run.shape.count(), "landmark"), run.shape.dimension(), run.options.grid.time, paths.clean);
  if (run.has_crossing()) {
    const Estimate crossing = run.sums.crossing_probability();
    text +=
        fmt::format(" The order has changed at the end with probability {}.", probability_text(crossing, paths.clean));
  }
  return text;
}

// The records that have a mean, which are those of the picture's times.
std::vector<std::size_t> records_with_mean(const records::EnsembleRun& run) {
  std::vector<std::size_t> records;
  for (std::size_t record = 0; record < run.options.records.size(); ++record)
    if (run.sums.moments[record].count > 1) records.push_back(record);
  return records;
}

std::optional<html::ReportMotion> motion_of(const records::EnsembleRun& run, const draw::EnsemblePicture& shape) {
  if (shape.mean.size() < 2) return std::nullopt;
  const std::int64_t numbers = run.start.q.size();
  const std::vector<std::size_t> records = records_with_mean(run);
  const std::vector<int> shown = shown_frames(static_cast<int>(records.size()) - 1, numbers);
  html::ReportMotion motion;
  motion.source = run.shape;
  for (const int record : shown) {
    motion.times.push_back(shape.times[static_cast<std::size_t>(record)]);
    motion.frames.push_back(shape.mean[static_cast<std::size_t>(record)]);
  }
  const std::size_t others =
      shown_paths(shape.paths.size(), numbers * static_cast<std::int64_t>(shown.size()), kMostShownPaths);
  for (std::size_t m = 0; m < others; ++m) {
    std::vector<Points> frames;
    for (const int record : shown) frames.push_back(shape.paths[m][records[static_cast<std::size_t>(record)]]);
    if (can_be_drawn(frames)) motion.others.push_back(std::move(frames));
  }
  motion.others_name = counted(motion.others.size(), "sample path");
  if (run.shape.dimension() == 2)
    motion.extra = {fmt::format("ellipses of {:.0f} % at the end", 100 * draw::kEllipsePart), ellipses(shape, 0, 1)};
  if (!can_be_drawn(motion.frames) || !can_be_drawn(motion.extra.lines)) return std::nullopt;
  motion.caption = fmt::format("The mean of all paths{}.",
                               motion.others.empty() ? "" : fmt::format(", and faintly {}", motion.others_name));
  return motion;
}

html::ReportTable facts(const records::EnsembleRun& run) {
  html::ReportTable table =
      report_facts(chosen(records::ensemble_facts(),
                          {"kernel", "noise", "integrator", "time", "steps", "seed", "paths.clean", "paths.no_root",
                           "paths.momentum_bound", "momentum_bound", "crossing.ever", "momentum_error_max", "seconds"}),
                   run, "setting");
  table.rows.insert(table.rows.begin(), {{"start"}, {start_text(run.shape)}});
  return table;
}

// Mean and standard deviation of each landmark's position at the end.
html::ReportTable landmarks_at_end(const records::EnsembleRun& run) {
  const ensemble::Moments& last = run.sums.moments.back();
  const int d = run.shape.dimension(), n = run.shape.count();
  const Eigen::ArrayXd deviation = last.variance().sqrt();
  Eigen::VectorXd moved(n), total_deviation(n);
  for (int a = 0; a < n; ++a) {
    moved[a] = (last.mean.segment(a * d, d).matrix() - run.start.q.col(a)).norm();
    total_deviation[a] = deviation.segment(a * d, d).matrix().norm();
  }
  html::ReportTable table = landmark_table(run.shape);
  table.header.emplace_back("displacement of the mean");
  for (int i = 0; i < d; ++i) table.header.push_back(fmt::format("mean {}", "xyz"[i]));
  table.header.emplace_back("standard deviation");
  for (const int a : listed_landmarks(total_deviation)) {
    std::vector<html::ReportCell> row = landmark_cells(run.shape, a);
    row.push_back({report_number(moved[a])});
    for (int i = 0; i < d; ++i) row.push_back({report_number(last.mean[a * d + i], 5)});
    row.push_back({report_number(total_deviation[a])});
    table.rows.push_back(std::move(row));
  }
  table.caption =
      "Positions at the end. The standard deviation is the square root of the sum of the variances of the axes. "
      "means.csv has all times and quantiles.";
  return table;
}

}  // namespace

html::HtmlReport ensemble_report(const records::EnsembleRun& run, const draw::EnsemblePicture& shape,
                                 const std::vector<std::string>& warnings, const std::vector<std::string>& notes,
                                 const std::filesystem::path& picture) {
  html::HtmlReport report =
      new_report((run.partial() ? "Part of the ensemble of " : "Ensemble of ") + start_name(run.shape), lead(run),
                 warnings, notes);
  if (std::optional<html::ReportMotion> motion = motion_of(run, shape))
    report.sections.push_back({"Motion", {std::move(*motion)}});
  add_still(report, "The ensemble", picture);
  report.sections.push_back({"Numbers", {facts(run)}});
  if (run.sums.moments.back().count > 1) report.sections.push_back({"Landmarks", {landmarks_at_end(run)}});
  return report;
}

}  // namespace pulson
