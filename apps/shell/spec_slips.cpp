#include "spec_slips.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

// A model that takes parameters, by its option.
struct SpecRow {
  std::string_view option;
  std::string name;
  std::vector<std::string> parameters;
};

template <class Table>
void add_rows(std::string_view option, const Table& table, std::vector<SpecRow>& rows) {
  for (const auto& row : table.rows()) {
    rows.push_back({option, row.name, {}});
    for (const ParameterInfo& parameter : row.parameters) rows.back().parameters.push_back(parameter.name);
  }
}

const std::vector<SpecRow>& spec_rows() {
  static const std::vector<SpecRow> kRows = [] {
    std::vector<SpecRow> rows;
    add_rows("--noise", noise_table(), rows);
    add_rows("--kernel", kernel_table(), rows);
    return rows;
  }();
  return kRows;
}

bool contains_name(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_model(std::string_view option, std::string_view name) {
  return std::any_of(spec_rows().begin(), spec_rows().end(),
                     [&](const SpecRow& row) { return row.option == option && row.name == name; });
}

bool has_parameter(std::string_view option, std::string_view name) {
  return std::any_of(spec_rows().begin(), spec_rows().end(),
                     [&](const SpecRow& row) { return row.option == option && contains_name(row.parameters, name); });
}

void refuse_loose_parameter(std::string_view option, std::string_view spec, const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos || !has_parameter(option, word.substr(0, equals)) || is_there(word)) return;
  const std::string_view join = spec.find(':') == std::string_view::npos ? ":" : ",";
  throw InputError(fmt::format("'{}' is a word of its own behind {} {}; did you mean '{}{}{}'?", word, option, spec,
                               spec, join, word));
}

// The models of `a,b:x=1,y=2,c`: parts at commas that begin with a model's name.
std::vector<std::string> models_in(std::string_view option, std::string_view spec) {
  std::vector<std::string> models;
  for (bool is_last = false; !is_last;) {
    const std::size_t comma = spec.find(',');
    is_last = comma == std::string_view::npos;
    const std::string part(spec.substr(0, comma));
    if (models.empty() || is_model(option, part.substr(0, part.find(':'))))
      models.push_back(part);
    else
      models.back() += "," + part;
    if (!is_last) spec.remove_prefix(comma + 1);
  }
  return models;
}

void refuse_list(std::string_view option, std::string_view spec, bool may_repeat) {
  const std::vector<std::string> models = models_in(option, spec);
  if (models.size() < 2) return;
  std::string remedy = fmt::format("this verb takes one; {} joins them into a sum", fmt::join(models, "+"));
  if (may_repeat) {
    remedy = fmt::format("repeat {}:", option);
    for (const std::string& model : models) remedy += fmt::format(" {} {}", option, model);
  }
  throw InputError(fmt::format("{} '{}' lists {} models; {}", option, spec, models.size(), remedy));
}

}  // namespace

std::string parameter_advice(const CLI::App& verb, const std::string& name, const std::string& value) {
  for (const SpecRow& row : spec_rows()) {
    const bool has_option = verb.get_option_no_throw(std::string(row.option)) != nullptr;
    if (has_option && contains_name(row.parameters, name))
      return fmt::format("; {} is a parameter of {}, as in {} {}:{}={}", name, row.option, row.option, row.name, name,
                         value.empty() ? "1" : value);
  }
  return {};
}

void check_specs(const CLI::App& verb, const std::vector<std::string>& arguments) {
  for (std::size_t i = 1; i < arguments.size() && arguments[i] != "--"; ++i) {
    const std::size_t equals = arguments[i].find('=');
    const std::string option = arguments[i].substr(0, equals);
    const CLI::Option* const known = verb.get_option_no_throw(option);
    if ((option != "--noise" && option != "--kernel") || known == nullptr) continue;
    if (equals == std::string::npos && i + 1 == arguments.size()) return;
    const std::string spec = equals == std::string::npos ? arguments[++i] : arguments[i].substr(equals + 1);
    refuse_list(option, spec, known->get_items_expected_max() > 1);
    if (i + 1 < arguments.size()) refuse_loose_parameter(option, spec, arguments[i + 1]);
  }
}

}  // namespace pulson
