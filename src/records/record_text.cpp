#include "record_text.hpp"

#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson::records {
namespace {

using formats::Json;

struct Place {
  std::string name;  ///< as in `.specimens[3].rms`
  double value;
};

// The first number that is not finite. Its name is put together on the way back, so that others cost nothing.
std::optional<Place> find_not_finite(const Json& json) {
  if (json.is_number_float()) {
    const auto value = json.get<double>();
    return std::isfinite(value) ? std::nullopt : std::optional<Place>({"", value});
  }
  if (json.is_object())
    for (auto item = json.begin(); item != json.end(); ++item)
      if (const auto found = find_not_finite(*item))
        return Place{fmt::format(".{}{}", item.key(), found->name), found->value};
  if (json.is_array())
    for (std::size_t i = 0; i < json.size(); ++i)
      if (const auto found = find_not_finite(json[i]))
        return Place{fmt::format("[{}]{}", i, found->name), found->value};
  return std::nullopt;
}

}  // namespace

const Json& require_finite(const Json& record) {
  if (const auto found = find_not_finite(record))
    throw NumericalError(
        fmt::format("the result is not finite, and nothing is written: '{}' is {}; lengths, times and amplitudes are "
                    "too large or too small for each other, check the options that set them",
                    std::string_view(found->name).substr(1), found->value));
  return record;
}

std::string record_text(const Json& record, int indent) {
  return require_finite(record).dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json defined_or_null(Json value) {
  if (value.is_number_float() && !std::isfinite(value.get<double>())) return nullptr;
  if (value.is_structured())
    for (Json& item : value) item = defined_or_null(std::move(item));
  return value;
}

}  // namespace pulson::records
