#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "audit/facts.hpp"
#include "core/csv_table.hpp"
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
  add_facts(json, finding_facts(), row);
  json["landmarks"] = landmarks_json(row);
  return json;
}

Json repeats_json(const AuditResults& results) {
  const audit::Repeatability& repeats = *results.repeats;
  Json json{{"specimens", repeats.specimens}, {"shapes", repeats.shapes}, {"sigma", repeats.sigma}};
  if (const auto& bias = repeats.bias)
    json["bias"] = {{"sessions", bias->sessions},
                    {"specimens", bias->specimens},
                    {"distance", bias->distance},
                    {"p", bias->p},
                    {"permutations", bias->permutations}};
  json["landmarks"] = Json::array();
  for (const RepeatRow& row : repeat_rows(results)) {
    Json landmark;
    add_facts(landmark, repeat_facts(), row);
    Json& covariance = landmark["covariance"] = Json::array();
    for (const auto& line : repeats.covariances[static_cast<std::size_t>(row.landmark)].rowwise())
      covariance.push_back(std::vector<double>(line.begin(), line.end()));
    json["landmarks"].push_back(std::move(landmark));
  }
  return json;
}

}  // namespace

std::string covariances_csv(const AuditResults& results) {
  const std::vector<Eigen::MatrixXd>& covariances = results.repeats->covariances;
  const Eigen::Index d = covariances.front().rows();
  text::CsvTable table;
  table.word("landmark");
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index j = i; j < d; ++j) table.word(fmt::format("{}{}", "xyz"[i], "xyz"[j]));
  table.end_row();
  for (const RepeatRow& row : repeat_rows(results)) {
    table.text(landmark_name(results.shapes.front().shape, row.landmark));
    const Eigen::MatrixXd& covariance = covariances[static_cast<std::size_t>(row.landmark)];
    for (Eigen::Index i = 0; i < d; ++i)
      for (Eigen::Index j = i; j < d; ++j) table.number(covariance(i, j));
    table.end_row();
  }
  return std::move(table).take();
}

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
  if (results.repeats) json["repeats"] = repeats_json(results);
  json["notes"] = in_option_words(results.notes);
  json["version"] = version();
  return records::record_text(json);
}

std::string findings_csv(const AuditResults& results) { return facts_csv(finding_facts(), finding_rows(results)); }

}  // namespace pulson
