#include "open_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/core.h>

#include "core/spec_text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

constexpr std::string_view kFit = "fit";

// Of `(0.5)`, or nothing.
std::optional<double> parse_prior(std::string_view text, std::string_view what) {
  if (text.empty()) return std::nullopt;
  if (text.size() < 3 || text.front() != '(' || text.back() != ')')
    throw InputError(
        fmt::format("{} is {}; what is fitted with a prior is written as in fit(0.5), 0.5 the standard "
                    "deviation of its logarithm",
                    what, quoted_line(fmt::format("fit{}", text))));
  const double deviation = parse_number(text.substr(1, text.size() - 2), fmt::format("{}: the prior", what));
  if (!(std::isfinite(deviation) && deviation > 0))
    throw InputError(fmt::format("{}: the prior is {}; it must be greater than 0", what, deviation));
  return deviation;
}

// One term without its open numbers.
std::string closed_term(std::string_view term, const std::string& owner, std::string_view what,
                        std::vector<OpenNumber>& open) {
  const std::size_t colon = term.find(':');
  std::string text(term.substr(0, colon));
  if (colon == std::string_view::npos) return text;
  char join = ':';
  for (const std::string_view pair : split(term.substr(colon + 1), ',')) {
    const std::size_t equals = pair.find('=');
    const std::string key(pair.substr(0, equals));
    std::string value(pair.substr(equals + 1));
    if (auto number = OpenNumber::parse(value, fmt::format("{} {}: {}", what, quoted_line(text), key))) {
      number->name = owner + key;
      value = number->start;
      open.push_back(*std::move(number));
      if (value.empty()) continue;
    }
    text += fmt::format("{}{}={}", join, key, value);
    join = ',';
  }
  return text;
}

}  // namespace

std::optional<OpenNumber> OpenNumber::parse(std::string_view text, std::string_view what) {
  const std::size_t colon = text.find(':');
  const std::string_view asked = colon == std::string_view::npos ? text : text.substr(colon + 1);
  if (!asked.starts_with(kFit)) {
    if (colon == std::string_view::npos) return std::nullopt;
    throw InputError(fmt::format("{} is {}; a number that is fitted from a starting value is written as in 2:fit", what,
                                 quoted_line(text)));
  }
  return OpenNumber{{},
                    std::string(colon == std::string_view::npos ? "" : text.substr(0, colon)),
                    parse_prior(asked.substr(kFit.size()), what)};
}

OpenSpec OpenSpec::parse(std::string_view text, std::string_view what) {
  static_cast<void>(parse_spec_sum(text, what));
  const std::vector<std::string_view> terms = split_spec_sum(text);
  std::vector<std::string> names;
  for (const std::string_view term : terms) names.emplace_back(term.substr(0, term.find(':')));
  const std::vector<std::string> owners = term_owners(names);
  OpenSpec spec;
  for (std::size_t i = 0; i < terms.size(); ++i)
    spec.text.append(i > 0 ? "+" : "").append(closed_term(terms[i], owners[i], what, spec.open));
  return spec;
}

bool OpenSpec::is_open(std::string_view name) const {
  return std::any_of(open.begin(), open.end(), [&](const OpenNumber& number) { return number.name == name; });
}

std::vector<std::string> term_owners(const std::vector<std::string>& term_names) {
  if (term_names.size() == 1) return {""};
  std::vector<std::string> owners;
  std::map<std::string, int> met;
  for (const std::string& name : term_names) {
    const int number = ++met[name];
    owners.push_back(number > 1 ? fmt::format("{}#{}.", name, number) : name + ".");
  }
  return owners;
}

}  // namespace pulson
