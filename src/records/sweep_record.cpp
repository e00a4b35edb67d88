#include "sweep_record.hpp"

#include "core/csv_table.hpp"
#include "ensemble_facts.hpp"
#include "pulson/core/version.hpp"
#include "record_text.hpp"

namespace pulson::records {

std::string sweep_json(const std::string& parameter, const std::vector<SweepPoint>& points) {
  const EnsembleRun& first = points.front().run;
  const Facts<EnsembleRun> of_one =
      chosen(ensemble_facts(),
             {"kernel", "noise", "method", "crossing.probability", "crossing.standard_error", "crossing.ever",
              "crossing.over", "crossing.if_all_others_did_not", "crossing.if_all_others_did", "paths.clean",
              "paths.no_root", "paths.momentum_bound", "paths.tie", "momentum_error_max"});
  formats::Json json;
  json["format"] = "pulson ensemble sweep 1";
  json["version"] = version();
  json["parameter"] = parameter;
  add_facts(json,
            chosen(ensemble_facts(),
                   {"integrator", "samples", "antithetic", "seed", "dt", "steps", "time", "momentum_bound", "source"}),
            first);
  json["q"] = formats::points_json(first.start.q);
  json["p"] = formats::points_json(first.start.p);
  json["sweep"] = formats::Json::array();
  for (const SweepPoint& point : points) {
    formats::Json& entry = json["sweep"].emplace_back(formats::Json{{"value", point.value}});
    add_ensemble_facts(entry, of_one, point.run);
  }
  return formats::one_key_a_line(require_finite(json));
}

std::string sweep_csv(const std::vector<SweepPoint>& points) {
  const Facts<EnsembleRun> facts =
      chosen(ensemble_facts(), {"crossing.probability", "crossing.standard_error", "crossing.ever", "samples",
                                "paths.clean", "paths.no_root", "paths.momentum_bound", "paths.tie"});
  text::CsvTable table;
  add_header(table.word("value"), facts, points.front().run);
  table.end_row();
  for (const SweepPoint& point : points) {
    add_facts(table.number(point.value), facts, point.run);
    table.end_row();
  }
  return std::move(table).take();
}

}  // namespace pulson::records
