#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/name_table.hpp"

namespace pulson {

/// A number that is to be fitted. In specifications and options alike it is `fit`; `2%:fit` begins at 2 %, and
/// `fit(0.5)` or `2%:fit(0.5)` has a log-normal prior of this standard deviation of the logarithm.
struct OpenNumber {
  std::string name;   ///< `beta`; in a sum `ch-sd.beta`, and `ch-sd#2.beta` of the second term of that name
  std::string start;  ///< text of the starting value; empty: an automatic one
  std::optional<double> log_deviation{};  ///< of the prior

  /// None where `text` is a value. @throws InputError that begins with `what`
  static std::optional<OpenNumber> parse(std::string_view text, std::string_view what);
};

/// A specification some of whose numbers are to be fitted.
struct OpenSpec {
  std::string text;  ///< with the starting values; a number without one is left out, as by who gives none
  std::vector<OpenNumber> open;

  /// @throws InputError as parse_spec_sum()
  static OpenSpec parse(std::string_view text, std::string_view what);

  bool is_open(std::string_view name) const;
};

/// What the names of the numbers of each term begin with: nothing where there is one, else `gaussian.`, and
/// `gaussian#2.` of the second of that name.
std::vector<std::string> term_owners(const std::vector<std::string>& term_names);

/// A parameter without default that a specification lacks.
struct MissingNumber {
  std::string name;     ///< as of OpenNumber
  std::string example;  ///< `ch-sd:beta=100%`
};

template <class Make>
std::vector<MissingNumber> missing_numbers(std::string_view text, const NameTable<Make>& table) {
  const std::vector<Spec> terms = parse_spec_sum(text, table.what());
  std::vector<std::string> names;
  for (const Spec& term : terms) names.push_back(term.name);
  const std::vector<std::string> owners = term_owners(names);
  std::vector<MissingNumber> missing;
  for (std::size_t i = 0; i < terms.size(); ++i)
    for (const ParameterInfo& parameter : table.find(terms[i].name).parameters)
      if (parameter.default_text.empty() && !terms[i].values.contains(parameter.name))
        missing.push_back({owners[i] + parameter.name,
                           terms[i].name + ":" + parameter.name + (parameter.is_length ? "=100%" : "=1")});
  return missing;
}

/// @throws InputError where a number is neither given nor to be fitted, and has no default
template <class Make>
void require_numbers(const OpenSpec& spec, const NameTable<Make>& table) {
  for (const MissingNumber& number : missing_numbers(spec.text, table))
    if (!spec.is_open(number.name))
      throw InputError(table.what() + " " + quoted_line(spec.text) + " needs " + number.name + ", as in " +
                       number.example + "; " + number.example.substr(0, number.example.find('=')) +
                       "=fit where it is to be fitted");
}

}  // namespace pulson
