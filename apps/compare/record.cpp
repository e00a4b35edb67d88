#include "record.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compare/facts.hpp"
#include "core/csv_table.hpp"
#include "pulson/core/version.hpp"
#include "records/record_text.hpp"
#include "sentences.hpp"
#include "shell/options.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;
using records::defined_or_null;

Json estimate(const Estimate& estimate) {
  return defined_or_null({{"value", estimate.value}, {"standard_error", estimate.standard_error}});
}

Json numbers(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

Json shape_addresses(const std::vector<Landmarks>& shapes) {
  Json addresses = Json::array();
  for (const Landmarks& shape : shapes) addresses.push_back(shape.source);
  return addresses;
}

Json shape_names(const std::vector<Landmarks>& shapes) {
  Json names = Json::array();
  for (const Landmarks& shape : shapes) names.push_back(shape.name);
  return names;
}

// 0 where noise vanishes.
double shown_value(const compare::FittedNumber& number) {
  return number.vanishes && number.name != "lambda" ? 0 : number.value;
}

Json fitted_json(const std::vector<compare::FittedNumber>& fitted) {
  Json all = Json::array();
  for (const compare::FittedNumber& number : fitted)
    all.push_back({{"name", number.name},
                   {"value", shown_value(number)},
                   {"log_deviation", defined_or_null(number.log_deviation)},
                   {"vanishes", number.vanishes},
                   {"interval_90", defined_or_null({number.low, number.high})},
                   {"correlation_with_sigma", defined_or_null(number.correlation_with_sigma)}});
  return all;
}

Json evidences(const compare::CohortFit& fit) {
  Json all = Json::array();
  for (const compare::ShapeFit& shape : fit.shapes) all.push_back(shape.log_evidence);
  return all;
}

Json check_json(const compare::PredictiveCheck& check) {
  return defined_or_null(
      {{"observed", check.observed}, {"interval_90", {check.low, check.high}}, {"p_value", check.p_value}});
}

Json checks_json(const compare::PredictiveChecks& checks) {
  Json json{{"cohorts", checks.cohorts},
            {"landmarks_outside", checks.outside},
            {"variances_p", checks.variances_p},
            {"first_share", check_json(checks.share)},
            {"energy_score", check_json(checks.energy)},
            {"largest_distance", check_json(checks.distance)},
            {"variances", Json::array()}};
  for (const compare::PredictiveCheck& check : checks.variances) json["variances"].push_back(check_json(check));
  return json;
}

Json model_json(const compare::Comparison& comparison, const compare::ComparedModel& model) {
  const compare::CohortSettings& settings = comparison.settings;
  const compare::CohortFit& fit = model.fit;
  Json json{{"noise", fit.noise},
            {"asked", model.noise},
            {"mode", mode_of(fit)},
            {"integrator", settings.integrator},
            {"kernel", fit.kernel},
            {"lambda", fit.lambda},
            {"sigma", fit.sigma},
            {"fitted", fitted_json(fit.fitted)},
            {"p_value_cohorts", model.bootstrapped}};
  const ModelRow row{&comparison, &model};
  Json facts;
  for (const Fact<ModelRow>& fact : model_facts())
    if (fact.key != "noise" && fact.key != "fitted" && !fact.key.starts_with("coverage") && fact.key != "energy_score")
      add_fact(facts, fact.key, fact.value(row));
  json.update(defined_or_null(std::move(facts)));
  json["difference"] = estimate(model.difference);
  json["log_evidences"] = defined_or_null(evidences(fit));
  json["importance_sampling"] = {{"standard_error", defined_or_null(fit.sampling_error)}};
  json["importance_sampling"]["samples"] = settings.importance_samples;
  json["importance_sampling"]["least_effective_part"] = fit.effective_part;
  int lost = 0;
  double distant = 0;
  for (const compare::ShapeFit& shape : fit.shapes) {
    lost += shape.lost_samples;
    distant = std::max(distant, shape.distant);
  }
  json["importance_sampling"]["lost"] = lost;
  json["importance_sampling"]["most_distant"] = distant;
  json["sampled_evidence"] = nullptr;
  if (const auto& sampled = fit.sampled) {
    json["sampled_evidence"] = estimate(sampled->total);
    json["sampled_evidence"]["rhat_max"] = defined_or_null(sampled->worst_rhat);
  }
  json["prediction"] = nullptr;
  if (const auto& prediction = model.prediction)
    json["prediction"] = {{"energy_score", prediction->energy_score},
                          {"energy_score_error", defined_or_null(prediction->energy_score_error)},
                          {"coverage_90", prediction->coverage},
                          {"coverage_90_error", defined_or_null(prediction->coverage_error)}};
  json["least_cost_paths"] = nullptr;
  if (const auto& paths = model.paths)
    json["least_cost_paths"] = {{"mode", fit.noise == "none" ? "deterministic" : "metamorphosis"},
                                {"total", estimate(paths->total)},
                                {"action", estimate(paths->action)},
                                {"rms", estimate(paths->rms)},
                                {"order_inversions", estimate(paths->order_inversions)},
                                {"flipped_triangles", estimate(paths->flipped_triangles)},
                                {"matched", paths->matched},
                                {"converged", paths->converged}};
  json["checks"] = nullptr;
  if (model.checks) json["checks"] = checks_json(*model.checks);
  json["spectrum"] = defined_or_null(numbers(model.spectrum));
  json["noise_displacement"] = numbers(model.noise_displacement);
  json["lost_samples"] = model.lost_samples;
  return json;
}

}  // namespace

std::string mode_of(const compare::CohortFit& fit) { return fit.noise == "none" ? "deterministic" : "map"; }

std::string comparison_json(const compare::Comparison& comparison, double seconds) {
  Json json{{"source", comparison.cohort.source.source},
            {"targets", shape_addresses(comparison.cohort.targets)},
            {"specimens", shape_names(comparison.cohort.targets)},
            {"alignment", alignment_name(comparison.cohort.alignment)},
            {"kernel", comparison.settings.kernel.spec()},
            {"sigma", comparison.settings.sigma.in(0)},
            {"time", comparison.settings.grid.time},
            {"steps", comparison.settings.grid.steps},
            {"coordinates", comparison.models.front().fit.coordinates},
            {"models", Json::array()},
            {"best", comparison.models[comparison.best].fit.noise},
            {"eigenvalues", numbers(comparison.eigenvalues)},
            {"observed_spectrum", defined_or_null(numbers(comparison.observed))},
            {"observed_spectrum_error", defined_or_null(numbers(comparison.observed_error))},
            {"notes", in_option_words(comparison.notes)},
            {"seconds", seconds},
            {"version", version()}};
  for (const Eigen::VectorXd& weights : comparison.cohort.weights) json["weights"].push_back(numbers(weights));
  for (const compare::ComparedModel& model : comparison.models) json["models"].push_back(model_json(comparison, model));
  json["verdict"] = {{"text", verdict(comparison)},
                     {"misfit", misfit(comparison)},
                     {"sigma", sigma_range(comparison)},
                     {"steps", steps_warning(comparison)}};
  if (comparison.profile) {
    json["sigma_profile"] = {{"sigma", numbers(comparison.profile->sigma)}, {"scores", Json::array()}};
    for (const auto& row : comparison.profile->scores.rowwise())
      json["sigma_profile"]["scores"].push_back(defined_or_null(numbers(row.transpose())));
  }
  return records::record_text(json);
}

std::string specimens_csv(const compare::CohortShapes& shapes) {
  text::CsvTable table{"shape", "centroid_size", "specimen"};
  for (const Landmarks& shape : shapes.targets)
    table.text(shape.source).number(centroid_size(shape.points)).text(shape.name).end_row();
  return std::move(table).take();
}

std::string shapes_csv(const compare::Comparison& comparison) {
  return facts_csv(shape_facts(), shape_rows(model_rows(comparison)));
}

std::string models_csv(const compare::Comparison& comparison) {
  const Facts<ModelRow> facts = chosen(model_facts(), {"log_evidence",
                                                       "laplace",
                                                       "step_error",
                                                       "difference_step_error",
                                                       "score",
                                                       "difference",
                                                       "weight",
                                                       "p_value",
                                                       "noise_share",
                                                       "greatest_noise_share",
                                                       "recognised",
                                                       "recognised_share",
                                                       "rms",
                                                       "energy",
                                                       "action",
                                                       "total",
                                                       "matched",
                                                       "order_inversions",
                                                       "flipped_triangles",
                                                       "folded_fraction",
                                                       "energy_score",
                                                       "coverage_90",
                                                       "converged"});
  const std::vector<ModelRow> rows = model_rows(comparison);
  text::CsvTable table;
  table.words({"noise", "number", "value", "low_90", "high_90", "vanishes"});
  add_header(table, facts, rows.front());
  table.end_row();
  for (const ModelRow& row : rows) {
    const auto end_row = [&] {
      add_facts(table, facts, row);
      table.end_row();
    };
    const std::vector<compare::FittedNumber>& fitted = row.model->fit.fitted;
    if (fitted.empty()) {
      table.text(row.model->noise).missing().missing().missing().missing().missing();
      end_row();
    }
    for (const compare::FittedNumber& number : fitted) {
      table.text(row.model->noise).word(number.name);
      table.numbers(shown_value(number), number.low, number.high, number.vanishes ? 1 : 0);
      end_row();
    }
  }
  return std::move(table).take();
}

std::string checks_csv(const compare::Comparison& comparison) {
  return facts_csv(check_facts(), check_rows(model_rows(comparison), true));
}

std::string sigma_csv(const compare::Comparison& comparison) {
  text::CsvTable table{"noise", "sigma", "score"};
  for (std::size_t m = 0; m < comparison.models.size(); ++m)
    for (Eigen::Index k = 0; k < comparison.profile->sigma.size(); ++k)
      table.text(comparison.models[m].noise)
          .numbers(comparison.profile->sigma[k], comparison.profile->scores(k, static_cast<Eigen::Index>(m)))
          .end_row();
  return std::move(table).take();
}

std::string spectrum_csv(const compare::Comparison& comparison) {
  text::CsvTable table{"model", "eigenvector", "eigenvalue", "variance", "standard_error"};
  const auto add = [&](const std::string& model, const Eigen::VectorXd& values, const Eigen::VectorXd& errors) {
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      table.text(model).numbers(i + 1, comparison.eigenvalues[i], values[i]);
      table.number(i < errors.size() ? errors[i] : std::nan("")).end_row();
    }
  };
  add("observed", comparison.observed, comparison.observed_error);
  for (const compare::ComparedModel& model : comparison.models) add(model.noise, model.spectrum, {});
  return std::move(table).take();
}

std::string landmarks_csv(const compare::Comparison& comparison) {
  const Landmarks& source = comparison.cohort.source;
  text::CsvTable table;
  table.words({"noise", "landmark", "label"});
  for (int axis = 0; axis < source.dimension(); ++axis) table.word(std::string(1, "xyz"[axis]));
  table.word("noise_displacement").end_row();
  for (const compare::ComparedModel& model : comparison.models)
    for (Eigen::Index a = 0; a < model.noise_displacement.size(); ++a) {
      const auto i = static_cast<std::size_t>(a);
      table.text(model.noise).number(a + 1).text(i < source.labels.size() ? source.labels[i] : "");
      table.numbers(source.points.col(a)).number(model.noise_displacement[a]).end_row();
    }
  return std::move(table).take();
}

namespace {

// [cohort]{candidate: {name: value, …, log_evidence, interval_90{name: [low, high]}}}
Json fits_json(const compare::RecoveryRow& row, const std::vector<std::string>& candidates) {
  Json all = Json::array();
  for (const std::vector<compare::RecoveredFit>& fits : row.fits) {
    Json of_cohort = Json::object();
    for (std::size_t i = 0; i < fits.size(); ++i) {
      Json fit = Json::object();
      Json intervals = Json::object();
      for (const compare::FittedNumber& number : fits[i].numbers) {
        fit[number.name] = shown_value(number);
        intervals[number.name] = defined_or_null({number.low, number.high});
      }
      fit["log_evidence"] = defined_or_null(fits[i].log_evidence);
      fit["interval_90"] = std::move(intervals);
      of_cohort[candidates[i]] = std::move(fit);
    }
    all.push_back(std::move(of_cohort));
  }
  return all;
}

}  // namespace

std::string recovery_json(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                          const compare::RecoveryOptions& options, double seconds) {
  Json json{{"kernel", options.settings.kernel.spec()},
            {"sigma", options.settings.sigma.in(0)},
            {"alignment", alignment_name(options.alignment)},
            {"cohorts", options.cohorts},
            {"shapes", options.shapes},
            {"seed", options.seed},
            {"candidates", candidates},
            {"models", Json::array()},
            {"seconds", seconds},
            {"version", version()}};
  for (const compare::RecoveryRow& row : rows)
    json["models"].push_back({{"noise", row.truth.noise.spec()},
                              {"lambda", row.truth.lambda},
                              {"kernel", row.truth.kernel.empty() ? options.settings.kernel.spec() : row.truth.kernel},
                              {"noise_share", defined_or_null(row.noise_share)},
                              {"displacement", row.displacement},
                              {"chosen", row.chosen},
                              {"unfit", row.unfit},
                              {"fits", fits_json(row, candidates)}});
  return records::record_text(json);
}

}  // namespace pulson
