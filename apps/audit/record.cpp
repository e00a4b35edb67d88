#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "audit/facts.hpp"
#include "pulson/core/version.hpp"
#include "records/record_text.hpp"
#include "results.hpp"
#include "shell/options.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

// Labels, or numbers where there are none.
Json landmarks_json(const FindingRow& row) {
  const Landmarks& shape = row.shape();
  Json list = Json::array();
  for (const int a : row.finding->landmarks)
    list.push_back(shape.labels.empty() ? Json(shape.number(a)) : Json(landmark_name(shape, a)));
  return list;
}

Json finding_json(const FindingRow& row) {
  Json json;
  for (const Fact<FindingRow>& fact : finding_facts()) {
    add_fact(json, fact.key, fact.value(row));
    if (fact.key == "landmarks") json["landmarks"] = landmarks_json(row);
    if (is_missing(fact.value(row))) json[std::string(fact.key)] = nullptr;
  }
  return json;
}

}  // namespace

std::string audit_json(const AuditResults& results) {
  Json json{{"specimens", results.judged_count()},
            {"landmarks", results.shapes.front().shape.count()},
            {"prior", 1 / results.audit.shapes_per_error},
            {"judged_by", results.is_of_cohort ? "the others" : results.shapes.front().shape.source},
            {"findings", Json::array()},
            {"not_judged", Json::array()}};
  for (const FindingRow& row : finding_rows(results)) json["findings"].push_back(finding_json(row));
  for (const ShapeNotJudged& shape : results.not_judged)
    json["not_judged"].push_back({{"specimen", shape.specimen}, {"source", shape.source}, {"reason", shape.reason}});
  json["notes"] = in_option_words(results.notes);
  json["version"] = version();
  return records::record_text(json);
}

std::string findings_csv(const AuditResults& results) { return facts_csv(finding_facts(), finding_rows(results)); }

}  // namespace pulson
