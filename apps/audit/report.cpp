#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "audit/facts.hpp"
#include "draw/correction_picture.hpp"
#include "pulson/core/alignment.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

using audit::Finding;
using audit::Problem;

constexpr std::size_t kMostDrawn = 40;

// The findings of each accused shape, in their order.
std::map<int, std::vector<const Finding*>> findings_by_shape(const AuditResults& results) {
  std::map<int, std::vector<const Finding*>> by_shape;
  for (const Finding& finding : results.audit.findings) by_shape[finding.specimen].push_back(&finding);
  return by_shape;
}

Landmarks drawn_reference(const AuditResults& results) {
  Landmarks reference = results.shapes.front().shape;
  reference.points = results.audit.reference;
  return reference;
}

bool is_any(const std::vector<const Finding*>& findings, std::initializer_list<Problem> problems) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding* finding) {
    return std::find(problems.begin(), problems.end(), finding->problem) != problems.end();
  });
}

// Another size would leave one of the two a dot: only what is mended is drawn over the others.
bool is_drawn_mended_alone(const std::vector<const Finding*>& findings) { return is_any(findings, {Problem::kUnit}); }

// Landmarks that are named. Another order of an outline concerns all of it.
std::vector<int> concerned_by(const std::vector<const Finding*>& findings, int count) {
  std::vector<int> landmarks;
  for (const Finding* finding : findings)
    if (finding->landmarks.size() == 1 && is_any({finding}, {Problem::kReversed, Problem::kShifted}))
      for (int a = 0; a < count; ++a) landmarks.push_back(a);
    else
      landmarks.insert(landmarks.end(), finding->landmarks.begin(), finding->landmarks.end());
  std::sort(landmarks.begin(), landmarks.end());
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  return landmarks;
}

bool can_be_aligned(const Points& points, const Points& reference) {
  int both = 0;
  for (Eigen::Index a = 0; a < points.cols(); ++a)
    if (points.col(a).allFinite() && reference.col(a).allFinite()) ++both;
  return both > 2 && diameter(points) > 0;
}

Points posed(const Points& points, const Points& by, const Points& reference) {
  return align(by, reference, AlignmentKind::kSimilarity).apply(points);
}

std::string mended_heading(const Points& shape, const Points& corrected) {
  const auto missing = std::ssize(incomplete_points(corrected)) - std::ssize(incomplete_points(shape));
  return missing > 0 ? fmt::format("mended, {} set as missing", counted(missing, "landmark")) : "mended";
}

// The shape on the template, in the pose of what is mended, which is not led astray by what is wrong. A mirror image
// has no such pose.
std::optional<draw::CorrectionPicture> picture_of(const Landmarks& shape, const Landmarks& reference,
                                                  const std::vector<const Finding*>& findings) {
  draw::CorrectionPicture picture{reference, shape.points, {}, concerned_by(findings, shape.count()), "as it is", ""};
  for (const Finding* finding : findings)
    if (finding->corrected.size() > 0) picture.corrected = finding->corrected;
  picture.corrected_heading = mended_heading(picture.shape, picture.corrected);
  if (is_drawn_mended_alone(findings)) {
    picture.shape = std::exchange(picture.corrected, {});
    picture.shape_heading = "in the size of the others";
  }
  const Points best = picture.corrected.size() > 0 ? picture.corrected : picture.shape;
  if (!can_be_aligned(best, reference.points)) return std::nullopt;
  const bool is_alone = is_any(findings, {Problem::kMirrored, Problem::kAxes});
  picture.shape = posed(picture.shape, is_alone ? picture.shape : best, reference.points);
  if (picture.corrected.size() > 0) picture.corrected = posed(picture.corrected, best, reference.points);
  return picture;
}

std::string sentence_of(const Finding& finding, const Landmarks& shape) {
  std::string text = describe(finding, shape);
  if (!text.empty() && text.front() >= 'a' && text.front() <= 'z') text.front() -= 'a' - 'A';
  return text.ends_with('?') ? text : text + ".";
}

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

void add_drawings(html::HtmlReport& report, const AuditResults& results) {
  const Landmarks reference = drawn_reference(results);
  const auto accused = findings_by_shape(results);
  std::size_t drawn = 0;
  for (const auto& [place, findings] : accused) {
    if (drawn == kMostDrawn) break;
    ++drawn;
    const Landmarks& shape = results.shapes[static_cast<std::size_t>(place)].shape;
    html::ReportSection section{shape.name, {}};
    for (const Finding* finding : findings)
      section.blocks.emplace_back(html::ReportParagraph{sentence_of(*finding, shape)});
    if (const auto picture = picture_of(shape, reference, findings))
      section.blocks.emplace_back(
          html::ReportPicture{html::EncodedPicture{html::MediaType::kSvg, correction_svg(*picture)},
                              fmt::format("{} ({})", shape.name, shape.source)});
    report.sections.push_back(std::move(section));
  }
  if (drawn < accused.size())
    report.sections.push_back({"And more",
                               {html::ReportParagraph{fmt::format("{} more specimens are in the table and not drawn.",
                                                                  accused.size() - drawn)}}});
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
  if (is_drawn && first.dimension() > 1 && results.audit.reference.cols() == first.count() &&
      results.audit.reference.allFinite())
    add_drawings(report, results);
  return report;
}

}  // namespace pulson
