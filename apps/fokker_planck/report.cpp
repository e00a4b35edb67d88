#include "report.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/undefined.hpp"
#include "shell/probability_text.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

constexpr std::size_t kMostTimes = 51;  // of the table

std::string lead(const PairFacts& facts) {
  const fokker_planck::PairCrossing& crossing = facts.crossing;
  std::string text = fmt::format(
      "By t = {:.4g} the pair has changed its order with probability {}, by the pair equation on a grid, with "
      "the stated error.",
      facts.equation.time, value_with_error(crossing.probability, crossing.error));
  if (!facts.sampled.empty()) {
    text += fmt::format(" {} sample paths: {}.", facts.samples, facts.sampled.back().text());
  }
  if (!crossing.converged) text += " The tolerance was not reached.";
  return text;
}

html::ReportTable settings(const PairFacts& facts) {
  const fokker_planck::PairEquation& equation = facts.equation;
  FactTable table("setting");
  table.add("kernel", equation.kernel.spec(4));
  table.add("noise", facts.noise);
  table.add("q", fmt::format("{:g}, {:g}", equation.q1, equation.q2));
  table.add("p", fmt::format("{:g}, {:g}", equation.p1, equation.p2));
  table.add("time", equation.time);
  table.add("gaps of the finest grid", fmt::to_string(facts.crossing.gap_points));
  table.add("momenta of the finest grid", fmt::to_string(facts.crossing.momentum_lines));
  table.add("steps of the finest grid", fmt::to_string(facts.crossing.steps));
  table.add("observed order", facts.crossing.order > 0 ? report_number(facts.crossing.order, 3) : "–");
  table.add("largest change of the curve", facts.crossing.curve_error);
  table.add("seconds", fmt::format("{:.2f}", facts.crossing.seconds));
  return std::move(table).table();
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

html::ReportTable over_time(const PairFacts& facts) {
  const fokker_planck::PairCrossing& crossing = facts.crossing;
  html::ReportTable table{{"time", "probability"}, {}, "crossing.csv has all times."};
  if (!facts.sampled.empty()) table.header.insert(table.header.end(), {"sampled", "standard error"});
  const std::size_t step = (crossing.times.size() + kMostTimes - 2) / (kMostTimes - 1);
  for (std::size_t i = 0; i < crossing.times.size(); i += step) {
    std::vector<html::ReportCell> row = {{report_number(crossing.times[i])}, {report_number(crossing.curve[i], 5)}};
    if (!facts.sampled.empty()) {
      const double error = facts.sampled[i].known_error();
      row.push_back({report_number(facts.sampled[i].value)});
      row.push_back({report_number(error, 2)});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

double SampledProbability::known_error() const { return value > 0 && value < 1 ? standard_error : kUndefined; }

std::string SampledProbability::text() const { return probability_text(*this, paths); }

html::HtmlReport pair_report(const PairFacts& facts, const std::vector<std::string>& warnings,
                             const std::vector<std::string>& notes, const std::filesystem::path& picture) {
  html::HtmlReport report = new_report("Do two landmarks on a line cross?", lead(facts), warnings, notes);
  add_still(report, "Over time", picture);
  report.sections.push_back({"Numbers", {settings(facts), grids(facts.crossing), over_time(facts)}});
  return report;
}

}  // namespace pulson
