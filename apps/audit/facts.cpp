#include "audit/facts.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/text.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using audit::Finding;
using audit::Problem;

std::vector<std::string> landmark_names_of(const Landmarks& shape, const std::vector<int>& landmarks) {
  std::vector<std::string> names;
  for (const int landmark : landmarks) names.push_back(landmark_name(shape, landmark));
  return names;
}

bool is_certain(const Finding& finding) { return std::isinf(finding.log_odds); }

// Of a size or of missing landmarks there is no distance.
std::optional<double> distance_of(const Finding& finding, double distance) {
  return finding.before == 0 && finding.after == 0 ? std::nullopt : std::optional(distance);
}

std::optional<double> odds_of(const Finding& finding) { return defined(std::exp(finding.log_odds)); }

}  // namespace

std::string detail_of(const Finding& finding) {
  if (finding.problem == Problem::kUnit) return fmt::format("{:.3g} times as large", finding.factor);
  return finding.slip;
}

std::string some_names(const Landmarks& shape, const std::vector<int>& landmarks) {
  constexpr std::size_t kMost = 8;
  return text::first_of(landmark_names_of(shape, landmarks), kMost);
}

const Facts<FindingRow>& finding_facts() {
  using R = FindingRow;
  static const Facts<R> facts = {
      {"specimen", "specimen", "name as given", "", [](const R& r) { return r.shape().name; }},
      {"kind", "what",
       "exchanged, moved, reversed, shifted, mirrored, zero, undigitised, unit, axes, unordered, foreign", "",
       [](const R& r) { return std::string(problem_name(r.finding->problem)); }},
      {"landmarks", "landmarks",
       "those concerned, by name, else counted from 1; of an outline that begins elsewhere the "
       "one it begins at",
       "",
       [](const R& r) {
         return fmt::format("{}", fmt::join(landmark_names_of(r.shape(), r.finding->landmarks), "; "));
       }},
      {"log_ratio", "log ratio",
       "likelihood with this mended over that without, natural logarithm; NA where no model "
       "is needed",
       "{:.4g}", [](const R& r) { return defined(is_certain(*r.finding) ? text::kMissing : r.finding->log_ratio); }},
      {"odds", "odds", "of this error against none; NA where they are certain, or more than 1e308", "{:.4g}",
       [](const R& r) { return odds_of(*r.finding); }},
      {"distance_before", "rms before",
       "root mean square distance of the landmarks from what they are judged by, after a "
       "similarity, length units",
       "{:.4g}", [](const R& r) { return distance_of(*r.finding, r.finding->before); }},
      {"distance_after", "after", "the same with this mended", "{:.4g}",
       [](const R& r) { return distance_of(*r.finding, r.finding->after); }},
      {"detail", "detail", "of moved: what was probably typed; of unit: the size over that of most others", "",
       [](const R& r) { return detail_of(*r.finding); }},
      {"mended", "mended", "whether --fix mends it", "", [](const R& r) { return r.finding->corrected.size() > 0; }}};
  return facts;
}

const Facts<RepeatRow>& repeat_facts() {
  using R = RepeatRow;
  static const Facts<R> facts = {
      {"landmark", "landmark", "its label, or its number from 1", "",
       [](const R& r) { return landmark_name(r.results->shapes.front().shape, r.landmark); }},
      {"sigma", "sigma", "standard deviation of its coordinates from one digitising to the next, length units",
       "{:.4g}", [](const R& r) { return r.results->repeats->sigmas[r.landmark]; }},
      {"bias", "bias", "root mean square distance of the sessions' means from their mean, length units", "{:.4g}",
       [](const R& r) {
         const auto& bias = r.results->repeats->bias;
         return bias ? defined(bias->distances[r.landmark]) : std::nullopt;
       }}};
  return facts;
}

std::vector<RepeatRow> repeat_rows(const AuditResults& results) {
  std::vector<RepeatRow> rows;
  if (!results.repeats) return rows;
  for (int a = 0; a < results.shapes.front().shape.count(); ++a) rows.push_back({&results, a});
  return rows;
}

std::vector<FindingRow> finding_rows(const AuditResults& results) {
  std::vector<FindingRow> rows;
  for (const Finding& finding : results.audit.findings) rows.push_back({&results, &finding});
  return rows;
}

}  // namespace pulson
