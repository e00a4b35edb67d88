#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/core/errors.hpp"

namespace pulson {

/// A length in the units of the coordinates, or in per cent of a shape's diameter, which does not depend on the unit.
class Length {
 public:
  Length(double value) : value_(value) {}  // NOLINT(google-explicit-constructor): a number is a length
  static Length percent(double value);

  /// `0.5%` or `0.3`. @throws InputError that begins with `what`
  static Length parse(std::string_view text, std::string_view what);

  bool is_relative() const { return relative_; }
  /// In the units of the coordinates. @param diameter of the shape, in the same units
  double in(double diameter) const { return relative_ ? value_ / 100 * diameter : value_; }
  /// As parse() reads it.
  std::string text() const;

 private:
  double value_ = 0;  // length units, or per cent
  bool relative_ = false;
};

/// One named parameter of a table row. An empty default means that it must be given.
struct ParameterInfo {
  std::string name;
  std::string default_text;
  std::string help;
  bool is_length = false;  ///< proportional to the unit of length: `5%` is 5 % of the shape's diameter
};

/// One term of a specification `NAME:key=value,key=value`, as text.
struct Spec {
  std::string name;
  std::map<std::string, std::string> values;
};

/// `text` in quotes, fit for a message of one line: control characters become '?'.
std::string quoted_line(std::string_view text);

/// Splits `NAME:key=value,...+NAME:...` into its terms; a '+' separates terms where a letter follows it, so 1e+3 is a
/// number. @throws InputError on a malformed term; `what` ("kernel", "noise") is named in the message.
std::vector<Spec> parse_spec_sum(std::string_view text, std::string_view what);

/// A number, the whole of `text`. @throws InputError that begins with `what`.
double parse_number(std::string_view text, std::string_view what);

/// A list `1/3/5` of numbers. @throws InputError that begins with `what`.
std::vector<double> parse_number_list(std::string_view text, std::string_view what);

/// A specification for people: its numbers of more than five digits rounded to four.
std::string shortened_spec(std::string_view spec);

/// The entry of `valid` nearest to `name` by edit distance, or an empty string where none is near.
std::string nearest_name(std::string_view name, std::span<const std::string> valid);

/// The end of a message on a name that is unknown: "; did you mean 'first'; valid: average, first", without the first
/// half where no name is near.
std::string advice_on_name(std::string_view name, std::span<const std::string> valid);

/// The names of an enum's n values, both ways. `what` they name ("solver") is for messages.
template <class Value, std::size_t n>
struct EnumNames {
  std::string_view what;
  std::array<std::pair<std::string_view, Value>, n> names;

  /// @throws InputError that lists the names
  Value parse(std::string_view name) const {
    std::vector<std::string> valid;
    for (const auto& [known, value] : names) {
      if (known == name) return value;
      valid.emplace_back(known);
    }
    throw InputError("unknown " + std::string(what) + " " + quoted_line(name) + advice_on_name(name, valid));
  }

  std::string name(Value value) const {
    for (const auto& [known, other] : names)
      if (other == value) return std::string(known);
    return {};
  }
};

/// The values of one row's parameters, defaults filled in; every getter names the parameter in its errors.
class Parameters {
 public:
  /// @param diameter of the shape that per cent refer to; 0: there is none
  /// @throws InputError if `spec` has a key that `info` does not list, or lacks one that has no default; or if a
  /// value is in per cent and its parameter is not a length, or there is no shape.
  Parameters(const Spec& spec, std::span<const ParameterInfo> info, std::string_view what, double diameter = 0);

  const std::string& text(const std::string& key) const;
  bool is_auto(const std::string& key) const { return text(key) == "auto"; }
  double number(const std::string& key) const;
  /// A number that must be finite and greater than zero.
  double positive(const std::string& key) const;
  /// A number that must be finite and not less than zero.
  double non_negative(const std::string& key) const;
  /// A list `1/3/5` of finite numbers.
  std::vector<double> numbers(const std::string& key) const;
  /// 0 or 1.
  bool flag(const std::string& key) const;
  /// Counts from 1 (`1/3/5`), returned from 0; empty where the text is `all`.
  std::vector<int> indices(const std::string& key) const;

 private:
  std::string describe(const std::string& key) const;
  std::string in_length_units(const ParameterInfo& parameter, const std::string& value, double diameter) const;

  std::string what_;
  std::map<std::string, std::string> values_;
};

/// The one registry type: name → make, parameters with defaults, one line of help. The command line, files and tests
/// read the table; an unknown name lists the valid ones.
template <class Make>
class NameTable {
 public:
  struct Row {
    std::string name;
    std::vector<ParameterInfo> parameters;
    std::string help;
    Make make;
  };

  NameTable(std::string what, std::vector<Row> rows) : what_(std::move(what)), rows_(std::move(rows)) {}

  const std::vector<Row>& rows() const { return rows_; }
  const std::string& what() const { return what_; }

  /// @throws InputError that lists the valid names if there is no such row.
  const Row& find(std::string_view name) const {
    std::vector<std::string> names;
    for (const Row& row : rows_) {
      if (row.name == name) return row;
      names.push_back(row.name);
    }
    throw InputError("unknown " + what_ + " " + quoted_line(name) + advice_on_name(name, names));
  }

  /// A copy with one more row. @throws InputError if the name is taken
  NameTable with(Row row) const {
    for (const Row& other : rows_)
      if (other.name == row.name) throw InputError("there is a " + what_ + " '" + row.name + "' already");
    NameTable copy = *this;
    copy.rows_.push_back(std::move(row));
    return copy;
  }

  /// Each term of a sum with its row and parameters, in order. @param diameter what per cent refer to, see Parameters
  std::vector<std::pair<const Row*, Parameters>> parse(std::string_view text, double diameter = 0) const {
    std::vector<std::pair<const Row*, Parameters>> terms;
    for (const Spec& spec : parse_spec_sum(text, what_)) {
      const Row& row = find(spec.name);
      terms.emplace_back(&row, Parameters(spec, row.parameters, what_ + " '" + spec.name + "'", diameter));
    }
    return terms;
  }

 private:
  std::string what_;
  std::vector<Row> rows_;
};

}  // namespace pulson
