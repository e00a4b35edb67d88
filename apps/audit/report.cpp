#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "audit/accused.hpp"
#include "audit/facts.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

using audit::Finding;
using audit::Problem;

html::ReportTable findings_table(const std::vector<FindingRow>& rows) {
  Facts<FindingRow> facts = chosen(finding_facts(), {"specimen", "kind", "landmarks", "detail", "odds",
                                                     "distance_before", "distance_after", "mended"});
  facts[2].value = [](const FindingRow& row) { return some_names(row.shape(), row.finding->landmarks); };
  facts[4].value = [](const FindingRow& row) {  // digits beyond the power of ten say nothing
    const double tens = row.finding->log_odds / std::log(10.0);
    if (!std::isfinite(tens)) return std::string("certain");
    return tens < 4 ? fmt::format("{:.0f}", std::pow(10, tens)) : fmt::format("1e{:.0f}", tens);
  };
  facts[4].format = "";
  return report_table(facts, rows,
                      "Odds are those of this error against none, with the prior. Distances are root mean squares over "
                      "the landmarks after a similarity, before and after this is mended. Click a column heading to "
                      "sort.");
}

html::ReportTable table_of_not_judged(const AuditResults& results) {
  html::ReportTable table{{"specimen", "file", "why"}, {}, ""};
  for (const ShapeNotJudged& shape : results.not_judged)
    table.rows.push_back({{shape.specimen}, {shape.source}, {shape.reason}});
  return table;
}

std::string as_sentence(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text + ".";
}

}  // namespace

html::HtmlReport audit_report(const AuditResults& results, bool is_drawn) {
  html::HtmlReport report = new_report(
      fmt::format("Audit of {}", counted(results.judged_count(), "specimen")),
      fmt::format("{} Each is judged by {}; prior: {}.", as_sentence(audit_verdict(results)),
                  results.is_of_cohort ? "the others" : results.shapes.front().shape.source, prior_text(results)),
      {}, results.notes);
  if (!results.audit.findings.empty()) report.sections.push_back({"Findings", {findings_table(finding_rows(results))}});
  if (results.repeats)
    report.sections.push_back(
        {"Error of digitising",
         {report_table(repeat_facts(), repeat_rows(results),
                       fmt::format("From {} of {} that were digitised more than once: sigma {:.3g} for all landmarks.",
                                   counted(results.repeats->shapes, "shape"),
                                   counted(results.repeats->specimens, "specimen"), results.repeats->sigma))}});
  if (!results.not_judged.empty()) report.sections.push_back({"Not judged", {table_of_not_judged(results)}});
  const Landmarks& first = results.shapes.front().shape;
  std::vector<Landmarks> shapes;
  for (const auto& judged : results.shapes) shapes.push_back(judged.shape);
  if (is_drawn && first.dimension() > 1 && results.audit.reference.cols() == first.count() &&
      results.audit.reference.allFinite())
    add_accused(report, shapes, results.audit);
  return report;
}

}  // namespace pulson
