#include "sweep_record.hpp"

#include "core/csv_table.hpp"
#include "core/undefined.hpp"
#include "ensemble_facts.hpp"
#include "pulson/core/version.hpp"
#include "record_text.hpp"

namespace pulson::records {

namespace {

formats::Json point_json(const SweepPoint& point) {
  formats::Json json;
  json["value"] = point.value;
  json["kernel"] = point.run.system.kernel.spec();
  json["noise"] = point.run.system.noise->spec();
  json["method"] = point.run.method;
  json["crossing"] = crossing_json(point.run);
  json["paths"] = paths_json(point.run.sums.paths);
  json["momentum_error_max"] = point.run.sums.momentum_error;
  return json;
}

bool is_alike(const ensemble::EnsembleSums& sums) {
  return sums.crossing.at_end == 0 || sums.crossing.at_end == sums.paths.clean;
}

}  // namespace

std::string sweep_json(const std::string& parameter, const std::vector<SweepPoint>& points) {
  const EnsembleRun& first = points.front().run;
  formats::Json json;
  json["format"] = "pulson ensemble sweep 1";
  json["version"] = version();
  json["parameter"] = parameter;
  json["integrator"] = first.integrator;
  json["samples"] = first.options.samples;
  json["antithetic"] = first.options.antithetic;
  json["seed"] = first.options.seed;
  json["dt"] = first.options.grid.dt();
  json["steps"] = first.options.grid.steps;
  json["time"] = first.options.grid.time;
  json["momentum_bound"] = defined_or_null(first.options.momentum_bound);
  json["source"] = first.shape.source;
  json["q"] = formats::points_json(first.start.q);
  json["p"] = formats::points_json(first.start.p);
  json["sweep"] = formats::Json::array();
  for (const SweepPoint& point : points) json["sweep"].push_back(point_json(point));
  return formats::one_key_a_line(require_finite(json));
}

std::string sweep_csv(const std::vector<SweepPoint>& points) {
  text::CsvTable table{"value", "probability", "standard_error", "ever", "samples",
                       "clean", "no_root",     "momentum_bound", "tie"};
  for (const SweepPoint& point : points) {
    const ensemble::EnsembleSums& sums = point.run.sums;
    const Estimate crossing = sums.crossing_probability();
    const auto clean = static_cast<double>(sums.paths.clean);
    table.numbers(point.value, crossing.value, is_alike(sums) ? kUndefined : crossing.standard_error,
                  static_cast<double>(sums.crossing.ever) / clean, sums.samples, sums.paths.clean, sums.paths.no_root,
                  sums.paths.momentum_bound, sums.paths.tie);
    table.end_row();
  }
  return std::move(table).take();
}

}  // namespace pulson::records
