#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "atlas/facts.hpp"
#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "pulson/core/version.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "records/record_text.hpp"
#include "shell/options.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;
using records::defined_or_null;

Json number_list(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

// [landmark][axis]
Json landmarks(const Points& points) {
  Json rows = Json::array();
  for (const auto& point : points.colwise()) rows.push_back(number_list(point));
  return rows;
}

// [row][column]
Json rows_of(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (const auto& row : matrix.rowwise()) rows.push_back(number_list(row.transpose()));
  return rows;
}

Json specimen_json(const SpecimenRow& row) {
  const AtlasResults& results = *row.results;
  const std::size_t i = row.specimen;
  const cohort::AtlasSpecimen& specimen = results.atlas.specimens[i];
  Json json{{"name", results.names[i]}, {"source", specimen.shape.source}};
  for (const Fact<SpecimenRow>& fact : specimen_facts())
    if (fact.key != "specimen") add_fact(json, fact.key, fact.value(row));
  if (specimen.weights.size() > 0) json["weights"] = number_list(specimen.weights);
  for (const int a : specimen.suspects()) json["suspects"].push_back(a + 1);
  if (!results.groups.empty()) json["group"] = results.groups[i];
  if (!results.covariate.empty() && std::isfinite(results.covariate[i]))
    json[results.covariate_name] = results.covariate[i];
  if (!results.predicted.empty() && !results.predicted[i].landmarks.empty()) {
    json["predicted"] = Json::array();
    const cohort::PredictedLandmarks& predicted = results.predicted[i];
    for (std::size_t k = 0; k < predicted.landmarks.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      json["predicted"].push_back({{"landmark", predicted.landmarks[k] + 1},
                                   {"position", number_list(predicted.positions.col(column))},
                                   {"half_width_90", defined_or_null(number_list(predicted.half_widths.col(column)))}});
    }
  }
  return json;
}

// The test of a model of one term, by momenta.
Json test_json(const ShapeModel& model) {
  const cohort::TermTest& found = model.momenta.terms.front();
  return {{"r_squared", defined_or_null(found.r_squared)},
          {"f", defined_or_null(found.f)},
          {"p_value", defined_or_null(found.p_value)},
          {"permutations", model.momenta.permutations}};
}

Json regression_json(const AtlasResults& results) {
  const cohort::MomentumRegression& found = *results.regression;
  Json json{{"covariate", results.covariate_name}, {"specimens", found.specimens}, {"mean", found.mean}};
  json.update(test_json(results.model_of_covariate()));
  json["slope"] = landmarks(found.slope);
  json["intercept"] = landmarks(found.intercept);
  return json;
}

Json groups_json(const AtlasResults& results) {
  const ShapeModel& model = results.model_of_groups();
  Json json{{"names", Json::array()}, {"sizes", Json::array()}};
  for (const cohort::GroupMean& mean : results.means) {
    json["names"].push_back(mean.name);
    json["sizes"].push_back(mean.size);
  }
  json.update(test_json(model));
  json["pairs"] = Json::array();
  const auto& groups = model.design.terms.front().groups;
  for (const cohort::PairTest& pair : model.momenta.pairs)
    json["pairs"].push_back(
        {{"groups",
          {groups[static_cast<std::size_t>(pair.first)].name, groups[static_cast<std::size_t>(pair.second)].name}},
         {"distance", pair.distance},
         {"p_value", defined_or_null(pair.p_value)}});
  json["means"] = Json::array();
  for (const cohort::GroupMean& mean : results.means) json["means"].push_back(landmarks(mean.momenta));
  return json;
}

}  // namespace

bool AtlasResults::converged() const {
  bool all = atlas.converged;
  for (const cohort::AtlasSpecimen& specimen : atlas.specimens) all = all && specimen.converged;
  return all;
}

std::string atlas_json(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  Json json;
  add_facts(json, atlas_facts(), results);
  if (!atlas.loss.empty()) json["loss"] = atlas.loss;
  json["template"] = landmarks(atlas.template_shape.points);
  json["specimens"] = Json::array();
  json["modes"] = {{"eigenvalues", number_list(results.modes.eigenvalues)}, {"scores", rows_of(results.modes.scores)}};
  json["procrustes"] = {{"mean", landmarks(results.procrustes.mean)},
                        {"eigenvalues", number_list(results.procrustes.modes.eigenvalues)},
                        {"scores", rows_of(results.procrustes.modes.scores)}};
  if (const std::vector<int>& common = results.procrustes.landmarks; std::ssize(common) < atlas.template_shape.count())
    for (const int a : common) json["procrustes"]["landmarks"].push_back(a + 1);
  for (const SpecimenRow& row : specimen_rows(results)) json["specimens"].push_back(specimen_json(row));
  if (results.regression) json["regression"] = regression_json(results);
  if (!results.means.empty()) json["groups"] = groups_json(results);
  if (!results.models.empty()) json["models"] = models_json(results);
  json["notes"] = in_option_words(results.notes);
  json["version"] = version();
  return records::record_text(json);
}

std::string specimens_csv(const AtlasResults& results) { return facts_csv(specimen_facts(), specimen_rows(results)); }

std::string scores_csv(const AtlasResults& results, const Eigen::MatrixXd& scores) {
  text::CsvTable table;
  table.word("specimen");
  if (!results.groups.empty()) table.word("group");
  if (!results.covariate.empty()) table.text(results.covariate_name);
  for (Eigen::Index k = 0; k < scores.cols(); ++k) table.word(fmt::format("PC{}", k + 1));
  table.end_row();
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    table.text(results.names[i]);
    if (!results.groups.empty()) table.text(results.groups[i]);
    if (!results.covariate.empty())
      table.number(std::isfinite(results.covariate[i]) ? results.covariate[i] : text::kMissing);
    table.numbers(scores.row(static_cast<Eigen::Index>(i))).end_row();
  }
  return std::move(table).take();
}

std::string modes_csv(const AtlasResults& results) { return facts_csv(mode_facts(), mode_rows(results)); }

namespace {

// Header cells of axes, each behind `prefix`.
void add_axes(text::CsvTable& table, std::string_view prefix, int dimension) {
  for (int axis = 0; axis < dimension; ++axis) table.word(fmt::format("{}{}", prefix, text::kAxisLetters[axis]));
}

}  // namespace

std::string predicted_csv(const AtlasResults& results) {
  const Landmarks& shape = results.atlas.template_shape;
  text::CsvTable table;
  table.words({"specimen", "landmark"});
  add_axes(table, "", shape.dimension());
  add_axes(table, "half_width_90_", shape.dimension());
  table.end_row();
  for (std::size_t i = 0; i < results.predicted.size(); ++i) {
    const cohort::PredictedLandmarks& predicted = results.predicted[i];
    for (std::size_t k = 0; k < predicted.landmarks.size(); ++k) {
      const int a = predicted.landmarks[k];
      table.text(results.names[i]);
      if (shape.labels.empty())
        table.number(shape.number(a));
      else
        table.text(shape.labels[static_cast<std::size_t>(a)]);
      const auto column = static_cast<Eigen::Index>(k);
      table.numbers(predicted.positions.col(column)).numbers(predicted.half_widths.col(column)).end_row();
    }
  }
  return std::move(table).take();
}

std::string momenta_csv(const AtlasResults& results) {
  const Landmarks& shape = results.atlas.template_shape;
  text::CsvTable table;
  table.words({"specimen", "landmark"});
  add_axes(table, "p", shape.dimension());
  table.end_row();
  for (std::size_t i = 0; i < results.names.size(); ++i)
    for (int a = 0; a < shape.count(); ++a)
      table.text(results.names[i]).number(shape.number(a)).numbers(results.atlas.specimens[i].momenta.col(a)).end_row();
  return std::move(table).take();
}

std::string momenta_npy(const AtlasResults& results) {
  std::vector<double> all;
  for (const cohort::AtlasSpecimen& specimen : results.atlas.specimens)
    all.insert(all.end(), specimen.momenta.reshaped().begin(), specimen.momenta.reshaped().end());
  const Points& q0 = results.atlas.template_shape.points;
  return formats::npy_bytes(
      all, {results.names.size(), static_cast<std::size_t>(q0.cols()), static_cast<std::size_t>(q0.rows())});
}

// The shapes of the regression at the values shown, a landmark in each row.
std::string regression_csv(const AtlasResults& results) {
  const Landmarks& shape = results.atlas.template_shape;
  text::CsvTable table;
  table.text(results.covariate_name).word("landmark");
  add_axes(table, "", shape.dimension());
  table.end_row();
  for (const double value : results.shown_values) {
    const Points q = results.atlas.geodesic(results.regression->momenta(value)).final().q;
    for (int a = 0; a < shape.count(); ++a) table.numbers(value, shape.number(a)).numbers(q.col(a)).end_row();
  }
  return std::move(table).take();
}

}  // namespace pulson
