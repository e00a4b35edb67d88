#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "records/facts.hpp"

namespace pulson {

/// Facts as a table of a page, without columns that have no number in any row.
/// @param rows a vector of rows, or of references to them
template <class Row, class Rows>
html::ReportTable report_table(const Facts<Row>& facts, const Rows& rows, std::string caption) {
  html::ReportTable table{{}, std::vector<std::vector<html::ReportCell>>(rows.size()), std::move(caption)};
  for (const Fact<Row>& fact : facts) {
    std::vector<FactValue> values;
    for (const auto& row : rows) values.push_back(fact.value(row));
    if (std::all_of(values.begin(), values.end(), is_missing)) continue;
    table.header.emplace_back(fact.heading);
    for (std::size_t i = 0; i < rows.size(); ++i)
      table.rows[i].push_back({is_missing(values[i]) ? std::string() : fact_text(values[i], fact.format, fact.times)});
  }
  return table;
}

/// The facts of one row, a line each.
template <class Row>
html::ReportTable report_facts(const Facts<Row>& facts, const Row& row, std::string heading) {
  html::ReportTable table{{std::move(heading), "value"}, {}, "", true};
  for (const Fact<Row>& fact : facts) {
    const FactValue value = fact.value(row);
    if (!is_missing(value))
      table.rows.push_back({{std::string(fact.heading)}, {fact_text(value, fact.format, fact.times)}});
  }
  return table;
}

}  // namespace pulson
