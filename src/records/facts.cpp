#include "facts.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/text.hpp"
#include "pulson/core/name_table.hpp"
#include "record_text.hpp"

namespace pulson {
namespace {

std::string number_text(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

}  // namespace

std::optional<double> defined(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

bool is_missing(const FactValue& value) {
  if (const double* number = std::get_if<double>(&value)) return std::isnan(*number);
  if (const auto* number = std::get_if<std::optional<double>>(&value)) return !*number;
  if (const Estimate* estimate = std::get_if<Estimate>(&value)) return std::isnan(estimate->value);
  return false;
}

std::string fact_text(const FactValue& value, const char* format, double times) {
  if (is_missing(value)) return "-";
  if (const double* number = std::get_if<double>(&value)) return number_text(times * *number, format);
  if (const auto* number = std::get_if<std::optional<double>>(&value)) return number_text(times * **number, format);
  if (const Estimate* estimate = std::get_if<Estimate>(&value)) {
    std::string text = number_text(times * estimate->value, format);
    if (std::isnan(estimate->standard_error)) return text;
    // What is 0 by definition has no error.
    if (estimate->value == 0 && estimate->standard_error == 0) return "0";
    return text + " ± " + number_text(times * estimate->standard_error, "{:.2g}");
  }
  if (const long* count = std::get_if<long>(&value)) return std::to_string(*count);
  if (const std::uint64_t* seed = std::get_if<std::uint64_t>(&value)) return std::to_string(*seed);
  if (const bool* is_so = std::get_if<bool>(&value)) return *is_so ? "yes" : "no";
  const auto& text = std::get<std::string>(value);
  return std::string_view(format).empty() ? text : shortened_spec(text);
}

void add_fact(text::CsvTable& table, const FactValue& value) {
  if (const double* number = std::get_if<double>(&value)) table.number(*number);
  if (const auto* number = std::get_if<std::optional<double>>(&value)) table.number(number->value_or(text::kMissing));
  if (const Estimate* estimate = std::get_if<Estimate>(&value))
    table.numbers(estimate->value, estimate->standard_error);
  if (const long* count = std::get_if<long>(&value)) table.number(*count);
  if (const std::uint64_t* seed = std::get_if<std::uint64_t>(&value)) table.number(*seed);
  if (const bool* is_so = std::get_if<bool>(&value)) table.number(*is_so ? 1 : 0);
  if (const std::string* text = std::get_if<std::string>(&value)) table.text(*text);
}

void add_fact(formats::Json& json, std::string_view key, const FactValue& value) {
  if (const std::size_t dot = key.find('.'); dot != std::string_view::npos)
    return add_fact(json[std::string(key.substr(0, dot))], key.substr(dot + 1), value);
  formats::Json& place = json[std::string(key)];
  if (const double* number = std::get_if<double>(&value)) place = *number;
  if (const auto* number = std::get_if<std::optional<double>>(&value))
    place = *number ? formats::Json(**number) : formats::Json(nullptr);
  if (const long* count = std::get_if<long>(&value)) place = *count;
  if (const std::uint64_t* seed = std::get_if<std::uint64_t>(&value)) place = *seed;
  if (const bool* is_so = std::get_if<bool>(&value)) place = *is_so;
  if (const std::string* text = std::get_if<std::string>(&value)) place = *text;
  if (const Estimate* estimate = std::get_if<Estimate>(&value)) {
    place = records::defined_or_null(estimate->value);
    formats::Json& error = key == "value" ? json["standard_error"] : json["standard_errors"][std::string(key)];
    error = records::defined_or_null(estimate->standard_error);
  }
}

}  // namespace pulson
