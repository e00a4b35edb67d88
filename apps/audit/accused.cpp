#include "accused.hpp"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "draw/correction_picture.hpp"
#include "pulson/core/alignment.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using audit::Finding;
using audit::Problem;

constexpr std::size_t kMostDrawn = 40;

// The findings of each accused shape, in their order.
std::map<int, std::vector<const Finding*>> findings_by_shape(const audit::Audit& found) {
  std::map<int, std::vector<const Finding*>> by_shape;
  for (const Finding& finding : found.findings) by_shape[finding.specimen].push_back(&finding);
  return by_shape;
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

}  // namespace

void add_accused(html::HtmlReport& report, const std::vector<Landmarks>& shapes, const audit::Audit& found) {
  Landmarks reference = shapes.front();
  reference.points = found.reference;
  const auto accused = findings_by_shape(found);
  std::size_t drawn = 0;
  for (const auto& [place, findings] : accused) {
    if (drawn == kMostDrawn) break;
    ++drawn;
    const Landmarks& shape = shapes[static_cast<std::size_t>(place)];
    html::ReportSection section{shape.name, {}};
    for (const Finding* finding : findings)
      section.blocks.emplace_back(html::ReportParagraph{sentence_of(*finding, shape)});
    if (const auto picture = picture_of(shape, reference, findings))
      section.blocks.emplace_back(
          html::ReportPicture{.picture = html::EncodedPicture{html::MediaType::kSvg, correction_svg(*picture)},
                              .caption = fmt::format("{} ({})", shape.name, shape.source),
                              .narrow = html::EncodedPicture{html::MediaType::kSvg, correction_svg(*picture, true)}});
    report.sections.push_back(std::move(section));
  }
  if (drawn < accused.size())
    report.sections.push_back({"And more",
                               {html::ReportParagraph{fmt::format("{} more specimens look wrong and are not drawn.",
                                                                  accused.size() - drawn)}}});
}

}  // namespace pulson
