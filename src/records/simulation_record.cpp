#include <fmt/format.h>

#include "csv_rows.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/version.hpp"
#include "pulson/records/records.hpp"
#include "record_text.hpp"

namespace pulson::records {

void add_axis_names(text::CsvTable& table, std::string_view prefix, Eigen::Index d) {
  for (Eigen::Index c = 0; c < d; ++c) table.word(fmt::format("{}_{}", prefix, "xyz"[c]));
}

void add_state_names(text::CsvTable& table, Eigen::Index d) {
  add_axis_names(table, "q", d);
  add_axis_names(table, "p", d);
}

void add_states(text::CsvTable& table, const Trajectory& path, std::string_view first, int every,
                const std::vector<int>& numbers) {
  const auto last = static_cast<int>(path.states.size()) - 1;
  for (int k = 0; k <= last; ++k) {
    if (k % every != 0 && k != last) continue;
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    for (Eigen::Index a = 0; a < state.q.cols(); ++a) {
      if (!first.empty()) table.cells(first);
      table.numbers(k, path.grid.at(k),
                    numbers.empty() ? static_cast<int>(a) + 1 : numbers[static_cast<std::size_t>(a)]);
      table.numbers(state.q.col(a)).numbers(state.p.col(a)).end_row();
    }
  }
}

namespace {

formats::Json sample_json(const ensemble::SamplePath& sample) {
  formats::Json json = {{"status", path_status_name(sample.status)}};
  if (!sample.reason.empty()) json["reason"] = sample.reason;
  json["time"] = sample.path.grid.time;
  json["q"] = formats::points_json(sample.path.final().q);
  json["p"] = formats::points_json(sample.path.final().p);
  json["largest_momentum"] = defined_or_null(sample.largest_momentum);
  json["momentum_error"] = defined_or_null(sample.momentum_error);
  json["contraction_bound"] = defined_or_null(sample.contraction_bound);
  json["contraction_measured"] = defined_or_null(sample.path.contraction_measured);
  json["continuation_steps"] = sample.path.continuation_steps;
  return json;
}

}  // namespace

std::string simulation_json(const Simulation& simulation) {
  formats::Json json;
  json["format"] = "pulson simulation 1";
  json["version"] = version();
  json["kernel"] = simulation.system.kernel.spec();
  json["noise"] = simulation.system.noise->spec();
  json["integrator"] = simulation.integrator;
  json["time"] = simulation.options.grid.time;
  json["steps"] = simulation.options.grid.steps;
  json["dt"] = simulation.options.grid.dt();
  json["seed"] = simulation.options.seed;
  json["samples"] = simulation.options.samples;
  json["seconds"] = simulation.seconds;
  json["source"] = simulation.shape.source;
  json["q"] = formats::points_json(simulation.start.q);
  json["p"] = formats::points_json(simulation.start.p);
  json["paths"] = formats::Json::array();
  for (const ensemble::SamplePath& sample : simulation.samples) json["paths"].push_back(sample_json(sample));
  return formats::one_key_a_line(require_finite(json));
}

std::string sample_paths_csv(const Simulation& simulation, int every) {
  text::CsvTable table;
  table.words({"sample", "step", "time", "landmark"});
  add_state_names(table, simulation.start.q.rows());
  table.end_row();
  for (std::size_t m = 0; m < simulation.samples.size(); ++m)
    add_states(table, simulation.samples[m].path, std::to_string(m + 1), every);
  return std::move(table).take();
}

}  // namespace pulson::records
