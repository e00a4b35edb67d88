#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/csv_table.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/estimate.hpp"

namespace pulson {

/// What a fact is of a row: a number, one that may be undefined, one with its standard error, a count, a text or
/// whether something is so. NaN is missing where it is read; a record refuses it but for numbers that may be undefined.
using FactValue = std::variant<double, std::optional<double>, Estimate, long, std::uint64_t, std::string, bool>;

/// Nothing where it is not finite.
std::optional<double> defined(double value);

/// What is known of each row of a table, written down once: the summary, the page, the csv and the JSON take it from
/// here, and docs list it.
template <class Row>
struct Fact {
  std::string_view key;          ///< of the JSON, where `a.b` is b of the object a; in a csv b
  std::string_view heading;      ///< of the summary and the page
  std::string_view description;  ///< with its unit
  const char* format;            ///< of a number where it is read; of a specification any: its numbers are shortened
  std::function<FactValue(const Row&)> value;
  double times = 1;  ///< where it is read: 100 for per cent
};

template <class Row>
using Facts = std::vector<Fact<Row>>;

/// As it is read: "-" where there is no number.
std::string fact_text(const FactValue& value, const char* format, double times);
bool is_missing(const FactValue& value);

/// A cell, of an estimate two, of which the second has the name KEY_error.
void add_fact(text::CsvTable& table, const FactValue& value);
/// Under its key; numbers that are undefined are null. Errors are in the object `standard_errors` under the same key;
/// that of a key `value`, as in `log_evidence.value`, is the `standard_error` beside it.
void add_fact(formats::Json& json, std::string_view key, const FactValue& value);

template <class Row>
const Fact<Row>& fact_of(const Facts<Row>& facts, std::string_view key) {
  const auto found = std::find_if(facts.begin(), facts.end(), [&](const Fact<Row>& fact) { return fact.key == key; });
  if (found == facts.end()) throw std::logic_error("there is no fact " + std::string(key));
  return *found;
}

/// The facts of these keys, in their order.
template <class Row>
Facts<Row> chosen(const Facts<Row>& facts, std::initializer_list<std::string_view> keys) {
  Facts<Row> some;
  for (const std::string_view key : keys) some.push_back(fact_of(facts, key));
  return some;
}

/// The name of its column.
template <class Row>
std::string_view column_of(const Fact<Row>& fact) {
  return fact.key.substr(fact.key.rfind('.') + 1);
}

/// As the fact of this key is read.
template <class Row>
std::string text_of(const Facts<Row>& facts, std::string_view key, const Row& row) {
  const Fact<Row>& fact = fact_of(facts, key);
  return fact_text(fact.value(row), fact.format, fact.times);
}

template <class Row>
void add_facts(formats::Json& json, const Facts<Row>& facts, const Row& row) {
  for (const Fact<Row>& fact : facts) add_fact(json, fact.key, fact.value(row));
}

template <class Row>
void add_header(text::CsvTable& table, const Facts<Row>& facts, const Row& row) {
  for (const Fact<Row>& fact : facts) {
    table.word(column_of(fact));
    if (std::holds_alternative<Estimate>(fact.value(row))) table.word(std::string(column_of(fact)) + "_error");
  }
}

template <class Row>
void add_facts(text::CsvTable& table, const Facts<Row>& facts, const Row& row) {
  for (const Fact<Row>& fact : facts) add_fact(table, fact.value(row));
}

/// A header and the rows. @param rows at least one, or facts that are no estimates
template <class Row>
std::string facts_csv(const Facts<Row>& facts, const std::vector<Row>& rows) {
  text::CsvTable table;
  if (rows.empty())
    for (const Fact<Row>& fact : facts) table.word(column_of(fact));
  else
    add_header(table, facts, rows.front());
  table.end_row();
  for (const Row& row : rows) {
    add_facts(table, facts, row);
    table.end_row();
  }
  return std::move(table).take();
}

/// Headings, then the cells of each row.
template <class Row>
std::vector<std::vector<std::string>> text_table(const Facts<Row>& facts, const std::vector<Row>& rows) {
  std::vector<std::vector<std::string>> table(1);
  for (const Fact<Row>& fact : facts) table.front().emplace_back(fact.heading);
  for (const Row& row : rows) {
    std::vector<std::string>& cells = table.emplace_back();
    for (const Fact<Row>& fact : facts) cells.push_back(fact_text(fact.value(row), fact.format, fact.times));
  }
  return table;
}

}  // namespace pulson
