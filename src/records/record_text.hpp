#pragma once

#include <string>

#include "formats/json/json_reader.hpp"

namespace pulson::records {

/// The gate that every record passes before it is written: it holds no number that is not finite.
/// @return the same record
/// @throws NumericalError that names the first such number: "'cost.total' is nan"
const formats::Json& require_finite(const formats::Json& record);

/// A record in lines, indented. Bytes that are not UTF-8, as paths may hold them, become U+FFFD: JSON cannot hold them.
/// @throws NumericalError as require_finite()
std::string record_text(const formats::Json& record, int indent = 2);

/// A number, or lists of numbers, that may be undefined, such as the standard error of a single value: null where it is
/// not finite. For what a record may lack alone; what it claims goes in as it is.
formats::Json defined_or_null(formats::Json value);

}  // namespace pulson::records
