#include "report.hpp"

#include <cmath>

#include <fmt/format.h>

#include "shell/facts.hpp"
#include "shell/probability_text.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

constexpr std::size_t kMostTimes = 51;  // of the table

std::string lead(const PairRun& run) {
  const fokker_planck::PairCrossing& crossing = run.crossing;
  std::string text = fmt::format(
      "By t = {:.4g} the pair has changed its order with probability {}, by the pair equation on a grid, with "
      "the stated error.",
      run.equation.time, value_with_error(crossing.probability, crossing.error));
  if (!run.sampled.empty()) {
    text += fmt::format(" {} sample paths: {}.", run.samples, run.sampled.back().text());
  }
  if (!crossing.converged) text += " The tolerance was not reached.";
  return text;
}

html::ReportTable settings(const PairRun& run) {
  const fokker_planck::PairEquation& equation = run.equation;
  html::ReportTable table = report_facts(
      chosen(pair_equation_facts(),
             {"kernel", "noise", "time", "gap_points", "momentum_lines", "steps", "order", "curve_error", "seconds"}),
      run, "setting");
  table.rows.insert(table.rows.begin() + 2, {{{"q"}, {fmt::format("{:g}, {:g}", equation.q1, equation.q2)}},
                                             {{"p"}, {fmt::format("{:g}, {:g}", equation.p1, equation.p2)}}});
  return table;
}

html::ReportTable grids(const fokker_planck::PairCrossing& crossing) {
  html::ReportTable table{
      {"grid", "probability", "change"}, {}, "Each grid has half the spacing and time step of the one before."};
  for (std::size_t i = 0; i < crossing.grids.size(); ++i)
    table.rows.push_back({{fmt::to_string(i + 1)},
                          {report_number(crossing.grids[i], 6)},
                          {i > 0 ? fmt::format("{:.1e}", crossing.grids[i] - crossing.grids[i - 1]) : ""}});
  return table;
}

html::ReportTable over_time(const PairRun& run) {
  const fokker_planck::PairCrossing& crossing = run.crossing;
  html::ReportTable table{{"time", "probability"}, {}, "crossing.csv has all times."};
  if (!run.sampled.empty()) table.header.insert(table.header.end(), {"sampled", "standard error"});
  const std::size_t step = (crossing.times.size() + kMostTimes - 2) / (kMostTimes - 1);
  for (std::size_t i = 0; i < crossing.times.size(); i += step) {
    std::vector<html::ReportCell> row = {{report_number(crossing.times[i])}, {report_number(crossing.curve[i], 5)}};
    if (!run.sampled.empty()) {
      const double error = run.sampled[i].known_error();
      row.push_back({report_number(run.sampled[i].value)});
      row.push_back({report_number(error, 2)});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

html::HtmlReport pair_report(const PairRun& run, const std::vector<std::string>& warnings,
                             const std::vector<std::string>& notes, const std::filesystem::path& picture) {
  html::HtmlReport report = new_report("Do two landmarks on a line cross?", lead(run), warnings, notes);
  add_still(report, "Over time", picture);
  report.sections.push_back({"Numbers", {settings(run), grids(run.crossing), over_time(run)}});
  return report;
}

}  // namespace pulson
