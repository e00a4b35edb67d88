#include "verdicts_json.hpp"

#include <cmath>
#include <string>

namespace pulson::records {

formats::Json numbers_of(const Landmarks& shape, const std::vector<int>& landmarks) {
  formats::Json numbers = formats::Json::array();
  for (const int a : landmarks) numbers.push_back(shape.number(a));
  return numbers;
}

namespace {

formats::Json verdicts_json(const matching::Registration& registration, const matching::LandmarkVerdicts& verdicts) {
  const auto value = [](const Eigen::VectorXd& values, int a) {
    return values.size() > 0 && std::isfinite(values[a]) ? formats::Json(values[a]) : formats::Json();
  };
  formats::Json list = formats::Json::array();
  for (int a = 0; a < registration.source.count(); ++a)
    list.push_back({{"landmark", registration.source.number(a)},
                    {"residual_over_sigma", value(verdicts.residual, a)},
                    {"predicted_over_sigma", value(verdicts.predicted, a)},
                    {"action_share", value(verdicts.action_share, a)},
                    {"weight", value(verdicts.weight, a)}});
  return list;
}

std::string word_name(matching::PredictionWord word) {
  using enum matching::PredictionWord;
  return word == kNoCommonPart ? "no common part"
         : word == kDoubted    ? "doubted"
         : word == kPredicted  ? "predicted"
                               : "undetermined";
}

formats::Json prediction_json(const matching::Registration& registration, const RegistrationFacts& facts) {
  const auto& prediction = facts.verdicts.prediction;
  formats::Json json = {{"word", word_name(facts.verdicts.word)},
                        {"doubted", numbers_of(registration.source, facts.verdicts.doubted())}};
  if (!facts.finding.empty()) json["finding"] = facts.finding;
  if (!prediction) return json;
  json["error"] = prediction->predictions.error();
  json["alignment_error"] = prediction->aligned.error();
  json["limit"] = prediction->limit;
  return json;
}

formats::Json target_topology_json(const matching::Registration& registration, const TopologyCounts& counts) {
  formats::Json json = formats::Json::object();
  if (counts.target_inversions)
    json = {{"order_inversions", *counts.target_inversions}, {"exchanged", *counts.exchanged_as_target}};
  if (counts.target_flips) {
    json["flipped_triangles"] = formats::Json::array();
    for (const std::array<int, 3>& t : *counts.target_flips)
      json["flipped_triangles"].push_back(numbers_of(registration.source, {t.begin(), t.end()}));
  }
  return json;
}

}  // namespace

void add_verdicts(const matching::Registration& registration, const RegistrationFacts& facts, formats::Json& json) {
  json["verdicts"] = verdicts_json(registration, facts.verdicts);
  json["prediction"] = prediction_json(registration, facts);
  json["concentrated"] = numbers_of(registration.source, facts.verdicts.concentrated);
  json["target_topology"] = target_topology_json(registration, facts.counts);
}

}  // namespace pulson::records
