#include "info/columns.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "atlas/facts.hpp"
#include "audit/facts.hpp"
#include "compare/facts.hpp"
#include "fokker_planck/facts.hpp"
#include "records/ensemble_facts.hpp"
#include "records/registration_facts.hpp"
#include "records/simulation_facts.hpp"
#include "register/facts.hpp"
#include "sample/facts.hpp"
#include "shell/printing.hpp"
#include "warp/figures.hpp"

namespace pulson {
namespace {

struct Column {
  std::string_view key, heading, description;
};

struct ColumnsOfFiles {
  std::string_view files;
  std::vector<Column> columns;
};

template <class Row>
ColumnsOfFiles columns(std::string_view files, const Facts<Row>& facts) {
  ColumnsOfFiles all{files, {}};
  for (const Fact<Row>& fact : facts) all.columns.push_back({fact.key, fact.heading, fact.description});
  return all;
}

std::vector<ColumnsOfFiles> all_columns() {
  return {columns("register: registration.json", records::registration_facts()),
          columns("register of a cohort: cohort.csv, \"specimens\" of cohort.json", match_facts()),
          columns("atlas: atlas.json", atlas_facts()),
          columns("atlas: specimens.csv, \"specimens\" of atlas.json", specimen_facts()),
          columns("atlas: modes.csv", mode_facts()),
          columns("atlas: model.csv", term_facts()),
          columns("atlas: pairs.csv", pair_facts()),
          columns("audit: audit.csv, \"findings\" of audit.json", finding_facts()),
          columns("audit --repeats: \"repeats.landmarks\" of audit.json", repeat_facts()),
          columns("compare: models.csv, \"models\" of comparison.json", model_facts()),
          columns("compare: shapes.csv", shape_facts()),
          columns("ensemble: ensemble.json, sweep.csv, \"sweep\" of sweep.json", records::ensemble_facts()),
          columns("sample: summary.json", posterior_facts()),
          columns("sample: convergence in summary.json", convergence_facts()),
          columns("sample: \"confirmation\" of summary.json", confirmation_facts()),
          columns("sample: the model in summary.json and calibration.json", posterior_model_facts()),
          columns(R"(sample: "parameters", "momenta", "path" of summary.json, nodes.csv)", draw_facts()),
          columns("sample --tree: nodes.csv, \"tree\" of summary.json", node_facts()),
          columns("simulate: simulation.json", records::simulation_facts()),
          columns("simulate: \"paths\" of simulation.json", records::sample_path_facts()),
          columns("fokker-planck: fokker_planck.json", pair_equation_facts()),
          columns("fokker-planck --samples: fokker_planck.json", sampled_pair_facts()),
          columns("warp: --json", warp_facts()),
          columns("warp of an image: --json", image_warp_facts())};
}

}  // namespace

void print_columns() {
  for (const ColumnsOfFiles& table : all_columns()) {
    std::size_t width = 0;
    for (const Column& column : table.columns) width = std::max(width, column.key.size());
    print_text("{}\n", table.files);
    for (const Column& column : table.columns) print_text("    {:<{}}  {}\n", column.key, width, column.description);
  }
}

formats::Json columns_json() {
  formats::Json tables = formats::Json::array();
  for (const ColumnsOfFiles& table : all_columns()) {
    formats::Json& columns = tables.emplace_back(formats::Json{{"files", table.files}})["columns"];
    for (const Column& column : table.columns)
      columns.push_back({{"key", column.key}, {"heading", column.heading}, {"description", column.description}});
  }
  return {{"columns", std::move(tables)}};
}

}  // namespace pulson
