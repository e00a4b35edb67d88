#include <fmt/format.h>

#include "csv_rows.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/version.hpp"
#include "pulson/records/records.hpp"
#include "record_text.hpp"
#include "simulation_facts.hpp"

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

const Facts<Simulation>& simulation_facts() {
  using R = Simulation;
  static const Facts<R> facts = {
      {"kernel", "kernel", "of the flow", "{}", [](const R& r) { return r.system.kernel.spec(); }},
      {"noise", "noise", "the noise model", "{}", [](const R& r) { return r.system.noise->spec(); }},
      {"integrator", "integrator", "of the paths", "", &R::integrator},
      {"time", "time", "T", "{:.4g}", [](const R& r) { return r.options.grid.time; }},
      {"steps", "steps", "of the integrator", "", [](const R& r) { return r.options.grid.steps; }},
      {"dt", "time step", "of the integrator", "{:.4g}", [](const R& r) { return r.options.grid.dt(); }},
      {"seed", "seed", "of the random numbers", "", [](const R& r) { return r.options.seed; }},
      {"samples", "paths", "sample paths", "", [](const R& r) { return r.options.samples; }},
      {"seconds", "seconds", "of all paths", "{:.2f}", &R::seconds},
      {"source", "source", "where the start is from", "", [](const R& r) { return r.shape.source; }}};
  return facts;
}

const Facts<SamplePathRow>& sample_path_facts() {
  using R = SamplePathRow;
  static const Facts<R> facts = {
      {"status", "ended", "clean, no_root where a step had no solution, momentum_bound where momenta passed the bound",
       "", [](const R& r) { return path_status_name(r.sample().status); }},
      {"reason", "because", "why it ended early; of a clean path empty", "",
       [](const R& r) { return r.sample().reason; }},
      {"time", "at time", "of its last state", "{:.4g}", [](const R& r) { return r.sample().path.grid.time; }},
      {"largest_displacement", "largest displacement", "of a landmark from start to end, length units", "{:.4g}",
       [](const R& r) {
         return defined((r.sample().path.final().q - r.simulation->start.q).colwise().norm().maxCoeff());
       }},
      {"largest_momentum", "largest momentum", "of a landmark at any step", "{:.4g}",
       [](const R& r) { return defined(r.sample().largest_momentum); }},
      {"momentum_error", "error of the total momentum", "largest change, relative to the sum of |p0|", "{:.1e}",
       [](const R& r) { return defined(r.sample().momentum_error); }},
      {"contraction_bound", "largest κ of a step", "below 1 the equation of each step has one root", "{:.3g}",
       [](const R& r) { return defined(r.sample().contraction_bound); }},
      {"contraction_measured", "measured", "largest ratio of a step's successive corrections", "{:.3g}",
       [](const R& r) { return defined(r.sample().path.contraction_measured); }},
      {"continuation_steps", "steps followed from dt = 0", "those whose root was followed", "",
       [](const R& r) { return r.sample().path.continuation_steps; }}};
  return facts;
}

std::string simulation_json(const Simulation& simulation) {
  formats::Json json;
  json["format"] = "pulson simulation 1";
  json["version"] = version();
  add_facts(json, simulation_facts(), simulation);
  json["q"] = formats::points_json(simulation.start.q);
  json["p"] = formats::points_json(simulation.start.p);
  json["paths"] = formats::Json::array();
  for (std::size_t m = 0; m < simulation.samples.size(); ++m) {
    const SamplePathRow row{&simulation, m};
    formats::Json& path = json["paths"].emplace_back();
    add_facts(path, sample_path_facts(), row);
    path["q"] = formats::points_json(row.sample().path.final().q);
    path["p"] = formats::points_json(row.sample().path.final().p);
  }
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
