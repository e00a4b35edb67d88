#include "info/columns.hpp"

#include <algorithm>
#include <string_view>

#include "atlas/facts.hpp"
#include "audit/facts.hpp"
#include "compare/facts.hpp"
#include "register/facts.hpp"
#include "shell/printing.hpp"

namespace pulson {
namespace {

template <class Row>
void print_facts(std::string_view files, const Facts<Row>& facts) {
  std::size_t width = 0;
  for (const Fact<Row>& fact : facts) width = std::max(width, fact.key.size());
  print_text("{}\n", files);
  for (const Fact<Row>& fact : facts) print_text("    {:<{}}  {}\n", fact.key, width, fact.description);
}

}  // namespace

void print_columns() {
  print_facts("register of a cohort: cohort.csv, \"specimens\" of cohort.json", match_facts());
  print_facts("atlas: atlas.json", atlas_facts());
  print_facts("atlas: specimens.csv, \"specimens\" of atlas.json", specimen_facts());
  print_facts("atlas: modes.csv", mode_facts());
  print_facts("atlas: model.csv", term_facts());
  print_facts("atlas: pairs.csv", pair_facts());
  print_facts("audit: audit.csv, \"findings\" of audit.json", finding_facts());
  print_facts("audit --repeats: \"repeats.landmarks\" of audit.json", repeat_facts());
  print_facts("compare: models.csv, \"models\" of comparison.json", model_facts());
  print_facts("compare: shapes.csv", shape_facts());
}

}  // namespace pulson
