#include "pulson/core/name_table.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>

#include <fmt/core.h>

#include "core/spec_text.hpp"
#include "core/text.hpp"

namespace pulson {

Length Length::percent(double value) {
  Length length(value);
  length.relative_ = true;
  return length;
}

Length Length::parse(std::string_view text, std::string_view what) {
  if (text.empty() || text.back() != '%') return parse_number(text, what);
  return percent(parse_number(text.substr(0, text.size() - 1), what));
}

std::string Length::text() const { return fmt::format("{}{}", value_, relative_ ? "%" : ""); }

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::vector<std::string_view> split_spec_sum(std::string_view text) {
  std::vector<std::string_view> terms;
  std::size_t begin = 0;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == '+' && std::isalpha(static_cast<unsigned char>(text[i + 1])) != 0) {
      terms.push_back(text.substr(begin, i - begin));
      begin = i + 1;
    }
  }
  terms.push_back(text.substr(begin));
  return terms;
}

std::string text_of_spec(const Spec& spec) {
  std::string text = spec.name;
  for (const auto& [key, value] : spec.values)
    text += fmt::format("{}{}={}", text.size() == spec.name.size() ? ":" : ",", key, value);
  return text;
}

namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : a) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t above = row[j + 1];
      row[j + 1] = letter == b[j] ? diagonal : 1 + std::min({diagonal, above, row[j]});
      diagonal = above;
    }
  }
  return row[b.size()];
}

Spec parse_term(std::string_view term, std::string_view what) {
  const std::size_t colon = term.find(':');
  Spec spec{std::string(term.substr(0, colon)), {}};
  if (spec.name.empty()) throw InputError(std::string(what) + " " + quoted_line(term) + " has no name");
  if (colon == std::string_view::npos) return spec;
  for (const std::string_view pair : split(term.substr(colon + 1), ',')) {
    const std::size_t equals = pair.find('=');
    if (equals == 0 || equals == std::string_view::npos || equals + 1 == pair.size())
      throw InputError(std::string(what) + " " + quoted_line(spec.name) + ": " + quoted_line(pair) +
                       " is not key=value" + (pair.starts_with("fit") ? ", as in alpha=fit" : ""));
    const auto [it, is_new] =
        spec.values.emplace(std::string(pair.substr(0, equals)), std::string(pair.substr(equals + 1)));
    if (!is_new)
      throw InputError(std::string(what) + " " + quoted_line(spec.name) + ": " + it->first + " is given twice");
  }
  return spec;
}

}  // namespace

std::string quoted_line(std::string_view text) {
  std::string shown(text);
  std::replace_if(shown.begin(), shown.end(), is_control, '?');
  return "'" + shown + "'";
}

std::vector<Spec> parse_spec_sum(std::string_view text, std::string_view what) {
  if (std::any_of(text.begin(), text.end(), is_control))
    throw InputError(std::string(what) + " " + quoted_line(text) + " holds a control character");
  std::vector<Spec> specs;
  for (const std::string_view term : split_spec_sum(text)) specs.push_back(parse_term(term, what));
  return specs;
}

double parse_number(std::string_view text, std::string_view what) {
  std::string_view digits = text;
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || digits.empty())
    throw InputError(std::string(what) + " is " + quoted_line(text) + "; a number is needed");
  return value;
}

std::vector<double> parse_number_list(std::string_view text, std::string_view what) {
  std::vector<double> values;
  for (const std::string_view part : split(text, '/')) values.push_back(parse_number(part, what));
  return values;
}

std::string shortened_spec(std::string_view spec) {
  constexpr std::size_t kLongest = 6;  // characters of a number that stays
  constexpr int kDigits = 4;
  std::string text;
  const char* const end = spec.data() + spec.size();
  for (const char* at = spec.data(); at != end;) {
    double value = 0;
    const bool may_start = at != spec.data() && (at[-1] == '=' || at[-1] == '/');
    const auto [after, error] = std::from_chars(at, end, value);
    if (!may_start || error != std::errc() || !std::isfinite(value)) {
      text += *at++;
      continue;
    }
    if (static_cast<std::size_t>(after - at) <= kLongest) {
      text.append(at, after);
    } else {
      std::array<char, 32> buffer{};
      const auto written =
          std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, kDigits);
      text.append(buffer.data(), written.ptr);
    }
    at = after;
  }
  return text;
}

std::string nearest_name(std::string_view name, std::span<const std::string> valid) {
  std::string best;
  // A part of the name must be right, and more of a long one.
  std::size_t best_distance = std::min(std::max<std::size_t>(2, name.size() / 3) + 1, name.size());
  for (const std::string& candidate : valid) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string advice_on_name(std::string_view name, std::span<const std::string> valid) {
  const std::string near = nearest_name(name, valid);
  std::string advice = near.empty() ? "; valid: " : "; did you mean '" + near + "'; valid: ";
  for (std::size_t i = 0; i < valid.size(); ++i) advice += (i > 0 ? ", " : "") + valid[i];
  return advice;
}

Parameters::Parameters(const Spec& spec, std::span<const ParameterInfo> info, std::string_view what, double diameter)
    : what_(what) {
  std::vector<std::string> names;
  for (const ParameterInfo& parameter : info) names.push_back(parameter.name);
  for (const auto& [key, value] : spec.values) {
    if (std::find(names.begin(), names.end(), key) != names.end()) continue;
    std::string message = what_ + " has no parameter " + quoted_line(key);
    if (const std::string near = nearest_name(key, names); !near.empty()) message += "; did you mean '" + near + "'";
    message += "; it has: ";
    for (std::size_t i = 0; i < names.size(); ++i) message += (i > 0 ? ", " : "") + names[i];
    if (names.empty()) message += "none";
    throw InputError(message);
  }
  for (const ParameterInfo& parameter : info) {
    const auto given = spec.values.find(parameter.name);
    const std::string& value = given != spec.values.end() ? given->second : parameter.default_text;
    if (value.empty())
      throw InputError(what_ + " needs " + parameter.name + " (" + parameter.help + "), as in " + spec.name + ":" +
                       parameter.name + (parameter.is_length ? "=100%" : "=1"));
    values_[parameter.name] = value.back() == '%' ? in_length_units(parameter, value, diameter) : value;
  }
}

std::string Parameters::in_length_units(const ParameterInfo& parameter, const std::string& value,
                                        double diameter) const {
  if (!parameter.is_length)
    throw InputError(fmt::format("{} is {}; it is not a length, so a percentage of the diameter has no meaning for it",
                                 describe(parameter.name), quoted_line(value)));
  const Length length = Length::parse(value, describe(parameter.name));
  if (!(diameter > 0))
    throw InputError(
        fmt::format("{} is {}, a percentage of the diameter, but there is no shape with two distinct landmarks",
                    describe(parameter.name), quoted_line(value)));
  return fmt::format("{}", length.in(diameter));
}

std::string Parameters::describe(const std::string& key) const { return what_ + ": " + key; }

const std::string& Parameters::text(const std::string& key) const { return values_.at(key); }

double Parameters::number(const std::string& key) const {
  const double value = parse_number(text(key), describe(key));
  if (!std::isfinite(value)) throw InputError(describe(key) + " is " + quoted_line(text(key)) + "; it must be finite");
  return value;
}

double Parameters::positive(const std::string& key) const {
  const double value = number(key);
  if (value <= 0) throw InputError(describe(key) + " is " + text(key) + "; it must be greater than 0");
  require_positive(describe(key), value);  // and in the range that can be computed with
  return value;
}

double Parameters::non_negative(const std::string& key) const {
  const double value = number(key);
  if (value < 0) throw InputError(describe(key) + " is " + text(key) + "; it must not be negative");
  if (value > 0) require_positive(describe(key), value);
  return value;
}

std::vector<double> Parameters::numbers(const std::string& key) const {
  std::vector<double> list = parse_number_list(text(key), describe(key));
  for (const double value : list)
    if (!std::isfinite(value))
      throw InputError(describe(key) + " is " + quoted_line(text(key)) + "; it must be finite");
  return list;
}

bool Parameters::flag(const std::string& key) const {
  if (text(key) != "0" && text(key) != "1")
    throw InputError(describe(key) + " is " + quoted_line(text(key)) + "; it must be 0 or 1");
  return text(key) == "1";
}

std::vector<int> Parameters::indices(const std::string& key) const {
  std::vector<int> list;
  if (text(key) == "all") return list;
  for (const double value : parse_number_list(text(key), describe(key))) {
    if (!(value >= 1 && value <= 1e9) || value != std::floor(value))
      throw InputError(describe(key) + " is " + quoted_line(text(key)) + "; landmarks are counted from 1, as in 1/3/5");
    list.push_back(static_cast<int>(value) - 1);
  }
  std::sort(list.begin(), list.end());
  if (std::adjacent_find(list.begin(), list.end()) != list.end())
    throw InputError(describe(key) + " is " + quoted_line(text(key)) + "; it names a landmark twice");
  return list;
}

}  // namespace pulson
