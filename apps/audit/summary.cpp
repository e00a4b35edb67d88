#include <algorithm>

#include <fmt/format.h>

#include "audit/facts.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/tables.hpp"

namespace pulson {
namespace {

// Columns that a terminal has room for. Powers of ten are read faster than digits.
std::vector<std::vector<std::string>> finding_table(const std::vector<FindingRow>& rows) {
  Facts<FindingRow> facts =
      chosen(finding_facts(), {"specimen", "kind", "landmarks", "odds", "distance_before", "distance_after", "detail"});
  facts[2].value = [](const FindingRow& row) { return some_names(row.shape(), row.finding->landmarks); };
  facts[3].value = [](const FindingRow& row) { return odds_text(row.finding->log_odds); };
  if (std::all_of(rows.begin(), rows.end(), [](const FindingRow& row) { return detail_of(*row.finding).empty(); }))
    facts.pop_back();
  for (Fact<FindingRow>& fact : facts)
    if (fact.key == "odds") fact.format = "";
  return text_table(facts, rows);
}

}  // namespace

std::string audit_verdict(const AuditResults& results) {
  const std::size_t accused = results.accused_count(), judged = results.judged_count();
  const std::string landmarks = counted(results.shapes.front().shape.count(), "landmark");
  if (judged == 1) {
    const std::string& name = results.shapes.back().shape.name;
    return accused == 0 ? fmt::format("nothing looks wrong with {} of {}", name, landmarks)
                        : fmt::format("{} of {} looks wrong", name, landmarks);
  }
  if (accused == 0) return fmt::format("nothing looks wrong with {} of {}", counted(judged, "specimen"), landmarks);
  return fmt::format("{} of {} of {} look{} wrong", accused, counted(judged, "specimen"), landmarks,
                     accused == 1 ? "s" : "");
}

std::string prior_text(const AuditResults& results) {
  return fmt::format("one shape in {:.0f} has an error", results.audit.shapes_per_error);
}

void print_repeats(const AuditResults& results) {
  const audit::Repeatability& repeats = *results.repeats;
  const Landmarks& first = results.shapes.front().shape;
  int best = 0, worst = 0;
  const double least = repeats.sigmas.minCoeff(&best), most = repeats.sigmas.maxCoeff(&worst);
  print_text(
      "repeats    {} of {}: sigma {:.3g}, {:.2g} % of the diameter; from {:.3g} at landmark {} to {:.3g} at {}\n",
      counted(repeats.shapes, "shape"), counted(repeats.specimens, "specimen"), repeats.sigma,
      100 * repeats.sigma / diameter(first.points), least, first.describe(best), most, first.describe(worst));
  if (const auto& bias = repeats.bias)
    print_text("bias       {} of {} differ by {:.3g} (p = {:.2g}, {} permutations)\n",
               counted(bias->sessions, "session"), counted(bias->specimens, "specimen"), bias->distance, bias->p,
               bias->permutations);
}

void print_audit(const AuditResults& results) {
  print_text("audit      {}\n", audit_verdict(results));
  print_text("prior      {}; judged by {}\n", prior_text(results),
             results.is_of_cohort ? "the other shapes" : results.shapes.front().shape.source);
  if (!results.audit.findings.empty()) print_table(finding_table(finding_rows(results)));
  if (results.repeats) print_repeats(results);
  for (const ShapeNotJudged& shape : results.not_judged)
    print_text("not judged {} ({}): {}\n", shape.specimen, shape.source, shape.reason);
}

}  // namespace pulson
