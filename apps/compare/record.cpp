#include "record.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/csv_table.hpp"
#include "pulson/core/version.hpp"
#include "records/record_text.hpp"
#include "shell/options.hpp"

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

Json model_json(const compare::ComparedModel& model, const compare::CohortSettings& settings) {
  const compare::CohortFit& fit = model.fit;
  Json json{{"noise", fit.noise},
            {"asked", model.noise},
            {"mode", mode_of(fit)},
            {"integrator", settings.integrator},
            {"kernel", fit.kernel},
            {"lambda", fit.lambda},
            {"sigma", fit.sigma},
            {"fitted", fitted_json(fit.fitted)},
            {"converged", fit.converged},
            {"rms", model.rms.value},
            {"energy", model.energy.value},
            {"action", model.action.value},
            {"total", model.total.value},
            {"log_evidence", defined_or_null(fit.log_evidence)},
            {"score", defined_or_null(model.score)},
            {"difference", estimate(model.difference)},
            {"weight", model.weight},
            {"p_value", defined_or_null(model.p_value)},
            {"p_value_cohorts", model.bootstrapped},
            {"noise_share", fit.noise_share},
            {"order_inversions", defined_or_null(model.order_inversions.value)},
            {"flipped_triangles", defined_or_null(model.flipped_triangles.value)},
            {"folded_fraction", defined_or_null(model.folded_fraction.value)},
            {"seconds", model.seconds}};
  json["standard_errors"] = Json{{"rms", model.rms.standard_error},
                                 {"energy", model.energy.standard_error},
                                 {"action", model.action.standard_error},
                                 {"total", model.total.standard_error},
                                 {"order_inversions", model.order_inversions.standard_error},
                                 {"flipped_triangles", model.flipped_triangles.standard_error},
                                 {"folded_fraction", model.folded_fraction.standard_error}};
  json["standard_errors"] = defined_or_null(json["standard_errors"]);
  json["log_evidences"] = defined_or_null(evidences(fit));
  json["laplace"] = defined_or_null(fit.laplace);
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
  json["matched"] = model.matched;
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
  json["spectrum"] = defined_or_null(numbers(model.spectrum));
  json["noise_way"] = numbers(model.noise_displacement);
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
  for (const compare::ComparedModel& model : comparison.models)
    json["models"].push_back(model_json(model, comparison.settings));
  return records::record_text(json);
}

std::string specimens_csv(const compare::CohortShapes& shapes) {
  io::CsvTable table{"shape", "centroid_size", "specimen"};
  for (const Landmarks& shape : shapes.targets)
    table.text(shape.source).number(centroid_size(shape.points)).text(shape.name).end_row();
  return std::move(table).take();
}

std::string shapes_csv(const compare::Comparison& comparison) {
  io::CsvTable table{"noise",  "shape", "log_evidence", "laplace",      "effective_samples", "rms",     "energy",
                     "action", "data",  "converged",    "energy_score", "coverage_90",       "specimen"};
  for (const compare::ComparedModel& model : comparison.models)
    for (std::size_t s = 0; s < model.fit.shapes.size(); ++s) {
      const compare::ShapeFit& shape = model.fit.shapes[s];
      const Landmarks& target = comparison.cohort.targets[s];
      table.text(model.fit.noise).text(target.source);
      table.numbers(shape.log_evidence, shape.laplace, shape.effective_samples, shape.rms, shape.cost.energy,
                    shape.cost.action, shape.cost.data, shape.converged ? 1 : 0);
      if (model.prediction)
        table.numbers(model.prediction->shapes[s].energy_score, model.prediction->shapes[s].coverage);
      else
        table.missing().missing();
      table.text(target.name).end_row();
    }
  return std::move(table).take();
}

std::string models_csv(const compare::Comparison& comparison) {
  io::CsvTable table{"noise",
                     "number",
                     "value",
                     "low_90",
                     "high_90",
                     "vanishes",
                     "log_evidence",
                     "log_evidence_error",
                     "laplace",
                     "score",
                     "difference",
                     "difference_error",
                     "weight",
                     "p",
                     "noise_share",
                     "rms",
                     "energy",
                     "action",
                     "matched",
                     "energy_score",
                     "energy_score_error",
                     "coverage_90"};
  for (const compare::ComparedModel& model : comparison.models) {
    const compare::CohortFit& fit = model.fit;
    const double nan = std::nan("");
    const auto& prediction = model.prediction;
    const auto end_row = [&] {
      table.numbers(fit.log_evidence, fit.sampling_error, fit.laplace, model.score, model.difference.value,
                    model.difference.standard_error, model.weight, model.p_value, fit.noise_share, model.rms.value,
                    model.energy.value, model.action.value, model.matched, prediction ? prediction->energy_score : nan,
                    prediction ? prediction->energy_score_error : nan, prediction ? prediction->coverage : nan);
      table.end_row();
    };
    if (fit.fitted.empty()) {
      table.text(model.noise).missing().missing().missing().missing().missing();
      end_row();
    }
    for (const compare::FittedNumber& number : fit.fitted) {
      table.text(model.noise).word(number.name);
      table.numbers(shown_value(number), number.low, number.high, number.vanishes ? 1 : 0);
      end_row();
    }
  }
  return std::move(table).take();
}

std::string spectrum_csv(const compare::Comparison& comparison) {
  io::CsvTable table{"model", "eigenvector", "eigenvalue", "variance", "standard_error"};
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
  io::CsvTable table;
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
